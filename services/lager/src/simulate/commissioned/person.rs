//! A person in front of a simulated robot in virtual time: answers what a commissioning asks, from what
//! he sees, and takes the robot and its arm into his hands.

use std::f64::consts::TAU;
use std::ops::{Deref, DerefMut};
use std::time::Duration;

use lager_bridge::buttons::Told;
use lager_commission::{Answer, Built, Commissioning, Effect, Joint, Question, Step, Takes, Way};
use lager_orders::{Language, Mode, Moment, SwitchKind};
use lager_plant::{Build, ButtonsBuild, Pose, World};
use lager_stop::Stop;
use lager_supervisor::mission::{Helper, Mission, Watch};
use lager_topics::{Ask, AskKind, BridgeAnswer, ButtonLines, Part, Role, StopCause};
use lager_wire::{ArmPose, ArmProfile, SERVO_MAX};

use super::super::Whole;
use super::super::built::robot;
use crate::commission::uncalibrate;
use crate::config::Config;

/// Virtual time in which a robot must be commissioned.
const PATIENCE: Duration = Duration::from_secs(600);
/// How long a person takes until he answers.
const REACTION: Duration = Duration::from_millis(700);
/// How late he is where he watches a robot that moves.
const LATE: Duration = Duration::from_millis(80);
/// How often a key repeats that is held.
const REPEATS: Duration = Duration::from_millis(40);
/// A joint that has stood for so long has gone as far as it goes.
const STANDS: Duration = Duration::from_millis(500);
/// How long a button is held at least, and let go.
const PRESS: Duration = Duration::from_millis(1_000);
/// As far as this from the ends of what a servo measures a joint may go, if nothing stops it before.
const LEAST: u16 = 64;
/// Where the arm rests when a person lays it down.
const LYING: u16 = 300;
/// How long he takes to reach a button of the robot; he presses it for twice as long.
const TOUCH: Duration = Duration::from_millis(120);
/// How far he moves the line sensors to either side, in mm, and in how many seconds to and fro.
const SWAY: (f64, f64) = (60.0, 1.6);
/// Where the line sensors are over bare floor, and where the robot has room to turn.
const FLOOR: Pose = pose(200.0, 200.0);
const ROOM: Pose = pose(500.0, 500.0);
/// On the line, with straight tape ahead.
pub(super) const LINE: Pose = pose(0.0, 0.0);
/// The length of the measured drive, in mm.
const DRIVE: f64 = 600.0;

const fn pose(x: f64, y: f64) -> Pose {
    Pose { x, y, heading: 0.0 }
}

/// A commissioning, and the request that waits for its answer.
pub(in crate::simulate) struct Wizard {
    machine: Commissioning,
    asked: Option<Asked>,
}

#[derive(Clone, Copy)]
enum Asked {
    Part(Part),
    Calibration,
    Thresholds,
    Lines,
}

impl Deref for Wizard {
    type Target = Commissioning;

    fn deref(&self) -> &Commissioning {
        &self.machine
    }
}

impl DerefMut for Wizard {
    fn deref_mut(&mut self) -> &mut Commissioning {
        &mut self.machine
    }
}

impl Whole {
    pub(in crate::simulate) fn with_wizard(&mut self, act: impl FnOnce(&mut Wizard, Moment)) {
        let now = self.moment();
        if let Some(wizard) = &mut self.wizard {
            act(wizard, now);
        }
    }

    pub(in crate::simulate) fn wizard_hears(&mut self, answer: &BridgeAnswer) {
        let outcome = answer.outcome.get();
        self.with_wizard(|wizard, now| match wizard.asked.take() {
            Some(Asked::Part(part)) => wizard.described(now, part, outcome),
            Some(Asked::Calibration) => wizard.calibrates(now, outcome),
            Some(Asked::Thresholds) => wizard.uncalibrated(now, outcome),
            Some(Asked::Lines) => wizard.lines(now, Some(answer)),
            None => {}
        });
    }
}

/// A robot, and a person in front of it.
pub(super) struct Person {
    pub(super) whole: Whole,
    pub(super) build: Build,
    /// Since when the present question is asked.
    pub(super) asked: Option<(Question, Duration)>,
    /// The robot's pose when it began to move, and since when it has moved as far as it should.
    begun: Pose,
    there: Option<Duration>,
    /// How the wheels turned last.
    ways: [Way; 2],
    /// The button, where one is to be held.
    button: Button,
    pub(super) said: Vec<String>,
    pub(super) kept: Option<Built>,
}

/// A button that a person holds and lets go.
#[derive(Clone, Copy, Default)]
struct Button {
    is_held: bool,
    /// Since when it is so, and when the key was repeated last.
    since: Duration,
    repeated: Duration,
    /// How often it was held.
    times: u8,
    /// Where the servos were before, and where they are, since when.
    from: [u16; 8],
    at: [u16; 8],
    stands: Duration,
}

impl Person {
    pub(super) fn new(config: &Config, build: Build, seed: u64) -> Self {
        let mut whole = robot(config, build, seed);
        whole.watch = Watch::new(Mission::of_others(), Helper::Nobody);
        whole.wizard = Some(Wizard {
            machine: Commissioning::new(config.commissioned()),
            asked: None,
        });
        let mut person = Self {
            whole,
            build,
            asked: None,
            begun: LINE,
            there: None,
            ways: [Way::Still; 2],
            button: Button::default(),
            said: Vec::new(),
            kept: None,
        };
        while !person.health().boards_are_ready() {
            person.turn();
        }
        person.whole.ask(&Ask {
            kind: AskKind::SetMode.into(),
            mode: Mode::Manual.into(),
            ..Ask::default()
        });
        person
    }

    pub(super) fn health(&self) -> lager_topics::Health {
        self.whole.seen.health.unwrap_or_default()
    }

    pub(super) fn machine(&mut self) -> &mut Commissioning {
        &mut self.whole.wizard.as_mut().expect("one").machine
    }

    /// A millisecond, in which everything is done that the commissioning wants.
    pub(super) fn turn(&mut self) {
        let _ = self.whole.turn();
        let now = self.whole.moment();
        self.machine().turn(now);
        for effect in self.machine().effects() {
            let (asked, ask) = match effect {
                Effect::Steer(order) => {
                    self.whole.orders.push(order);
                    self.whole.stirred = true;
                    continue;
                }
                Effect::Keep(built) => {
                    self.kept = Some(built);
                    continue;
                }
                Effect::Describe(part, robot) => (Asked::Part(part), Ask::describe(part, &robot)),
                Effect::Uncalibrate => (Asked::Thresholds, uncalibrate()),
                Effect::Listen => (Asked::Lines, Ask::listen()),
                Effect::Calibrate => {
                    let kind = AskKind::Calibrate.into();
                    let ask = Ask {
                        kind,
                        ..Ask::default()
                    };
                    (Asked::Calibration, ask)
                }
            };
            self.whole.wizard.as_mut().expect("one").asked = Some(asked);
            let told = told(self.whole.robot.world());
            self.whole.bridge.hear_lines(told);
            self.whole.ask(&ask);
        }
        for said in self.machine().said() {
            self.said.push(said.text(Language::English));
        }
    }

    /// Looks and moves things, and answers what is asked.
    fn act(&mut self) {
        self.turn();
        let now = self.whole.now;
        let question = self.machine().question();
        if self.asked.map(|(question, _)| question) != question {
            self.asked = question.map(|question| (question, now));
            self.there = None;
            if let Some(question) = question {
                self.prepare(question);
            }
        }
        let Some((question, since)) = self.asked else {
            return self.watch();
        };
        if question.takes() == Takes::Hold {
            return self.press(question);
        }
        self.touch(question, now.saturating_sub(since));
        let pose = self.whole.robot.world().pose();
        let is_there = match question {
            Question::TurnRound => pose.heading - self.begun.heading >= TAU,
            Question::SpeedThere => pose.x - self.begun.x >= DRIVE,
            _ => now >= since + REACTION - LATE,
        };
        if is_there {
            self.there.get_or_insert(now);
        }
        if self.there.is_some_and(|there| now >= there + LATE) {
            let answer = self.answer(question);
            self.asked = None;
            let now = self.whole.moment();
            self.machine().answer(now, answer);
        }
    }

    /// What a person does before he answers.
    fn prepare(&mut self, question: Question) {
        self.begun = self.whole.robot.world().pose();
        let positions = self.whole.robot.world().state().servo_positions;
        self.button = Button {
            from: positions,
            at: positions,
            since: self.whole.now,
            ..Button::default()
        };
        let shown = self.machine().joint();
        let world = self.whole.robot.world_mut();
        let drawn = ArmProfile::default();
        let mut pose = |pose: ArmPose| {
            for (joint, position) in [
                (Joint::Base, pose.base),
                (Joint::Shoulder, pose.shoulder),
                (Joint::Elbow, pose.elbow),
                (Joint::Wrist, pose.wrist),
            ] {
                world.servos().bring(joint.servo(), position.into());
            }
        };
        match question {
            Question::LineFloor => world.place(FLOOR),
            Question::LineSway | Question::LineTape | Question::Speed => world.place(LINE),
            Question::RangeFar => world.hold_before_ranger(300.0),
            Question::RangeNear => world.hold_before_ranger(200.0),
            Question::WheelsAhead | Question::WheelsLeft => {
                self.ways = [Way::Still; 2];
                world.lift();
            }
            Question::Turn => world.place(ROOM),
            Question::JointEnd => {
                let (joint, is_upper) = shown.expect("a joint");
                if (joint, is_upper) == (Joint::Base, false) {
                    for lying in [Joint::Shoulder, Joint::Elbow] {
                        world.servos().bring(lying.servo(), LYING.into());
                    }
                }
                let to = match (joint, is_upper) {
                    (Joint::Gripper, false) => 0,
                    (_, false) => LEAST,
                    (Joint::Gripper, true) => drawn.gripper_open,
                    (_, true) => SERVO_MAX - LEAST,
                };
                world.servos().bring(joint.servo(), to.into());
            }
            Question::PoseReach => {
                let logic = Config::default().logic;
                pose(ArmPose {
                    shoulder: logic.reach_shoulder,
                    elbow: logic.reach_elbow,
                    ..drawn.carry
                });
            }
            Question::PoseCarry => pose(drawn.carry),
            Question::PoseDrop => pose(drawn.drop),
            Question::PoseNeutral => pose(drawn.neutral),
            Question::ButtonsFree => (0..2).for_each(|button| world.press(button, false)),
            Question::Finish => world.fill_claw(false),
            _ => {}
        }
    }

    /// Presses a button of the robot for a moment, or moves its switch, if it has that.
    fn touch(&mut self, question: Question, since: Duration) {
        let buttons = self.build.buttons;
        let (button, is_back) = match question {
            Question::ResetButton if buttons.reset.is_some() => (0, true),
            Question::ModeSwitch => match buttons.mode {
                Some((_, kind)) => (1, kind == SwitchKind::Press),
                None => return,
            },
            _ => return,
        };
        let is_closed = since >= TOUCH && (since < TOUCH * 3 || !is_back);
        self.whole.robot.world_mut().press(button, is_closed);
    }

    /// Holds the button until what moves stands, lets it go, and answers when everything was seen.
    fn press(&mut self, question: Question) {
        let now = self.whole.now;
        let moment = self.whole.moment();
        let positions = self.whole.robot.world().state().servo_positions;
        let mut button = self.button;
        if positions != button.at {
            (button.at, button.stands) = (positions, now);
        }
        let is_long = now >= button.since + PRESS;
        let wanted = if question == Question::JointMoves {
            1
        } else {
            2
        };
        if button.is_held {
            if is_long && now >= button.stands + STANDS {
                (button.is_held, button.since) = (false, now);
            } else if now >= button.repeated + REPEATS {
                button.repeated = now;
                self.machine().answer(moment, Answer::Hold);
            }
        } else if is_long && button.times < wanted {
            if question == Question::ClawFull && button.times == 1 {
                self.whole.robot.world_mut().fill_claw(true);
            }
            (button.is_held, button.since, button.stands) = (true, now, now);
            button.times += 1;
        } else if is_long {
            self.asked = None;
            let goes_well = self.machine().joint().is_none_or(|(joint, grows)| {
                let servo = joint.servo();
                grows == (positions[servo] > button.from[servo])
            });
            let answer = if goes_well { Answer::Yes } else { Answer::No };
            self.machine().answer(moment, answer);
        }
        self.button = button;
    }

    /// What a person does and sees while nothing is asked.
    fn watch(&mut self) {
        let now = self.whole.now.as_secs_f64();
        let step = self.machine().step();
        let world = self.whole.robot.world_mut();
        if step == Step::Line {
            let (far, period) = SWAY;
            let y = far * (TAU * now / period).sin();
            world.place(Pose { y, ..LINE });
        }
        for (way, speed) in self.ways.iter_mut().zip(world.state().wheel_speeds) {
            match speed {
                20.0.. => *way = Way::Forwards,
                ..-20.0 => *way = Way::Backwards,
                _ => {}
            }
        }
    }

    fn answer(&self, question: Question) -> Answer {
        match question {
            Question::RangeFar => Answer::Number(30.0),
            Question::RangeNear => Answer::Number(20.0),
            Question::SawAhead | Question::SawLeft => Answer::Ways(self.ways),
            Question::Battery if self.build.divider => {
                Answer::Number(self.whole.robot.world().battery_volts() as f32)
            }
            Question::Battery => Answer::No,
            Question::ButtonsFree if self.build.buttons == ButtonsBuild::default() => Answer::No,
            Question::ResetButton if self.build.buttons.reset.is_none() => Answer::No,
            Question::ModeSwitch if self.build.buttons.mode.is_none() => Answer::No,
            Question::Speed => Answer::Number((DRIVE / 10.0) as f32),
            _ => Answer::Yes,
        }
    }

    /// Everything, until it is to be saved.
    pub(super) fn commission(&mut self) -> Built {
        let end = self.whole.now + PATIENCE;
        while !self.machine().is_over() {
            self.act();
            assert!(self.whole.now < end, "{:?}: {:?}", self.build, self.said);
        }
        self.turn();
        self.kept.expect("it was saved")
    }

    /// Goes on until this is asked.
    pub(super) fn until(&mut self, question: Question) {
        let end = self.whole.now + PATIENCE;
        while self.machine().question() != Some(question) {
            self.act();
            assert!(self.whole.now < end, "{question:?}: {:?}", self.said);
        }
    }

    /// Goes on without any answer.
    pub(super) fn wait(&mut self, span: Duration) {
        let end = self.whole.now + span;
        while self.whole.now < end {
            self.turn();
        }
    }

    pub(super) fn say(&mut self, answer: Answer) {
        let now = self.whole.moment();
        self.machine().answer(now, answer);
    }

    /// Somebody else stops the robot.
    pub(super) fn stop(&mut self) {
        let stop = Stop::new(Role::Operator, StopCause::Ordered, 1);
        self.whole.bridge.stop(stop);
        self.whole.stirred = true;
    }

    pub(super) fn duties(&self) -> [i16; 2] {
        self.whole.robot.world().duties()
    }
}

/// What the bridge's thread tells of the lines.
fn told(world: &World) -> Told {
    Told {
        state: ButtonLines::Read,
        chip: 0,
        levels: world.levels(),
    }
}
