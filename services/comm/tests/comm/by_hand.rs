//! Manual: what is renewed, what is awaited, and everything that makes the robot stand.

use lager_orders::Mode;
use lager_topics::{Finish, Origin, Phase, Refusal, SteeringReport};

use crate::robot::Robot;

/// Codes of the steering board.
const STANDBY: &str = "[steers 1]";

/// A robot that is driven forward by hand.
fn driven() -> Robot {
    let mut robot = Robot::connected(Mode::Manual);
    assert_eq!(robot.hears(&["styrcomm 2"]), ["[steers 2]", "styrcomm"]);
    robot
}

fn finished(robot: &Robot, finish: Finish) -> SteeringReport {
    SteeringReport {
        finished_id: robot.steered.expect("an order").0,
        finished_origin: Origin::Operator.into(),
        finish: finish.into(),
        ..SteeringReport::default()
    }
}

#[test]
fn a_setpoint_is_renewed_until_the_next_one() {
    let mut robot = driven();
    assert_eq!(robot.pass(120), ["[renews 2]", "[renews 2]", "[renews 2]"]);
    // The operator's 7 is the board's 9 (AMB-2).
    assert_eq!(robot.hears(&["styrcomm 7"]), ["[steers 9]", "styrcomm"]);
    assert_eq!(robot.pass(40), ["[renews 9]"]);
    assert_eq!(robot.hears(&["styrcomm 1"]), [STANDBY, "styrcomm"]);
    assert_eq!(robot.pass(1_000), [""; 0], "standing needs nobody");
    assert_eq!(robot.hears(&["styrcomm 4"]), ["[steers 4]", "styrcomm"]);
}

#[test]
fn a_one_shot_is_awaited() {
    let mut robot = Robot::connected(Mode::Manual);
    assert_eq!(robot.hears(&["styrcomm 8"]), ["[steers 8]"]);
    assert_eq!(robot.pass(40), ["[renews 8]"]);
    // Nothing is asked, so this is no answer.
    assert_eq!(robot.hears(&["styrcomm 2"]), [""; 0]);
    let report = finished(&robot, Finish::Done);
    assert_eq!(robot.reports(&report), ["styrcomm"]);
    // The arm's answer to the wheels' question.
    assert_eq!(robot.hears(&["armcomm F1"]), ["[steers 241]"]);
}

#[test]
fn a_stop_counts_also_where_nothing_is_asked() {
    let mut robot = Robot::connected(Mode::Manual);
    robot.hears(&["styrcomm 8"]);
    assert_eq!(robot.hears(&["styrcomm 1"]), [STANDBY, "styrcomm"]);
}

#[test]
fn a_lost_link_makes_the_robot_stand_at_once() {
    let mut robot = driven();
    assert_eq!(robot.disconnect(), [STANDBY]);
    assert_eq!(robot.pass(1_000), [""; 0]);
    assert_eq!(robot.connect(), ["lager 1 r1", "styrcomm"]);
    assert_eq!(robot.pass(1_000), [""; 0], "nothing comes back by itself");
}

#[test]
fn a_silent_station_that_speaks_the_extension_is_a_lost_link() {
    let mut robot = Robot::connected(Mode::Manual);
    robot.hears(&["lager 1 station"]);
    assert_eq!(robot.hears(&["styrcomm 2"]), ["[steers 2]", "styrcomm"]);
    for number in 1..20 {
        let said = robot.pass(50);
        assert!(robot.signs > number, "it gives its sign of life");
        assert!(said.iter().all(|line| line == "[renews 2]"), "{said:?}");
        robot.hears(&["lager 1 station"]);
    }
    let said = robot.pass(150);
    let stands = said.iter().position(|line| line == STANDBY);
    assert_eq!(stands, Some(said.len() - 2), "{said:?}");
    assert_eq!(said.last().map(String::as_str), Some("[hangs up]"));
    assert_eq!(robot.hears(&["styrcomm 2"]), [""; 0]);
}

#[test]
fn a_standing_robot_is_patient_with_a_silent_station() {
    let mut robot = Robot::connected(Mode::Manual);
    robot.hears(&["lager 1 station"]);
    let said = robot.pass(4_000);
    assert_eq!(said, [""; 0]);
    assert!(robot.pass(1_100).contains(&"[hangs up]".to_owned()));
}

#[test]
fn a_gag_behind_a_plain_peer_may_be_silent_while_it_drives() {
    let mut robot = driven();
    let said = robot.pass(60_000);
    assert!(said.iter().all(|line| line == "[renews 2]"), "{said:?}");
}

#[test]
fn what_was_read_late_moves_nothing() {
    let mut robot = driven();
    robot.leap(201);
    let said = robot.done();
    assert_eq!(said, [STANDBY, "[hangs up]"]);
    assert_eq!(robot.hears(&["styrcomm 2"]), [""; 0]);
    assert_eq!(robot.pass(1_000), [""; 0]);
}

#[test]
fn a_stop_that_is_read_after_the_link_was_given_up_stops_all_the_same() {
    // A pause by hand, and one that is as long as the silence of a station may be.
    for (mode, pause) in [(Mode::Manual, 201), (Mode::Autonomous, 5_000)] {
        let mut robot = Robot::connected(mode);
        robot.hears(&["lager 1 station"]);
        robot.leap(pause);
        let given_up = robot.done();
        assert_eq!(given_up.last().map(String::as_str), Some("[hangs up]"));
        let said = robot.hears(&["styrcomm 2", "do 4 mode autonomous", "stop 5"]);
        assert_eq!(said, ["[stops]"], "{mode:?}");
        // Nobody is there who waits for its confirmation.
        robot.health.stopped = 1;
        robot.health.steering.version = 1;
        robot.told();
        robot.connect();
        robot.hears(&["lager 1 station"]);
        let standing = SteeringReport {
            age_ms: 0,
            ..SteeringReport::default()
        };
        assert_eq!(robot.reports(&standing), [""; 0]);
    }
}

#[test]
fn a_pause_as_long_as_the_lease_ends_the_command() {
    let mut robot = driven();
    robot.leap(120);
    let said = robot.done();
    assert!(said[0].contains("held up for 120 ms"), "{said:?}");
    assert_eq!(robot.pass(1_000), [""; 0]);
}

#[test]
fn a_command_is_let_go_when_the_board_does_not_report() {
    let mut robot = driven();
    robot.board = None;
    let said = robot.pass(190);
    assert!(said.iter().all(|done| done == "[renews 2]"), "{said:?}");
    let said = robot.pass(20);
    let over = said.iter().find(|line| line.starts_with("thought"));
    assert!(
        over.is_some_and(|why| why.contains("has not reported for 200 ms")),
        "{said:?}"
    );
    let said = robot.pass(1_000);
    assert!(!said.contains(&"[renews 2]".to_owned()), "{said:?}");
}

#[test]
fn an_original_board_which_reports_nothing_is_driven_while_its_bridge_lives() {
    let mut robot = driven();
    robot.board = None;
    robot.health.steering.up = 1;
    robot.health.steering.version = 0;
    for _ in 0..20 {
        robot.told();
        let said = robot.pass(100);
        assert!(said.contains(&"[renews 2]".to_owned()), "{said:?}");
    }
    // The bridge is gone, too.
    let said = robot.pass(400);
    assert!(said.iter().any(|line| line.contains("has not reported")));
}

#[test]
fn a_change_of_the_mode_lets_go_and_asks_first() {
    let mut robot = driven();
    robot.does(Phase::WaitingForOrder, None);
    assert_eq!(robot.mode(Mode::Autonomous), ["sidelength"]);
    assert_eq!(robot.pass(200), [""; 0]);
    // What was answered to the question before is passed over.
    assert_eq!(robot.hears(&["styrcomm 2"]), [""; 0]);
    assert_eq!(robot.mode(Mode::Manual), ["styrcomm"]);
}

#[test]
fn a_refusal_and_an_end_say_why() {
    let mut robot = driven();
    robot.health.refused_id = robot.steered.expect("an order").0;
    robot.health.refused_origin = Origin::Operator.into();
    robot.health.refusal = Refusal::BoardSilent.into();
    let said = robot.told();
    assert!(
        said[0].starts_with("thought forward is refused: the steering board"),
        "{said:?}"
    );

    robot.health.blocked = Refusal::StopLatched.into();
    robot.told();
    let said = robot.hears(&["styrcomm 3"]);
    assert!(said[0].ends_with("the robot is stopped"), "{said:?}");
    robot.health.blocked = Refusal::None.into();
    robot.told();
    robot.pass(210);
    robot.hears(&["styrcomm 3"]);
    let report = finished(&robot, Finish::NoTape);
    let said = robot.reports(&report);
    let why = "thought follow line was given up: the steering board has seen no tape for too long";
    assert_eq!(said, [why]);
    assert_eq!(robot.pass(200), [""; 0]);
}

#[test]
fn a_stop_overtakes_what_came_before_it() {
    let mut robot = Robot::connected(Mode::Manual);
    robot.hears(&["lager 1 station"]);
    let said = robot.hears(&["styrcomm 2", "stop 5"]);
    assert_eq!(said, ["[stops]", "styrcomm"]);
    robot.health.stopped = 1;
    robot.told();
    robot.pass(20);
    let moving = SteeringReport {
        left_duty: 9,
        age_ms: 0,
        ..SteeringReport::default()
    };
    assert_eq!(robot.reports(&moving), [""; 0]);
    let standing = SteeringReport {
        age_ms: 0,
        ..SteeringReport::default()
    };
    // An original board's report is the bridge's own word.
    robot.health.steering.version = 0;
    robot.told();
    assert_eq!(robot.reports(&standing), [""; 0]);
    robot.health.steering.version = 1;
    robot.told();
    assert_eq!(robot.reports(&standing), ["stopped 5 20"]);
    assert_eq!(robot.reports(&standing), [""; 0]);
}

#[test]
fn a_stop_that_cannot_be_read_stops() {
    let mut robot = driven();
    assert_eq!(robot.hears(&["stop now!"]), ["[stops]"]);
    assert_eq!(robot.pass(1_000), [""; 0]);
}

#[test]
fn the_warehouse_is_asked_for_where_the_extension_is_spoken_and_nobody_drives() {
    let mut robot = Robot::with_map(Mode::Manual, None);
    robot.connect();
    assert_eq!(robot.hears(&["lager 1 station"]), [""; 0]);
    assert_eq!(robot.pass(1_000), ["sidelength"]);
    assert_eq!(robot.hears(&["sidelength 40"]), ["karta"]);
    assert_eq!(robot.hears(&["karta 4 3 0 0"]), ["prodlis"]);
    let said = robot.hears(&["prodlis 1 7 1 0 down"]);
    assert_eq!(said, ["[map 4x3]", "styrcomm"]);
    // By one connection is enough.
    robot.disconnect();
    robot.connect();
    // What happened before is all that it tells.
    let said = robot.hears(&["lager 1 station"]);
    assert!(
        said.iter().all(|line| line.starts_with("past ")),
        "{said:?}"
    );
}

#[test]
fn a_station_without_a_warehouse_keeps_nobody_from_driving() {
    let mut robot = Robot::with_map(Mode::Manual, None);
    robot.connect();
    robot.hears(&["lager 1 station"]);
    assert_eq!(robot.pass(1_000), ["sidelength"]);
    assert_eq!(robot.pass(1_000), ["styrcomm"], "for a second");
    robot.is_answered();
    assert_eq!(robot.hears(&["styrcomm 2"])[0], "[steers 2]");
    // A GaG that only drives is not asked about the floor again, by no connection.
    robot.disconnect();
    assert_eq!(robot.connect(), ["lager 1 r1", "styrcomm"]);
    robot.hears(&["lager 1 station"]);
    assert_eq!(robot.pass(3_000), [""; 0]);
}

#[test]
fn a_gag_that_drives_at_once_is_never_asked_about_the_floor() {
    let mut robot = Robot::with_map(Mode::Manual, None);
    assert_eq!(robot.connect(), ["lager 1 r1", "styrcomm"]);
    robot.hears(&["lager 1 station"]);
    assert_eq!(robot.hears(&["styrcomm 2"]), ["[steers 2]", "styrcomm"]);
    for _ in 0..300 {
        let said = robot.pass(10);
        assert!(said.iter().all(|line| line == "[renews 2]"), "{said:?}");
        robot.is_answered();
    }
}
