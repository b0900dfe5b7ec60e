//! Robots that nobody has described are commissioned by a person who answers from what he sees, and
//! deliver afterwards. Only which servos the arm has stands in the description before: no question
//! finds that out.

use std::f64::consts::TAU;
use std::ops::{Deref, DerefMut};
use std::time::Duration;

use lager_commission::{Answer, Built, Commissioning, Effect, Question, Step, Way};
use lager_orders::{Language, Mode, Moment};
use lager_plant::{Build, Pose};
use lager_simulator::Wire;
use lager_stop::Stop;
use lager_supervisor::mission::{Helper, Mission, Watch};
use lager_topics::{Ask, AskKind, BridgeAnswer, Part, Role, StopCause};
use lager_wire::ResetCause;

use super::Whole;
use super::built::{LIMIT, described_arm, robot, seeds};
use crate::config::Config;

/// Virtual time in which a robot must be commissioned.
const PATIENCE: Duration = Duration::from_secs(300);
/// How long a person takes until he answers.
const REACTION: Duration = Duration::from_millis(700);
/// How late he is where he watches a robot that moves.
const LATE: Duration = Duration::from_millis(80);
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
    said: Vec<String>,
    kept: Option<Built>,
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
        let world = self.whole.robot.world_mut();
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
            _ => {}
        }
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

/// A robot of which nobody has said more than which servos its arm has.
fn unknown(build: &Build) -> Config {
    Config {
        arm: described_arm(&build.arm),
        ..Config::default()
    }
}

/// The same robot, started again as it was commissioned, at the start of its warehouse.
fn restarted(person: Person, built: &Built, seed: u64) -> Whole {
    let mut config = unknown(&person.build);
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
        let mut person = Person::new(&unknown(&build), build, seed);
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
        let mut whole = restarted(person, &built, seed);
        let limit = whole.now + LIMIT;
        assert_eq!(whole.run(limit), None, "seed {seed}: {build:?} {built:?}");
        assert_eq!(whole.robot.world().collisions(), 0, "seed {seed}");
    }
}

#[test]
fn before_that_it_fails_and_says_why_if_its_build_matters() {
    for seed in seeds() {
        let build = Build::drawn(seed);
        if !(build.swapped || build.reversed != [false; 2] || build.dark_is_low) {
            continue;
        }
        let mut whole = robot(&unknown(&build), build, seed);
        let why = whole.run(LIMIT).expect("it cannot deliver");
        assert!(whole.failure_kind().is_some(), "seed {seed}: {why}");
    }
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
    let mut person = Person::new(&unknown(&Build::drawn(1)), Build::drawn(1), 1);
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
