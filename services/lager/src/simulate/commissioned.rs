//! Robots that nobody has described are commissioned by a person who answers from what he sees, and
//! deliver afterwards. Before that they fail, and say why.

use std::f64::consts::TAU;
use std::ops::{Deref, DerefMut};
use std::time::Duration;

use lager_commission::{Answer, Built, Commissioning, Effect, Joint, Question, Step, Takes, Way};
use lager_orders::{Language, Mode, Moment};
use lager_plant::{Build, Pose};
use lager_simulator::Wire;
use lager_stop::Stop;
use lager_supervisor::mission::{Helper, Mission, Watch};
use lager_topics::{Ask, AskKind, BridgeAnswer, Origin, Part, Role, SteeringOrder, StopCause};
use lager_wire::{ArmPose, ArmProfile, Command, OneOrTwo, ResetCause, SERVO_MAX, WheelCommand};

use super::Whole;
use super::built::{LIMIT, robot, seeds};
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
/// How far he moves the line sensors to either side, in mm, and in how many seconds to and fro.
const SWAY: (f64, f64) = (60.0, 1.6);
/// Where the line sensors are over bare floor, and where the robot has room to turn.
const FLOOR: Pose = pose(200.0, 200.0);
const ROOM: Pose = pose(500.0, 500.0);
/// On the line, with straight tape ahead.
const LINE: Pose = pose(0.0, 0.0);
/// The length of the measured drive, in mm.
const DRIVE: f64 = 600.0;

const fn pose(x: f64, y: f64) -> Pose {
    Pose { x, y, heading: 0.0 }
}

/// A commissioning, and the request that waits for its answer.
pub(super) struct Wizard {
    machine: Commissioning,
    asked: Option<Asked>,
}

#[derive(Clone, Copy)]
enum Asked {
    Part(Part),
    Calibration,
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
    pub(super) fn with_wizard(&mut self, act: impl FnOnce(&mut Wizard, Moment)) {
        let now = self.moment();
        if let Some(wizard) = &mut self.wizard {
            act(wizard, now);
        }
    }

    pub(super) fn wizard_hears(&mut self, answer: &BridgeAnswer) {
        let outcome = answer.outcome.get();
        self.with_wizard(|wizard, now| match wizard.asked.take() {
            Some(Asked::Part(part)) => wizard.described(now, part, outcome),
            Some(Asked::Calibration) => wizard.calibrates(now, outcome),
            None => {}
        });
    }
}

/// A robot, and a person in front of it.
struct Person {
    whole: Whole,
    build: Build,
    /// Since when the present question is asked.
    asked: Option<(Question, Duration)>,
    /// The robot's pose when it began to move, and since when it has moved as far as it should.
    begun: Pose,
    there: Option<Duration>,
    /// How the wheels turned last.
    ways: [Way; 2],
    /// The button, where one is to be held.
    button: Button,
    said: Vec<String>,
    kept: Option<Built>,
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
    fn new(config: &Config, build: Build, seed: u64) -> Self {
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

    fn health(&self) -> lager_topics::Health {
        self.whole.seen.health.unwrap_or_default()
    }

    fn machine(&mut self) -> &mut Commissioning {
        &mut self.whole.wizard.as_mut().expect("one").machine
    }

    /// A millisecond, in which everything is done that the commissioning wants.
    fn turn(&mut self) {
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
            Question::Finish => world.fill_claw(false),
            _ => {}
        }
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
            Question::Speed => Answer::Number((DRIVE / 10.0) as f32),
            _ => Answer::Yes,
        }
    }

    /// Everything, until it is to be saved.
    fn commission(&mut self) -> Built {
        let end = self.whole.now + PATIENCE;
        while !self.machine().is_over() {
            self.act();
            assert!(self.whole.now < end, "{:?}: {:?}", self.build, self.said);
        }
        self.turn();
        self.kept.expect("it was saved")
    }

    /// Goes on until this is asked.
    fn until(&mut self, question: Question) {
        let end = self.whole.now + PATIENCE;
        while self.machine().question() != Some(question) {
            self.act();
            assert!(self.whole.now < end, "{question:?}: {:?}", self.said);
        }
    }

    /// Goes on without any answer.
    fn wait(&mut self, span: Duration) {
        let end = self.whole.now + span;
        while self.whole.now < end {
            self.turn();
        }
    }

    fn say(&mut self, answer: Answer) {
        let now = self.whole.moment();
        self.machine().answer(now, answer);
    }

    /// Somebody else stops the robot.
    fn stop(&mut self) {
        let stop = Stop::new(Role::Operator, StopCause::Ordered, 1);
        self.whole.bridge.stop(stop);
        self.whole.stirred = true;
    }

    fn duties(&self) -> [i16; 2] {
        self.whole.robot.world().duties()
    }
}

/// The same robot, started again as it was commissioned, at the start of its warehouse.
fn restarted(person: Person, built: &Built, seed: u64) -> Whole {
    let mut config = Config::default();
    config.take_commissioned(built);
    let mut whole = robot(&config, person.build, seed);
    whole.robot = person.whole.robot;
    whole.robot.place(LINE);
    whole.now = whole.robot.now();
    whole
}

#[test]
fn a_robot_that_nobody_described_is_commissioned_and_delivers() {
    for seed in seeds() {
        let build = Build::drawn(seed);
        let mut person = Person::new(&Config::default(), build, seed);
        let built = person.commission();
        let wheels = built.robot.steering.wheels;
        let turn_s = f64::from(wheels.full_turn_ms) / 1_000.0;
        println!(
            "seed {seed}: {:.0} s, a turn in {turn_s:.2} s of {:.2}, {} mm/s",
            person.whole.now.as_secs_f64(),
            build.full_turn(),
            built.cruise_mm_per_s
        );
        assert_eq!(wheels.swapped, build.swapped, "seed {seed}");
        assert_eq!(
            [wheels.left_reversed, wheels.right_reversed],
            build.reversed,
            "seed {seed}"
        );
        assert_arm(&built.robot.arm, &build, seed);
        let mut whole = restarted(person, &built, seed);
        let limit = whole.now + LIMIT;
        assert_eq!(whole.run(limit), None, "seed {seed}: {build:?} {built:?}");
        assert_eq!(whole.robot.world().collisions(), 0, "seed {seed}");
    }
}

#[test]
fn before_that_it_fails_and_says_why() {
    for seed in seeds() {
        let build = Build::drawn(seed);
        let mut whole = robot(&Config::default(), build, seed);
        let why = whole.run(LIMIT).expect("it cannot deliver");
        println!("seed {seed}: {why}");
        assert!(whole.failure_kind().is_some(), "seed {seed}: {why}");
    }
}

/// The arm is known as it is built.
fn assert_arm(found: &ArmProfile, build: &Build, seed: u64) {
    let arm = &build.arm;
    let values = found.servo_values();
    for joint in Joint::ALL {
        let first = joint.servo();
        let [one, other] = [first, (first + 1).min(7)].map(|index| arm.ids[index]);
        let pair = match joint {
            Joint::Shoulder => Some(found.servos.shoulder),
            Joint::Elbow => Some(found.servos.elbow),
            _ => None,
        };
        // Of two that face each other, one counts as drawn, and that one is the first.
        if let (Some(OneOrTwo::Two(pair)), Some(one), Some(other)) = (pair, one, other) {
            let counts = if arm.reversed[first] {
                [other, one]
            } else {
                [one, other]
            };
            assert_eq!(pair, counts, "seed {seed}: {joint:?}");
            continue;
        }
        assert!(
            !matches!(pair, Some(OneOrTwo::Two(_))),
            "seed {seed}: {joint:?}"
        );
        assert_eq!(Some(values[first] as u8), one, "seed {seed}: {joint:?}");
        let is_reversed = values[first] & lager_wire::REVERSED != 0;
        assert_eq!(is_reversed, arm.reversed[first], "seed {seed}: {joint:?}");
    }
    let closed = ArmProfile::default()
        .gripper_closed
        .strict_add_signed(arm.offsets[7]);
    assert!(
        found.gripper_closed.abs_diff(closed) <= 6,
        "seed {seed}: {found:?}"
    );
    let [lower, upper] = arm.ends[0].map(|end| end.strict_add_signed(arm.offsets[0]));
    let told = found.limits.base;
    assert_eq!([told.lowest, told.highest], [lower, upper], "seed {seed}");
}

#[test]
fn it_begins_only_with_boards_that_a_person_may_move() {
    let mut person = Person::new(&Config::default(), Build::default(), 1);
    person.wait(Duration::from_secs(1));
    let manual = Mode::Manual;
    for (mode, stopped, why) in [
        (Mode::Autonomous, false, "not in manual mode"),
        (manual, true, "the robot is stopped"),
    ] {
        person.whole.ask(&Ask {
            kind: AskKind::SetMode.into(),
            mode: mode.into(),
            issued_ns: person.whole.moment().ns,
            ..Ask::default()
        });
        if stopped {
            person.stop();
        }
        person.wait(Duration::from_secs(1));
        person.say(Answer::Yes);
        person.wait(Duration::from_secs(1));
        let said = person.said.pop().expect("a sentence");
        assert!(said.contains(why), "{said}");
        assert_eq!(person.machine().step(), Step::Boards);
    }
}

#[test]
fn whoever_quits_leaves_the_boards_with_what_they_were_told_before() {
    let mut person = Person::new(&Config::default(), Build::drawn(1), 1);
    let before = person.health().description;
    person.until(Question::WheelsLeft);
    assert_ne!(person.health().description, before);
    let now = person.whole.moment();
    person.machine().quit(now);
    person.wait(Duration::from_secs(1));
    assert!(person.machine().is_over());
    assert_eq!(person.health().description, before);
    assert_eq!(person.kept, None);
}

#[test]
fn back_and_again_bring_back_what_held_before_and_skip_changes_nothing() {
    let build = Build {
        swapped: true,
        dark_is_low: true,
        ..Build::default()
    };
    let mut person = Person::new(&Config::default(), build, 1);
    person.until(Question::Battery);
    let found = person.machine().built().robot;
    assert!(found.steering.wheels.swapped && !found.sensors.line.dark_is_high);
    person.say(Answer::Back);
    assert_eq!(person.machine().step(), Step::Wheels);
    assert!(!person.machine().built().robot.steering.wheels.swapped);
    assert!(!person.machine().built().robot.sensors.line.dark_is_high);
    person.until(Question::SawAhead);
    person.say(Answer::Again);
    person.until(Question::WheelsAhead);
    person.say(Answer::Skip);
    assert_eq!(person.machine().step(), Step::Battery);
    assert!(!person.machine().built().robot.steering.wheels.swapped);
}

#[test]
fn nothing_moves_unasked_and_every_movement_ends_by_itself() {
    let mut person = Person::new(&Config::default(), Build::default(), 1);
    person.until(Question::WheelsAhead);
    person.wait(Duration::from_secs(5));
    assert_eq!(person.duties(), [0, 0]);
    person.say(Answer::No);
    person.wait(Duration::from_millis(300));
    assert_eq!(person.duties(), [0, 0], "no is no");
    person.say(Answer::Yes);
    person.wait(Duration::from_millis(300));
    assert_ne!(person.duties(), [0, 0]);
    person.wait(Duration::from_millis(700));
    assert_eq!(person.duties(), [0, 0], "half a second is over");

    person.until(Question::TurnRound);
    person.wait(Duration::from_secs(70));
    assert_eq!(person.duties(), [0, 0], "nobody answers");
    assert_eq!(person.machine().question(), Some(Question::Turn));
    assert!(person.said.last().is_some_and(|said| said.contains("60 s")));
}

#[test]
fn a_stop_and_a_board_that_restarts_end_the_step_and_the_robot_stands() {
    let mut person = Person::new(&Config::default(), Build::default(), 1);
    person.until(Question::TurnRound);
    person.wait(Duration::from_secs(1));
    assert_ne!(person.duties(), [0, 0]);
    person.stop();
    person.wait(Duration::from_millis(300));
    assert_eq!(person.duties(), [0, 0]);
    person.wait(Duration::from_millis(500));
    assert_eq!(person.machine().question(), Some(Question::Turn));
    let said = person.said.pop().expect("a sentence");
    assert!(said.contains("the robot stands"), "{said}");
    person.say(Answer::Yes);
    person.wait(Duration::from_millis(500));
    assert_eq!(person.duties(), [0, 0]);
    let said = person.said.pop().expect("a sentence");
    assert!(said.contains("the robot is stopped"), "{said}");

    let mut person = Person::new(&Config::default(), Build::default(), 1);
    person.until(Question::RangeNear);
    person
        .whole
        .robot
        .reset_board(Wire::Sensor, ResetCause::Watchdog);
    person.wait(Duration::from_secs(1));
    assert_eq!(person.machine().question(), Some(Question::Boards));
    let said = person.said.last().expect("a sentence");
    assert!(said.contains("a board has restarted"), "{said}");
    assert!(
        person.machine().built().robot.sensors.ranger.model == Config::default().distance.model
    );
}

/// Where the servos are, as drawn.
fn servos(person: &Person) -> [u16; 8] {
    person.whole.robot.world().state().servo_positions
}

#[test]
fn a_joint_moves_only_while_the_button_is_held_and_by_itself() {
    let mut person = Person::new(&Config::default(), Build::default(), 1);
    person.until(Question::JointMoves);
    let before = servos(&person);
    person.wait(Duration::from_secs(5));
    assert_eq!(servos(&person), before, "nobody holds the button");

    person.say(Answer::Hold);
    person.wait(Duration::from_millis(300));
    let moving = servos(&person);
    assert_ne!(moving[0], before[0]);
    assert_eq!(moving[1..], before[1..], "one joint at a time");
    person.wait(Duration::from_secs(1));
    let stands = servos(&person);
    person.wait(Duration::from_secs(2));
    assert_eq!(servos(&person), stands, "one press lasts a moment");
    assert_eq!(person.machine().question(), Some(Question::JointMoves));

    person.say(Answer::Hold);
    person.wait(Duration::from_millis(200));
    assert_ne!(servos(&person), stands);
    person.stop();
    person.wait(Duration::from_millis(300));
    let stopped = servos(&person);
    for _ in 0..50 {
        person.say(Answer::Hold);
        person.wait(Duration::from_millis(40));
    }
    assert_eq!(servos(&person), stopped, "the stop wins");
    let said = person.said.join("; ");
    assert!(said.contains("the robot is stopped"), "{said}");
}

#[test]
fn a_joint_stops_when_nobody_is_there_any_more_who_renews_its_order() {
    let mut person = Person::new(&Config::default(), Build::default(), 1);
    person.until(Question::JointMoves);
    let before = servos(&person);
    person.say(Answer::Hold);
    person.wait(Duration::from_millis(200));
    assert_ne!(servos(&person), before);
    // The process that commissions is dead.
    person.whole.wizard = None;
    let mut run = |span: u64| {
        let end = person.whole.now + Duration::from_millis(span);
        while person.whole.now < end {
            let _ = person.whole.turn();
        }
        servos(&person)
    };
    let stands = run(500);
    assert_eq!(run(2_000), stands);
}

/// The duties while somebody orders the robot to drive.
fn drives(person: &mut Person, id: u32) -> [i16; 2] {
    for _ in 0..10 {
        person.whole.orders.push(SteeringOrder {
            given_ns: person.whole.moment().ns,
            id,
            origin: Origin::Operator.into(),
            code: Command::Wheel(WheelCommand::ManualForward).code(),
            ..SteeringOrder::default()
        });
        person.whole.stirred = true;
        person.wait(Duration::from_millis(20));
    }
    person.duties()
}

#[test]
fn the_wheels_stand_while_the_arm_is_limp_and_whoever_quits_gives_it_its_strength_back() {
    let mut person = Person::new(&Config::default(), Build::default(), 1);
    person.until(Question::PoseDrop);
    person.wait(Duration::from_secs(1));
    assert_eq!(drives(&mut person, 4_711), [0, 0]);
    // The arm sinks if nobody holds it.
    let now = person.whole.moment();
    person.machine().quit(now);
    person.wait(Duration::from_secs(1));
    assert!(person.machine().is_over());
    assert_ne!(drives(&mut person, 4_712), [0, 0]);
    let holds = servos(&person);
    person.wait(Duration::from_secs(5));
    assert_eq!(servos(&person), holds);
}

#[test]
fn servos_that_are_too_few_or_do_not_move_are_named_and_asked_for_again() {
    let mut arm = lager_plant::ArmBuild::default();
    (arm.ids[2], arm.ids[4]) = (None, None);
    let build = Build {
        arm,
        ..Build::default()
    };
    let mut person = Person::new(&Config::default(), build, 1);
    person
        .whole
        .robot
        .world_mut()
        .servos()
        .set_present(7, false);
    person.until(Question::Arm);
    person.said.clear();
    person.say(Answer::Yes);
    person.wait(Duration::from_secs(60));
    let said = person.said.join("; ");
    assert!(
        said.contains("5 servos answer, at: 1, 2, 4, 6, 8"),
        "{said}"
    );
    assert_eq!(person.machine().question(), Some(Question::Arm));

    person.whole.robot.world_mut().servos().set_present(7, true);
    person.until(Question::JointEnd);
    person.said.clear();
    for _ in 0..2 {
        person.say(Answer::Yes);
        person.wait(Duration::from_secs(3));
    }
    let said = person.said.join("; ");
    assert!(said.contains("base: no servo moved"), "{said}");
    let asked = person.machine().joint();
    assert_eq!(asked, Some((Joint::Base, false)));
    // What is asked again can be shown again.
    person.asked = None;
    person.until(Question::Poses);
}

#[test]
fn a_meter_that_contradicts_the_board_is_refused() {
    let build = Build {
        divider: false,
        ..Build::default()
    };
    let mut person = Person::new(&Config::default(), build, 1);
    person.until(Question::Battery);
    person.wait(Duration::from_secs(1));
    person.say(Answer::Number(11.1));
    person.wait(Duration::from_secs(1));
    let said = person.said.last().expect("a sentence");
    assert!(said.contains("look at the divider"), "{said}");
    assert_eq!(person.machine().question(), Some(Question::Battery));
}
