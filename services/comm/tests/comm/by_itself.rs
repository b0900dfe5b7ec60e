//! Autonomous: what is asked, what is made of the answers, and what goes wrong.

use lager_comm::LinkLost;
use lager_lines::splitter::LineError;
use lager_orders::Mode;
use lager_topics::{
    Event, EventKind, Finish, Hold, NavigatorStatus, Order, Origin, Phase, SteeringReport,
};

use crate::robot::Robot;

/// A robot that waits to be told what to fetch.
fn idle() -> Robot {
    let mut robot = Robot::connected(Mode::Autonomous);
    robot.does(Phase::WaitingForOrder, None);
    robot.hears(&["sidelength 40"]);
    robot.hears(&["karta 4 3 0 0"]);
    let said = robot.hears(&["prodlis 2 7 1 0 down 12 0 1 left"]);
    assert_eq!(said, ["[map 4x3]", "fetchprod"]);
    robot
}

#[test]
fn a_product_is_fetched_picked_and_delivered() {
    let mut robot = Robot::new(Mode::Autonomous);
    robot.does(Phase::WaitingForMap, None);
    assert_eq!(robot.connect(), ["lager 1 r1", "sidelength"]);
    assert_eq!(robot.hears(&["sidelength 40"]), ["karta"]);
    assert_eq!(robot.hears(&["karta 4 3 0 0"]), ["prodlis"]);
    let said = robot.hears(&["prodlist 1 7 1 0 down"]);
    assert_eq!(said, ["[map 4x3]"], "logic does not know it yet");
    assert_eq!(robot.does(Phase::WaitingForOrder, None), ["fetchprod"]);
    let map = robot.map.take().expect("it is published");
    assert_eq!((map.side_length_cm, map.products()[0].id), (40, 7));

    assert_eq!(robot.hears(&["fetchprod 7"]), ["[orders 7]"]);
    let order = robot.ordered.take();
    assert_eq!(robot.does(Phase::Driving, order), [""; 0]);
    assert_eq!(
        robot.pass(1_000),
        [""; 0],
        "nothing is repeated that logic shows"
    );

    assert_eq!(robot.does(Phase::Picking, order), ["armcomm"]);
    assert_eq!(robot.hears(&["armcomm F4"]), ["[steers 244]"]);
    assert_eq!(robot.pass(40), ["[renews 244]"]);
    let report = SteeringReport {
        finished_id: robot.steered.expect("an order").0,
        finished_origin: Origin::Operator.into(),
        finish: Finish::Done.into(),
        ..SteeringReport::default()
    };
    assert_eq!(robot.reports(&report), ["armcomm"]);
    assert_eq!(robot.hears(&["pickup_done"]), ["[picked]"]);
    assert_eq!(
        robot.pass(300),
        [""; 0],
        "what moves it is not said later again"
    );
    assert_eq!(robot.does(Phase::Leaving, order), [""; 0]);
    assert_eq!(robot.does(Phase::Exiting, order), [""; 0]);
    assert_eq!(robot.does(Phase::BackingOff, None), ["fetchprod"]);
}

#[test]
fn the_floor_is_asked_for_once_and_the_goods_by_each_connection() {
    let mut robot = idle();
    robot.disconnect();
    assert_eq!(robot.connect(), ["lager 1 r1", "sidelength"]);
    assert_eq!(robot.hears(&["sidelength 40"]), ["prodlis"]);
    assert_eq!(
        robot.hears(&["prodlis 2 7 1 0 down 12 0 1 left"]),
        ["fetchprod"],
        "the map is what it was"
    );
}

#[test]
fn an_order_goes_on_without_its_link_and_is_not_asked_for_again() {
    let mut robot = idle();
    robot.hears(&["fetchprod 12"]);
    let order = robot.ordered.take();
    robot.does(Phase::Driving, order);
    assert_eq!(robot.disconnect(), [""; 0]);
    robot.connect();
    robot.hears(&["sidelength 40"]);
    let said = robot.hears(&["prodlis 2 7 1 0 down 12 0 1 left"]);
    assert_eq!(said, [""; 0]);
    assert_eq!(robot.does(Phase::Dropping, None), ["fetchprod"]);
}

#[test]
fn a_robot_that_does_not_know_where_it_is_asks_for_no_product() {
    for phase in [Phase::Lost, Phase::Stuck] {
        let mut robot = Robot::connected(Mode::Autonomous);
        robot.does(phase, None);
        robot.hears(&["sidelength 40"]);
        robot.hears(&["karta 4 3 0 0"]);
        let said = robot.hears(&["prodlis 2 7 1 0 down 12 0 1 left"]);
        assert_eq!(said, ["[map 4x3]"]);
        assert_eq!(robot.pass(1_000), [""; 0]);
        assert_eq!(robot.does(Phase::WaitingForOrder, None), ["fetchprod"]);
    }
}

#[test]
fn a_robot_that_stands_without_its_link_is_told_so_until_it_is_back() {
    let mut robot = Robot::that(Mode::Autonomous, None, LinkLost::Stand);
    // Nobody has connected yet, and logic is told four times a second.
    let said = robot.pass(1_000);
    assert_eq!(said, ["[presses LinkLost]"; 4]);
    let said = robot.connect();
    let back = said.iter().filter(|line| *line == "[presses LinkBack]");
    assert_eq!(back.count(), 1, "{said:?}");
    robot.disconnect();
    assert_eq!(robot.pass(10), ["[presses LinkLost]"]);
    robot.connect();
    // Logic has not heard it, or stands for a comm that was killed.
    robot.status(&NavigatorStatus {
        phase: Phase::Driving.into(),
        hold: Hold::Link.into(),
        ..NavigatorStatus::default()
    });
    let said = robot.pass(1_000);
    let back = said.iter().filter(|line| *line == "[presses LinkBack]");
    assert!(back.count() >= 3, "{said:?}");
}

#[test]
fn an_order_that_logic_has_not_heard_is_repeated_under_its_number() {
    let mut robot = idle();
    robot.hears(&["fetchprod 12"]);
    let order = robot.ordered;
    assert_eq!(robot.pass(250), ["[orders 12]"]);
    assert_eq!(robot.ordered, order);
}

#[test]
fn what_cannot_be_fetched_is_told_and_asked_for_again() {
    let mut robot = idle();
    assert_eq!(
        robot.hears(&["fetchprod 8"]),
        ["thought there are no goods 8"]
    );
    assert_eq!(robot.pass(200), ["fetchprod"]);
    robot.hears(&["fetchprod 12"]);
    let Some(Order { id, product }) = robot.ordered else {
        panic!("it is ordered")
    };
    let refused = Event {
        kind: EventKind::Refused.into(),
        order_id: id,
        product,
        ..Event::default()
    };
    assert_eq!(robot.event(&refused), [""; 0], "logic says why itself");
    assert_eq!(robot.pass(200), ["fetchprod"]);
}

#[test]
fn goods_outside_the_floor_are_told_and_everything_is_asked_again() {
    let mut robot = Robot::connected(Mode::Autonomous);
    robot.hears(&["sidelength 40"]);
    robot.hears(&["karta 1 1 0 0"]);
    let said = robot.hears(&["prodlis 1 7 5 0 up"]);
    assert!(said[0].starts_with("thought goods 7 stand in the square (5, 0)"));
    assert_eq!(said.len(), 1);
    assert_eq!(robot.pass(200), ["sidelength"]);
}

#[test]
fn wrong_answers_are_told_and_answers_to_nothing_are_passed_over() {
    let mut robot = idle();
    let said = robot.hears(&["fetchprod many"]);
    assert!(
        said[0].starts_with("thought column 11: \"many\" stands here"),
        "{said:?}"
    );
    assert_eq!(robot.pass(200), ["fetchprod"]);
    assert_eq!(robot.hears(&["karta 9 9 0 0", "styrcomm 2"]), [""; 0]);
    let said = robot.hears(&["hello"]);
    assert!(said[0].starts_with("thought column 1"), "{said:?}");
    assert_eq!(robot.hears_noise(LineError::TooLong), ["[hangs up]"]);
    assert_eq!(
        robot.hears(&["fetchprod 7"]),
        [""; 0],
        "it is not connected"
    );
}

#[test]
fn a_peer_may_not_understand_the_first_line() {
    let mut robot = Robot::connected(Mode::Autonomous);
    assert_eq!(robot.hears(&["what is lager?"]), [""; 0]);
    assert_eq!(robot.hears(&["sidelength 40"]), ["karta"]);
    assert_eq!(robot.pass(60_000), [""; 0], "it never hears of it again");
}

#[test]
fn a_peers_first_answer_is_told_what_is_wrong_with_it() {
    let mut robot = Robot::connected(Mode::Autonomous);
    let said = robot.hears(&["sidelength 0"]);
    assert!(said[0].starts_with("thought column 12"), "{said:?}");
    assert_eq!(robot.pass(200), ["sidelength"]);
}

#[test]
fn only_the_arm_moves_at_the_goods() {
    let mut robot = idle();
    robot.hears(&["fetchprod 7"]);
    let order = robot.ordered.take();
    assert_eq!(robot.does(Phase::Picking, order), ["armcomm"]);
    let said = robot.hears(&["styrcomm 2"]);
    assert_eq!(said.len(), 1);
    assert!(said[0].contains("only its arm is moved"), "{said:?}");
    assert_eq!(robot.pass(200), ["armcomm"]);
}

#[test]
fn what_the_station_says_after_a_person_has_ordered_is_fetched_as_well() {
    let mut robot = idle();
    let persons = Order { id: 3, product: 7 };
    assert_eq!(robot.does(Phase::Driving, Some(persons)), [""; 0]);
    assert_eq!(robot.hears(&["fetchprod 12"]), ["[orders 12]"]);
}
