//! A person with a terminal in front of a simulated or emulated robot: answers what `lager commission`
//! asks, from what he sees, and takes the robot and its arm into his hands.

use std::f64::consts::TAU;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use lager_commission::{Joint, Question};
use lager_floor::Heading;
use lager_orders::Language;
use lager_ports::{Bus, Client, Subscriber};
use lager_tests::{Domain, WATCHDOG, wait_for};
use lager_topics::{Outcome, Truth, TruthPose, WorldAsk, WorldAskKind, WorldRequest};
use lager_wire::{ArmPose, ArmProfile, SERVO_MAX};

/// How far the line sensors are moved to either side, in mm.
const SWAY: i16 = 60;
/// Where shoulder and elbow are at goods, as drawn.
const REACH: [u16; 2] = [312, 488];
/// As far as this from the ends of what a servo measures a joint may go, if nothing stops it before.
const LEAST: u16 = 64;
/// The length of the measured drive, in mm.
const DRIVE: f64 = 600.0;

/// A pause, the shortest press of a button, and how long something stands that has ended its
/// movement, in looks of 20 ms.
const PAUSE: u32 = 40;
const PRESS: u32 = 60;
const STANDS: u32 = 40;

/// A person with a terminal, who sees the robot and takes it into his hands.
pub(crate) struct Person {
    pub(crate) child: Child,
    pub(crate) typing: ChildStdin,
    lines: Receiver<String>,
    /// Everything that was printed.
    pub(crate) printed: Vec<String>,
    truth: Subscriber<TruthPose>,
    hands: Client<WorldRequest>,
    seen: Truth,
    /// How often it was seen.
    looks: u32,
    /// Which way the wheels turned last: 'f', 'b' or '0'.
    ways: [char; 2],
    /// The joint that is asked for, and whether its position grows in the way that is named.
    joint: Option<(Joint, bool)>,
    /// Whether the steering board measures the battery.
    has_divider: bool,
}

/// The joints and the ways in which their positions grow, as they are printed.
const JOINTS: [(Joint, &str, &str); 6] = [
    (Joint::Base, "base", "to the left"),
    (Joint::Shoulder, "shoulder", "up"),
    (Joint::Elbow, "elbow", "out"),
    (Joint::Wrist, "wrist", "tilting up"),
    (
        Joint::Rotation,
        "rotation of the claw",
        "counter-clockwise, seen from the claw",
    ),
    (Joint::Gripper, "claw", "opening"),
];

impl Person {
    /// Someone who commissions the robot. Whether he can measure the battery depends on its divider.
    pub(crate) fn new(domain: &Domain, bus: &Bus, config: &str, has_divider: bool) -> Self {
        let mut command = domain.lager(&["commission", "--config", config]);
        command.env("LC_ALL", "C");
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let (says, lines) = channel();
        let output = BufReader::new(child.stdout.take().expect("its output"));
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let _ = says.send(line);
            }
        });
        Self {
            typing: child.stdin.take().expect("its input"),
            child,
            lines,
            printed: Vec::new(),
            truth: bus.subscriber().expect("a topic"),
            hands: bus.client().expect("a request"),
            seen: Truth::default(),
            looks: 0,
            ways: ['0'; 2],
            joint: None,
            has_divider,
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
        self.printed.extend(self.lines.try_iter());
    }

    /// Waits until the robot is as it should be.
    fn until(&mut self, what: &str, mut is_so: impl FnMut(&Self) -> bool) {
        wait_for(what, || {
            self.look();
            assert!(
                self.child.try_wait().expect("a child").is_none(),
                "{what}: {:#?}",
                self.printed
            );
            is_so(self).then_some(())
        });
    }

    /// What was asked since the last answer, if its values are shown, too.
    fn question(&self) -> Option<Question> {
        let all = Question::ALL.map(|question| (question, question.text(Language::English)));
        let lines = self.printed.iter().rev().skip(1);
        let mut asked = lines.filter_map(|line| all.iter().find(|(_, text)| text == line));
        asked.next().map(|(question, _)| *question)
    }

    /// Waits until something is asked.
    pub(crate) fn asked(&mut self) -> Question {
        self.until("a question", |person| person.question().is_some());
        let question = self.question().expect("as waited for");
        let said = self.printed.iter().rev().find_map(|line| {
            let (joint, way) = line.strip_suffix(':')?.split_once(", ")?;
            let (joint, _, grows) = JOINTS.iter().find(|(_, name, _)| *name == joint)?;
            Some((*joint, *grows == way))
        });
        self.joint = said;
        self.printed.clear();
        question
    }

    /// Takes the time that a sensor needs to see what has been done.
    fn pause(&mut self) {
        self.wait(PAUSE);
    }

    /// Waits until the robot has told so often where it is: every 20 ms of its own time, which passes
    /// more slowly for emulated boards.
    fn wait(&mut self, looks: u32) {
        let end = self.looks + looks;
        self.until("the robot's time", |person| person.looks >= end);
    }

    pub(crate) fn say(&mut self, answer: &str) {
        writeln!(self.typing, "{answer}").expect("it listens");
    }

    /// Does something with the hands.
    fn act(&mut self, kind: WorldAskKind, x: u8, y: u8, heading: Heading) {
        let ask = WorldAsk {
            kind: kind.into(),
            x,
            y,
            heading: heading.into(),
            ..WorldAsk::default()
        };
        let answer = wait_for("the world", || self.hands.call(ask, WATCHDOG / 100).ok());
        assert_eq!(answer.outcome, Outcome::Done, "{kind:?}: {answer:?}");
    }

    /// Puts it down so far to the left of where it stands, in mm.
    fn shift(&mut self, left: i16) {
        let x = u8::try_from(left + 128).expect("a small step");
        self.act(WorldAskKind::Shift, x, 0, Heading::Right);
    }

    fn place(&mut self, x: u8, y: u8) {
        self.act(WorldAskKind::Place, x, y, Heading::Right);
    }

    /// Moves the line sensors over tape and floor until something else is asked.
    fn sway(&mut self) {
        for step in (0..).map(|step: i16| step % 24) {
            if step == 0 {
                self.place(0, 0);
                self.shift(-SWAY);
            }
            self.shift(if step < 12 { 10 } else { -10 });
            self.look();
            if self.question().is_some() {
                return;
            }
            std::thread::sleep(Duration::from_millis(60));
        }
    }

    /// Brings a joint of the arm to a position as drawn, and holds it.
    fn bring(&mut self, joint: Joint, position: u16) {
        let servo = u8::try_from(joint.servo()).expect("a servo");
        let quarter = u8::try_from(position / 4).expect("a position");
        self.act(WorldAskKind::Bring, servo, quarter, Heading::Right);
    }

    /// Brings the arm to a pose.
    fn pose(&mut self, pose: ArmPose) {
        self.bring(Joint::Base, pose.base);
        self.bring(Joint::Shoulder, pose.shoulder);
        self.bring(Joint::Elbow, pose.elbow);
        self.bring(Joint::Wrist, pose.wrist);
        self.pause();
    }

    /// Holds the enter key until what moves stands, and lets it go.
    fn press(&mut self) {
        let begun = self.looks;
        let (mut at, mut stands) = (self.seen.servo_position, begun);
        while self.looks < begun + PRESS || self.looks < stands + STANDS {
            self.say("");
            std::thread::sleep(Duration::from_millis(20));
            self.look();
            if self.seen.servo_position != at {
                (at, stands) = (self.seen.servo_position, self.looks);
            }
        }
        self.wait(PRESS);
    }

    /// Answers yes when the robot is there, unless it stands and is to begin anew.
    fn watch(&mut self, is_there: impl Fn(&Truth) -> bool) {
        self.until("the end of a movement", |person| {
            is_there(&person.seen) || person.question().is_some()
        });
        if self.question().is_none() {
            self.say("yes");
        }
    }

    /// Answers what is asked, from what is seen. Returns whether it was the last question.
    fn answer(&mut self, question: Question) -> bool {
        let begun = self.seen;
        let drawn = ArmProfile::default();
        match question {
            Question::Boards => self.say("yes"),
            Question::Finish => {
                self.act(WorldAskKind::Fill, 0, 0, Heading::Right);
                self.say("yes");
            }
            Question::LineSway => {
                self.say("yes");
                self.sway();
            }
            Question::LineFloor | Question::LineTape => {
                self.place(0, 0);
                if question == Question::LineFloor {
                    self.shift(100);
                }
                self.pause();
                self.say("yes");
            }
            Question::RangeFar | Question::RangeNear => {
                let cm = if question == Question::RangeFar {
                    30
                } else {
                    20
                };
                self.act(WorldAskKind::Hold, cm, 0, Heading::Right);
                self.pause();
                self.say(&cm.to_string());
            }
            Question::WheelsAhead | Question::WheelsLeft => {
                self.act(WorldAskKind::Lift, 0, 0, Heading::Right);
                self.pause();
                self.look();
                self.ways = ['0'; 2];
                self.say("yes");
            }
            Question::SawAhead | Question::SawLeft => {
                let ways: String = self.ways.iter().collect();
                self.say(&ways);
            }
            Question::Battery if self.has_divider => {
                self.pause();
                // What a meter shows at three cells with this charge, within half a volt.
                let volts = 10.7 + 1.7 * self.seen.battery_charge;
                self.say(&format!("{volts:.1}"));
            }
            Question::Battery => self.say("no"),
            Question::Arm | Question::Poses => self.say("yes"),
            Question::JointEnd => {
                let (joint, is_upper) = self.joint.expect("it is named");
                if (joint, is_upper) == (Joint::Base, false) {
                    self.bring(Joint::Shoulder, 300);
                    self.bring(Joint::Elbow, 300);
                }
                let to = match (joint, is_upper) {
                    (Joint::Gripper, false) => 0,
                    (_, false) => LEAST,
                    (Joint::Gripper, true) => drawn.gripper_open,
                    (_, true) => SERVO_MAX - LEAST,
                };
                self.bring(joint, to);
                self.say("yes");
            }
            Question::PoseReach => {
                self.pose(ArmPose {
                    shoulder: REACH[0],
                    elbow: REACH[1],
                    ..drawn.carry
                });
                self.say("yes");
            }
            Question::PoseCarry | Question::PoseNeutral => {
                self.pose(drawn.carry);
                self.say("yes");
            }
            Question::PoseDrop => {
                self.pose(drawn.drop);
                self.say("yes");
            }
            Question::JointMoves => {
                let (joint, grows) = self.joint.expect("it is named");
                let before = self.seen.servo_position[joint.servo()];
                self.press();
                if self.question().is_some() {
                    // The step has begun anew: a busy machine was late with an order.
                    return false;
                }
                let after = self.seen.servo_position[joint.servo()];
                assert_ne!(before, after, "{joint:?}: {:#?}", self.printed);
                self.say(if grows == (after > before) {
                    "yes"
                } else {
                    "no"
                });
            }
            Question::ClawEmpty => {
                self.act(WorldAskKind::Fill, 0, 0, Heading::Right);
                self.press();
                self.press();
                if self.question().is_some() {
                    return false;
                }
                self.say("yes");
            }
            Question::ClawFull => {
                self.press();
                self.act(WorldAskKind::Fill, 1, 0, Heading::Right);
                self.press();
                if self.question().is_some() {
                    return false;
                }
                self.say("yes");
            }
            Question::Turn => {
                self.place(1, 1);
                self.pause();
                self.say("yes");
            }
            Question::TurnRound => {
                self.watch(|truth| truth.heading_rad - begun.heading_rad >= TAU);
            }
            Question::Speed => {
                self.place(0, 0);
                self.pause();
                self.say(&format!("{:.0}", DRIVE / 10.0));
            }
            Question::SpeedThere => self.watch(|truth| truth.x_mm - begun.x_mm >= DRIVE),
        }
        question == Question::Finish
    }

    /// Answers every question.
    pub(crate) fn commission(&mut self) {
        loop {
            let question = self.asked();
            if self.answer(question) {
                break;
            }
        }
        let ended = wait_for("its end", || self.child.try_wait().expect("a child"));
        self.look();
        assert!(ended.success(), "{:#?}", self.printed);
    }
}
