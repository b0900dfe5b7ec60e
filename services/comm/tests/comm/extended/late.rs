//! What comes late moves nothing, and whoever gave it is told; what runs keeps the link up.

use core::time::Duration;

use lager_orders::Mode;
use lager_topics::{Finish, Order, Phase};

use super::{ended, extended};
use crate::robot::Robot;

/// Passes time with a station that answers each sign as one of ours does.
fn pass(robot: &mut Robot, milliseconds: u64) -> Vec<String> {
    let mut said = Vec::new();
    for _ in 0..milliseconds / 10 {
        said.extend(robot.pass(10));
        said.extend(robot.is_answered());
    }
    said.retain(|line| !line.starts_with("[renews"));
    said
}

/// One whose station has answered its last sign at this moment.
fn answered(mode: Mode) -> Robot {
    let mut robot = extended(mode);
    if mode == Mode::Autonomous {
        robot.hears(&["sidelength 40"]);
        robot.hears(&["prodlis 1 7 0 0 up"]);
    }
    pass(&mut robot, 100);
    robot
}

/// Everything that moves the robot or lets it move, without its number.
const MOVING: [&str; 9] = [
    "drive 2 150",
    "drive 8 150",
    "arm F3",
    "resume 7",
    "mode manual",
    "mode autonomous",
    "picked force",
    "reset",
    "place 0 0 up",
];

#[test]
fn what_a_cut_link_delivers_late_moves_nothing_and_its_giver_is_told() {
    for mode in [Mode::Manual, Mode::Autonomous] {
        let mut robot = answered(mode);
        // Cut off: its signs go out and nothing comes. Then all of it comes in two pieces.
        robot.pass(600);
        for piece in [1, 2] {
            for (number, action) in (10 * piece..).zip(MOVING) {
                let said = robot.hears(&[&format!("do {number} {action}")]);
                let late = format!("refused {number} came 6");
                assert!(said[0].starts_with(&late), "{action}: {said:?}");
                assert!(said[0].ends_with("ms late; give it anew"), "{said:?}");
                assert_eq!(said.len(), 1);
            }
        }
        // To stand, and what waits in a queue, may be as late as that.
        let said = robot.hears(&["do 30 order 4 7", "stop 31"]);
        assert_eq!(said, ["[stops]", "[orders 7]"]);
        // What is said behind the answer to a sign is as young as that.
        robot.is_answered();
        let said = robot.hears(&["do 40 mode manual"]);
        assert_eq!(said, ["[asks SetMode]"]);
    }
}

#[test]
fn what_a_pause_of_this_process_left_lying_moves_nothing() {
    for mode in [Mode::Manual, Mode::Autonomous] {
        for pause in [201, 1_000, 4_500] {
            let mut robot = answered(mode);
            robot.leap(pause);
            assert_eq!(robot.done(), [""; 0], "the link stays");
            for (number, action) in (1..).zip(MOVING) {
                let said = robot.hears(&[&format!("do {number} {action}")]);
                let late = format!("refused {number} came ");
                assert!(said[0].starts_with(&late), "{action}: {said:?}");
            }
        }
    }
}

#[test]
fn an_answer_of_a_gag_that_comes_late_is_refused_in_a_thought_and_asked_for_anew() {
    let mut robot = answered(Mode::Manual);
    robot.pass(600);
    let said = robot.hears(&["styrcomm 6"]);
    assert_eq!(said.len(), 1);
    let why = "thought styrcomm 00000110: came 6";
    assert!(said[0].starts_with(why), "{said:?}");
    assert_eq!(pass(&mut robot, 210), ["styrcomm"]);
    assert_eq!(robot.hears(&["styrcomm 6"])[0], "[steers 6]");
    // To stand is never too late.
    robot.pass(140);
    robot.hears(&["lager 1 station"]);
    robot.pass(100);
    assert_eq!(robot.hears(&["styrcomm 1"])[0], "[steers 1]");

    // The goods of a person who picks by hand.
    let mut robot = answered(Mode::Autonomous);
    let order = Some(Order { id: 3, product: 7 });
    robot.conversation.health(robot.now, &robot.health);
    robot.does(Phase::Picking, order);
    robot.pass(600);
    let said = robot.hears(&["pickup_done"]);
    assert!(
        said[0].starts_with("thought pickup_done: came "),
        "{said:?}"
    );
    assert_eq!(robot.pressed, None);
}

#[test]
fn the_age_that_the_station_knows_counts_as_well_and_goes_on_to_the_bridge() {
    let mut robot = answered(Mode::Manual);
    let said = robot.hears(&["do 1 late 201 drive 2 150"]);
    assert_eq!(said, ["refused 1 came 201 ms late; give it anew"]);
    assert_eq!(robot.steered, None);
    robot.leap(20);
    let said = robot.hears(&["do 2 late 100 drive 2 150"]);
    assert_eq!(said, ["[steers 2]"]);
    let age = robot.now.ns - robot.given_ns;
    assert_eq!(Duration::from_nanos(age), Duration::from_millis(120));
    // It holds for no longer than it may come late: another 80 ms.
    assert_eq!(pass(&mut robot, 70), [""; 0]);
    assert_eq!(pass(&mut robot, 10)[0], "[steers 1]");
    robot.hears(&["do 3 late 50 resume 7"]);
    let (_, ask) = robot.asked.expect("a request");
    let since_sign_ms = robot.now.ns / 1_000_000 - robot.signed_ms.expect("a sign");
    let age_ns = robot.now.ns - ask.issued_ns;
    assert_eq!(age_ns, (50 + since_sign_ms) * 1_000_000);
    assert_eq!(ask.lifetime_ms, 200);
    assert!(ask.is_over(robot.now.ns + 200_000_000 - age_ns));
}

#[test]
fn a_clock_that_the_robot_has_not_shown_yet_makes_nothing_younger() {
    let mut robot = answered(Mode::Manual);
    robot.pass(600);
    robot.hears(&["lager 1 station 18446744073709551615"]);
    let said = robot.hears(&["do 1 drive 2 150"]);
    assert!(said[0].starts_with("refused 1 came "), "{said:?}");
}

#[test]
fn a_long_step_of_the_arm_keeps_the_link_up_in_either_mode() {
    for mode in [Mode::Manual, Mode::Autonomous] {
        let mut robot = answered(mode);
        robot.does(Phase::Picking, Some(Order { id: 3, product: 7 }));
        robot.is_answered();
        assert_eq!(robot.hears(&["armcomm F9"]), ["[steers 249]"]);
        // A squeeze takes that long, and the station answers each sign 30 ms later.
        for _ in 0..40 {
            let (before, signed_ms) = (robot.signs, robot.signed_ms);
            let said = robot.pass(30);
            assert!(said.iter().all(|line| line == "[renews 249]"), "{said:?}");
            assert!(robot.signs > before);
            robot.hears(&[&format!("lager 1 station {}", signed_ms.expect("a sign"))]);
        }
        let said = ended(&mut robot, Finish::Done);
        let asks = ["armcomm", "styrcomm"];
        assert!(asks.contains(&said[0].as_str()), "{said:?}");
        // A station that answers none is a lost link, in either mode.
        robot.is_answered();
        robot.hears(&["armcomm F9"]);
        let said = robot.pass(150);
        assert_eq!(
            said.last().map(String::as_str),
            Some("[hangs up]"),
            "{mode:?}"
        );
    }
}
