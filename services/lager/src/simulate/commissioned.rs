//! Robots that nobody has described are commissioned by a person who answers from what he sees, and
//! deliver afterwards. Before that they fail, and say why.

mod buttons;
mod person;

use std::time::Duration;

use lager_commission::{Answer, Built, Commissioning, Joint, Question, Step};
use lager_orders::Mode;
use lager_plant::Build;
use lager_simulator::Wire;
use lager_topics::{Ask, AskKind, Origin, SteeringOrder};
use lager_wire::{ArmProfile, Command, OneOrTwo, ResetCause, WheelCommand};

pub(super) use person::Wizard;
use person::{LINE, Person};

use super::Whole;
use super::built::{LIMIT, robot, seeds};
use crate::config::Config;

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
        assert_eq!(built.buttons, buttons::of(&build.buttons), "seed {seed}");
        let mut whole = restarted(person, &built, seed);
        buttons::act_as_they_are_built(&mut whole, &built, seed);
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

/// The thresholds of the line sensors in both copies that their board keeps.
fn thresholds(person: &Person) -> [Vec<u8>; 2] {
    let eeprom = person.whole.robot.eeprom(Wire::Sensor);
    [2, 34].map(|copy| eeprom[copy..copy + 11].to_vec())
}

#[test]
fn whoever_quits_or_goes_back_has_the_former_thresholds_of_the_line_sensors_again() {
    for how in ["quits", "goes back", "comes after one that was killed"] {
        let goes_back = how == "goes back";
        let mut person = Person::new(&Config::default(), Build::default(), 1);
        person.until(Question::RangeFar);
        person.wait(Duration::from_secs(1));
        assert!(person.machine().has_calibrated());
        let [new, _] = thresholds(&person);
        if goes_back {
            person.say(Answer::Back);
        } else {
            if how != "quits" {
                let built = person.machine().built();
                *person.machine() = Commissioning::new(built).after_calibration();
            }
            let now = person.whole.moment();
            person.machine().quit(now);
        }
        person.wait(Duration::from_secs(2));
        assert!(!person.machine().has_calibrated());
        let [one, other] = thresholds(&person);
        assert!(one == other && one != new, "{one:?} {other:?} {new:?}");
        if goes_back {
            assert_eq!(person.machine().question(), Some(Question::LineSway));
            // It can be done again.
            person.asked = None;
            person.until(Question::RangeFar);
            assert!(person.machine().has_calibrated());
        }
    }
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
