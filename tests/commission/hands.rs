//! The hands and eyes of a person in front of a simulated or emulated robot that is commissioned:
//! what he does before he answers a question, at a terminal or at a page, and what he sees.

use lager_commission::{Joint, Question};
use lager_floor::Heading;
use lager_orders::SwitchKind;
use lager_plant::ButtonsBuild;
use lager_ports::{Bus, Client, Subscriber};
use lager_tests::{WATCHDOG, wait_for};
use lager_topics::{Outcome, Truth, TruthPose, WorldAsk, WorldAskKind, WorldRequest};
use lager_wire::{ArmPose, ArmProfile, SERVO_MAX};

/// The length of the measured drive, in mm.
pub(crate) const DRIVE: f64 = 600.0;
/// How far the line sensors are moved to either side, in mm.
const SWAY: i16 = 60;
/// Where shoulder and elbow are at goods, as drawn.
const REACH: [u16; 2] = [312, 488];
/// As far as this from the ends of what a servo measures a joint may go, if nothing stops it before.
const LEAST: u16 = 64;

/// A pause, the shortest press of a button, and how long something stands that has ended its
/// movement, in looks of 20 ms.
const PAUSE: u32 = 40;
const PRESS: u32 = 60;
const STANDS: u32 = 40;
/// The same of a finger at a button of the robot.
const TOUCH: u32 = 12;

/// The ways in which the positions of [`Joint::ALL`] grow, as they are shown.
pub(crate) const GROWS: [&str; 6] = [
    "to the left",
    "up",
    "out",
    "tilting up",
    "counter-clockwise, seen from the claw",
    "opening",
];

/// The hands, and what the eyes have seen.
pub(crate) struct Hands {
    truth: Subscriber<TruthPose>,
    world: Client<WorldRequest>,
    pub(crate) seen: Truth,
    /// How often it was seen: every 20 ms of the robot's own time, which passes more slowly for
    /// emulated boards.
    looks: u32,
    /// Which way the wheels turned last: 'f', 'b' or '0'.
    ways: [char; 2],
    /// The robot's own buttons.
    buttons: ButtonsBuild,
}

impl Hands {
    pub(crate) fn new(bus: &Bus, buttons: ButtonsBuild) -> Self {
        Self {
            truth: bus.subscriber().expect("a topic"),
            world: bus.client().expect("a request"),
            seen: Truth::default(),
            looks: 0,
            ways: ['0'; 2],
            buttons,
        }
    }

    /// Looks at the robot.
    pub(crate) fn look(&mut self) {
        while let Some(truth) = self.truth.receive().expect("readable") {
            self.seen = *truth;
            self.looks += 1;
            let speeds = [truth.left_mm_per_s, truth.right_mm_per_s];
            for (way, speed) in self.ways.iter_mut().zip(speeds) {
                match speed {
                    20.0.. => *way = 'f',
                    ..-20.0 => *way = 'b',
                    _ => {}
                }
            }
        }
    }

    /// Which way the left and the right wheels turned last.
    pub(crate) const fn ways(&self) -> [char; 2] {
        self.ways
    }

    /// Whether a person who is asked this has to say no, because his robot has no such thing.
    pub(crate) fn lacks(&self, question: Question) -> bool {
        let ButtonsBuild { reset, mode } = self.buttons;
        match question {
            Question::ButtonsFree => reset.is_none() && mode.is_none(),
            Question::ResetButton => reset.is_none(),
            Question::ModeSwitch => mode.is_none(),
            _ => false,
        }
    }

    /// Waits until the robot has told so often where it is.
    fn wait(&mut self, looks: u32) {
        let end = self.looks + looks;
        wait_for("the robot's time", || {
            self.look();
            (self.looks >= end).then_some(())
        });
    }

    /// Takes the time that a sensor needs to see what has been done.
    pub(crate) fn pause(&mut self) {
        self.wait(PAUSE);
    }

    /// Does something with the hands.
    pub(crate) fn act(&mut self, kind: WorldAskKind, x: u8, y: u8) {
        let ask = WorldAsk {
            kind: kind.into(),
            x,
            y,
            heading: Heading::Right.into(),
            ..WorldAsk::default()
        };
        // On a busy machine an emulator answers late, and what may be done twice is done again.
        let answer = wait_for("the world", || {
            let answer = self.world.call(ask, WATCHDOG / 100).ok();
            answer.filter(|answer| answer.outcome != Outcome::NoBoard)
        });
        assert_eq!(answer.outcome, Outcome::Done, "{kind:?}: {answer:?}");
    }

    /// Puts it down on the first crossing, and then so far to the left, in mm.
    fn place_beside(&mut self, left: i16) {
        loop {
            self.place(0, 0);
            if self.shift(left) {
                return;
            }
        }
    }

    /// Puts it down so far to the left of where it stands, in mm. Returns whether it was done in time.
    fn shift(&mut self, left: i16) -> bool {
        let ask = WorldAsk {
            kind: WorldAskKind::Shift.into(),
            x: u8::try_from(left + 128).expect("a small step"),
            ..WorldAsk::default()
        };
        let answer = self.world.call(ask, WATCHDOG / 100);
        answer.is_ok_and(|answer| answer.outcome == Outcome::Done)
    }

    fn place(&mut self, x: u8, y: u8) {
        self.act(WorldAskKind::Place, x, y);
    }

    /// Moves the line sensors over tape and floor until something else is asked.
    pub(crate) fn sway(&mut self, mut is_asked: impl FnMut() -> bool) {
        for step in (0..).map(|step: i16| step % 24) {
            if step == 0 {
                self.place_beside(-SWAY);
            }
            self.shift(if step < 12 { 10 } else { -10 });
            if is_asked() {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(60));
        }
    }

    /// Brings a joint of the arm to a position as drawn, and holds it.
    fn bring(&mut self, joint: Joint, position: u16) {
        let servo = u8::try_from(joint.servo()).expect("a servo");
        let quarter = u8::try_from(position / 4).expect("a position");
        self.act(WorldAskKind::Bring, servo, quarter);
    }

    /// Brings the arm to a pose.
    fn pose(&mut self, pose: ArmPose) {
        self.bring(Joint::Base, pose.base);
        self.bring(Joint::Shoulder, pose.shoulder);
        self.bring(Joint::Elbow, pose.elbow);
        self.bring(Joint::Wrist, pose.wrist);
        self.pause();
    }

    /// Brings a joint to its lower or upper end.
    fn show_end(&mut self, (joint, is_upper): (Joint, bool)) {
        if (joint, is_upper) == (Joint::Base, false) {
            self.bring(Joint::Shoulder, 300);
            self.bring(Joint::Elbow, 300);
        }
        let to = match (joint, is_upper) {
            (Joint::Gripper, false) => 0,
            (_, false) => LEAST,
            (Joint::Gripper, true) => ArmProfile::default().gripper_open,
            (_, true) => SERVO_MAX - LEAST,
        };
        self.bring(joint, to);
    }

    /// Presses a button of the robot, and lets it go if it springs back.
    fn touch(&mut self, button: u8, springs_back: bool) {
        self.wait(TOUCH);
        self.act(WorldAskKind::Press, button, 1);
        self.wait(TOUCH);
        if springs_back {
            self.act(WorldAskKind::Press, button, 0);
        }
        self.wait(TOUCH);
    }

    /// What is done before this is answered: whatever can be seen by a sensor then has been seen.
    /// `joint` is the one that is asked for, and whether its upper end is.
    pub(crate) fn prepare(&mut self, question: Question, joint: Option<(Joint, bool)>) {
        let drawn = ArmProfile::default();
        match question {
            Question::Finish | Question::ClawEmpty => self.act(WorldAskKind::Fill, 0, 0),
            Question::LineFloor | Question::LineTape => {
                self.place_beside(if question == Question::LineFloor {
                    100
                } else {
                    0
                });
                self.pause();
            }
            Question::RangeFar | Question::RangeNear => {
                self.act(WorldAskKind::Hold, cm(question), 0);
                self.pause();
            }
            Question::WheelsAhead | Question::WheelsLeft => {
                self.act(WorldAskKind::Lift, 0, 0);
                self.pause();
                self.look();
                self.ways = ['0'; 2];
            }
            Question::Battery => self.pause(),
            Question::JointEnd => self.show_end(joint.expect("it is named")),
            Question::PoseReach => self.pose(ArmPose {
                shoulder: REACH[0],
                elbow: REACH[1],
                ..drawn.carry
            }),
            Question::PoseCarry | Question::PoseNeutral => self.pose(drawn.carry),
            Question::PoseDrop => self.pose(drawn.drop),
            Question::Turn => {
                self.place(1, 1);
                self.pause();
            }
            Question::Speed => {
                self.place(0, 0);
                self.pause();
            }
            Question::ButtonsFree => {
                for button in 0..2 {
                    self.act(WorldAskKind::Press, button, 0);
                }
                self.pause();
            }
            Question::ResetButton if self.buttons.reset.is_some() => self.touch(0, true),
            Question::ModeSwitch => {
                if let Some((_, kind)) = self.buttons.mode {
                    self.touch(1, kind == SwitchKind::Press);
                }
            }
            _ => {}
        }
    }

    /// Does `again` all the time until what moves stands, and then `let_go`, and takes a breath.
    pub(crate) fn hold(&mut self, mut again: impl FnMut(), let_go: impl FnOnce()) {
        let begun = self.looks;
        let (mut at, mut stands) = (self.seen.servo_position, begun);
        while self.looks < begun + PRESS || self.looks < stands + STANDS {
            again();
            std::thread::sleep(std::time::Duration::from_millis(20));
            self.look();
            if self.seen.servo_position != at {
                (at, stands) = (self.seen.servo_position, self.looks);
            }
        }
        let_go();
        self.wait(PRESS);
    }

    /// Puts goods between the jaws.
    pub(crate) fn fill(&mut self) {
        self.act(WorldAskKind::Fill, 1, 0);
    }
}

/// Moves a mode switch to autonomous, which stands at manual in a new world. A robot without one lets
/// logic drive by itself.
pub(crate) fn let_logic_drive(bus: &Bus, buttons: ButtonsBuild) {
    let is_switch = |(_, kind)| kind == SwitchKind::Position;
    if buttons.mode.is_some_and(is_switch) {
        Hands::new(bus, buttons).act(WorldAskKind::Press, 1, 1);
    }
}

/// The distance at which something is held for this question.
pub(crate) const fn cm(question: Question) -> u8 {
    match question {
        Question::RangeFar => 30,
        _ => 20,
    }
}
