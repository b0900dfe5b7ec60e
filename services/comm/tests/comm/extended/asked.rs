//! Actions that other services answer or show: the bridge, the simulated world, and logic where it
//! is told its place.

use lager_comm::Senses;
use lager_floor::Heading;
use lager_orders::{Mode, Reason};
use lager_topics::{
    AskKind, CalibratedSensor, Calibration, InputKind, NavigatorStatus, Outcome, Phase,
    WorldAnswer, WorldAskKind, WorldRefusal,
};

use super::{done, extended, pass};
use crate::robot::Robot;

#[test]
fn a_reset_is_done_when_logic_says_so_after_it() {
    let mut robot = extended(Mode::Autonomous);
    assert_eq!(robot.hears(&["do 1 reset"]), ["[presses ResetPressed]"]);
    assert_eq!(
        robot.pressed.expect("a press").kind,
        InputKind::ResetPressed
    );
    // What logic had said before is no answer.
    assert_eq!(robot.does(Phase::WaitingForOrder, None), [""; 0]);
    assert_eq!(pass(&mut robot, 250), [""; 0], "later it would come late");
    assert_eq!(robot.does(Phase::WaitingForOrder, None), ["done 1"]);
}

#[test]
fn what_the_bridge_answers_is_handed_on() {
    let mut robot = extended(Mode::Autonomous);
    assert_eq!(robot.hears(&["do 1 mode manual"]), ["[asks SetMode]"]);
    let (id, ask) = robot.asked.expect("a request");
    assert_eq!(ask.mode, Mode::Manual);
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Done));
    assert_eq!(robot.done(), ["done 1"]);

    robot.hears(&["do 2 gains 3 4"]);
    let (id, ask) = robot.asked.expect("a request");
    assert_eq!((ask.gain_p, ask.gain_d), (3, 4));
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::NoBoard));
    let said = robot.done();
    assert!(
        said[0].starts_with("refused 2 the board that would"),
        "{said:?}"
    );

    robot.hears(&["do 3 calibrate"]);
    let (id, ask) = robot.asked.expect("a request");
    assert_eq!(ask.kind, AskKind::Calibrate);
    robot
        .conversation
        .answered_by_bridge(id, done(Outcome::Done));
    robot.health.calibration = Calibration::Running.into();
    robot.health.calibrated[..10].fill(CalibratedSensor {
        reading: 30,
        lowest: 20,
        highest: 40,
        ..CalibratedSensor::default()
    });
    robot.told();
    robot.shown.clear();
    assert_eq!(pass(&mut robot, 2_500), [""; 0], "it has only begun");
    let read = |robot: &Robot| -> Vec<String> {
        let shown = robot.shown.iter();
        let read = shown.filter(|line| line.starts_with("sensors "));
        read.cloned().collect()
    };
    assert_eq!(read(&robot), [""; 0], "one of them has not been heard");
    robot.health.calibrated[10] = CalibratedSensor {
        reading: 200,
        lowest: 20,
        highest: 210,
        tells_apart: 1,
    };
    robot.told();
    assert_eq!(pass(&mut robot, 2_500), [""; 0]);
    // Once, as nothing changes.
    let told = format!("sensors{} 200 20 210 1", " 30 20 40 0".repeat(10));
    assert_eq!(read(&robot), [told]);
    robot.health.calibrations_ended += 1;
    robot.health.calibration = Calibration::Partly.into();
    robot.health.calibrated_sensors = 9;
    let said = robot.told();
    assert!(
        said[0].starts_with("refused 3 line sensors that have seen both floor and tape: 9 of 11"),
        "{said:?}"
    );
}

#[test]
fn obstacles_are_put_into_a_simulated_world() {
    let mut robot = extended(Mode::Autonomous);
    let said = robot.hears(&["do 1 obstacle put 2 1 left"]);
    assert_eq!(said, ["[asks the world Put]"]);
    let (id, ask) = robot.asked_world.expect("a request");
    assert_eq!((ask.x, ask.y), (2, 1));
    assert_eq!(
        (ask.heading.get(), ask.kind.get()),
        (Some(Heading::Left), Some(WorldAskKind::Put))
    );
    let answer = WorldAnswer {
        outcome: Outcome::Refused.into(),
        refusal: WorldRefusal::RobotThere.into(),
        ..WorldAnswer::default()
    };
    robot
        .conversation
        .answered_by_world(robot.now, id, &Ok(answer));
    let said = robot.done();
    assert!(
        said[0].starts_with("refused 1 the robot is there"),
        "{said:?}"
    );
    robot.hears(&["do 2 obstacle take 2 1 left"]);
    let (id, _) = robot.asked_world.expect("a request");
    let nobody = Err(Reason::read("nobody answers"));
    robot.conversation.answered_by_world(robot.now, id, &nobody);
    assert_eq!(robot.done(), ["refused 2 nobody answers"]);
}

/// Logic says that it waits for an order on a crossing.
fn waits_on(x: i16, y: i16, heading: Heading) -> NavigatorStatus {
    NavigatorStatus {
        x,
        y,
        heading: heading.into(),
        phase: Phase::WaitingForOrder.into(),
        ..NavigatorStatus::default()
    }
}

#[test]
fn a_robot_is_told_where_it_stands_and_a_simulated_one_is_put_there() {
    let mut robot = extended(Mode::Manual);
    let said = robot.hears(&["do 1 place 2 1 up"]);
    assert_eq!(said, ["[presses Placed]"], "a person has carried it");
    let pressed = robot.pressed.expect("a press");
    assert_eq!((pressed.x, pressed.y), (2, 1));
    assert_eq!(pressed.heading.get(), Some(Heading::Up));
    robot.pass(1);
    let is_done = |robot: &mut Robot, status, line: &str| {
        robot.status(&status);
        robot.done().contains(&line.to_owned())
    };
    assert!(!is_done(
        &mut robot,
        waits_on(2, 1, Heading::Left),
        "done 1"
    ));
    assert!(is_done(&mut robot, waits_on(2, 1, Heading::Up), "done 1"));

    robot.conversation.senses(Senses {
        truth: Some(Box::default()),
        ..Senses::default()
    });
    assert_eq!(
        robot.hears(&["do 2 place 0 3 right"]),
        ["[asks the world Place]"]
    );
    let (id, ask) = robot.asked_world.expect("a request");
    assert_eq!(
        (ask.x, ask.y, ask.heading.get()),
        (0, 3, Some(Heading::Right))
    );
    let answer = WorldAnswer {
        outcome: Outcome::Done.into(),
        ..WorldAnswer::default()
    };
    robot
        .conversation
        .answered_by_world(robot.now, id, &Ok(answer));
    assert_eq!(robot.done(), ["[presses Placed]"]);
    robot.pass(1);
    assert!(is_done(
        &mut robot,
        waits_on(0, 3, Heading::Right),
        "done 2"
    ));

    // Nobody says that of a robot that drives.
    robot.hears(&["do 3 drive 2 200"]);
    robot.health.current_code = robot.steered.expect("an order").1;
    robot.told();
    let said = robot.hears(&["do 4 place 1 1 up"]);
    assert!(
        said[0].starts_with("refused 4 the robot is moving"),
        "{said:?}"
    );
}
