//! Actions about orders, goods and who picks them up.

use lager_orders::{Mode, Pick};
use lager_topics::{
    Event, EventKind, Failure, FailureKind, Goal, NavigatorStatus, Order, OrderQueue, Phase,
};

use super::{extended, pass, queue};
use crate::robot::Robot;

#[test]
fn an_order_is_done_when_logic_has_it() {
    let mut robot = extended(Mode::Autonomous);
    assert_eq!(robot.hears(&["do 1 order 4 7"]), ["[orders 7]"]);
    assert_eq!(robot.ordered, Some(Order { id: 4, product: 7 }));
    assert_eq!(pass(&mut robot, 250), ["[orders 7]"], "it is repeated");
    assert_eq!(robot.queue(&queue(&[4])), ["done 1"]);
    let said = robot.hears(&["do 2 order 4 7", "do 3 order 0 7"]);
    assert!(
        said[0].starts_with("refused 2 there is an order 4"),
        "{said:?}"
    );
    assert!(said[1].starts_with("refused 3 "), "{said:?}");

    robot.hears(&["do 4 order 5 8"]);
    let said = robot.event(&Event {
        kind: EventKind::Refused.into(),
        order_id: 5,
        product: 8,
        failure: Failure::new(FailureKind::UnknownProduct, (0, 0), 0, 8),
        ..Event::default()
    });
    let why = "goods 8 are not on the map";
    assert_eq!(
        said,
        [
            format!("event refused 0 0 5 8 {why}"),
            format!("refused 4 {why}")
        ]
    );

    robot.hears(&["do 5 order 6 7"]);
    let said = pass(&mut robot, 2_500);
    let last = said.last().map(String::as_str);
    assert_eq!(last, Some("refused 5 logic does not take the order"));
}

#[test]
fn orders_are_cancelled_moved_and_cleared() {
    let mut robot = extended(Mode::Autonomous);
    robot.queue(&queue(&[4, 5, 6]));
    assert_eq!(
        robot.hears(&["do 1 cancel 5"]),
        ["[presses OrderCancelled]"]
    );
    assert_eq!(robot.pressed.expect("a press").order_id, 5);
    assert_eq!(pass(&mut robot, 300), [""; 0], "it is not pressed twice");
    assert_eq!(robot.queue(&queue(&[4, 6])), ["done 1"]);
    let said = robot.hears(&["do 2 cancel 9"]);
    assert!(
        said[0].starts_with("refused 2 no order 9 waits"),
        "{said:?}"
    );
    let said = robot.hears(&["do 3 first 1"]);
    assert!(
        said[0].starts_with("refused 3 order 1 is under way"),
        "{said:?}"
    );

    // What is under way is taken back as long as its goods are not held.
    assert_eq!(
        robot.hears(&["do 7 cancel 1"]),
        ["[presses OrderCancelled]"]
    );
    let left = OrderQueue {
        under_way: 0,
        ..queue(&[4, 6])
    };
    assert_eq!(robot.queue(&left), ["done 7"]);
    robot.queue(&queue(&[4, 6]));
    robot.status(&NavigatorStatus {
        goal: Goal::Delivery.into(),
        ..NavigatorStatus::default()
    });
    robot.told();
    let said = robot.hears(&["do 8 cancel 1"]);
    assert!(
        said[0].starts_with("refused 8 order 1 is under way and its goods are in the claw"),
        "{said:?}"
    );

    // Each press takes it one place further.
    robot.queue(&queue(&[4, 6, 8]));
    let press = ["[presses OrderMovedUp]"];
    assert_eq!(robot.hears(&["do 9 first 8"]), press);
    let first = robot.pressed.expect("a press").id;
    assert_eq!(robot.queue(&queue(&[4, 8, 6])), press);
    assert_ne!(robot.pressed.expect("a press").id, first);
    assert_eq!(robot.queue(&queue(&[8, 4, 6])), ["done 9"]);
    assert_eq!(robot.hears(&["do 10 first 8"]), ["done 10"]);
    assert_eq!(robot.hears(&["do 11 up 6"]), press);
    assert_eq!(
        robot.queue(&queue(&[8, 6, 4])),
        ["done 11"],
        "one place, not to the front"
    );

    assert_eq!(robot.hears(&["do 12 clear"]), ["[presses QueueCleared]"]);
    assert_eq!(robot.queue(&queue(&[])), ["done 12"]);
}

#[test]
fn the_goods_are_in_the_gripper_when_logic_leaves() {
    let mut robot = extended(Mode::Autonomous);
    let said = robot.hears(&["do 1 picked"]);
    assert_eq!(said, ["refused 1 the robot does not wait at goods"]);
    let order = Some(Order { id: 4, product: 7 });
    robot.does(Phase::Picking, order);
    assert_eq!(robot.hears(&["do 2 picked"])[0], "[picked]");
    let said = robot.event(&Event {
        kind: EventKind::PickupRefused.into(),
        order_id: 4,
        product: 7,
        failure: Failure::new(FailureKind::ClawEmpty, (0, 0), 500, 500),
        ..Event::default()
    });
    assert!(
        said[1].starts_with("refused 2 the claw is closed on nothing"),
        "{said:?}"
    );
    let said = robot.hears(&["do 3 picked force"]);
    assert_eq!(said[0], "[presses PickupForced]");
    assert_eq!(robot.does(Phase::Leaving, order), ["done 3"]);
}

#[test]
fn an_answer_to_an_event_is_judged_by_the_state_that_follows_from_it() {
    let mut robot = extended(Mode::Autonomous);
    let order = Some(Order { id: 4, product: 7 });
    robot.does(Phase::Driving, order);
    robot.pass(10);
    let event = Event {
        kind: EventKind::InPosition.into(),
        order_id: 4,
        product: 7,
        ..Event::default()
    };
    // A station that heard this would give `picked` at once, and be refused.
    assert_eq!(robot.event_before_its_status(&event), [""; 0]);
    let soon = robot.conversation.due_ns().expect("it looks again soon");
    assert!(soon <= robot.now.ns + 1_000_000);
    assert_eq!(robot.pass(1), [""; 0]);
    let said = robot.does(Phase::Picking, order);
    assert!(said[0].starts_with("event in_position "), "{said:?}");
    assert_eq!(robot.hears(&["do 1 picked"])[0], "[picked]");

    // Whoever publishes no status after it does not keep it from people.
    robot.pass(10);
    assert_eq!(robot.event_before_its_status(&event), [""; 0]);
    assert_eq!(robot.pass(90), [""; 0]);
    let said = robot.pass(10);
    assert!(said[0].starts_with("event in_position "), "{said:?}");
}

#[test]
fn who_picks_is_chosen_when_logic_says_so() {
    let mut robot = extended(Mode::Autonomous);
    // Logic shows who picks, and some time passes.
    let shows = |robot: &mut Robot, pick: Pick| {
        robot.status(&NavigatorStatus {
            pick: pick.into(),
            ..NavigatorStatus::default()
        });
        robot.shown.clear();
        let mut said = pass(robot, 300);
        said.retain(|line| !line.starts_with("set_"));
        said
    };
    let press = "[presses PickByItself]";
    assert_eq!(robot.hears(&["do 1 pick auto"]), [press]);
    assert_eq!(shows(&mut robot, Pick::Manual), [press]);
    assert_eq!(shows(&mut robot, Pick::Auto), ["done 1"]);
    assert!(robot.shown[0].contains(" pick=auto "), "{:?}", robot.shown);
    let said = robot.hears(&["do 2 pick manual"]);
    assert_eq!(said, ["[presses PickByHand]"]);
    assert_eq!(shows(&mut robot, Pick::Manual), ["done 2"]);
    let said = robot.hears(&["do 3 pick nobody"]);
    assert!(said[0].starts_with("refused 3 "), "{said:?}");
    assert!(said[0].contains("manual or auto"), "{said:?}");
}

#[test]
fn what_cannot_be_read_is_refused_by_its_number_and_too_much_is_refused() {
    let mut robot = extended(Mode::Autonomous);
    let said = robot.hears(&["do 9 dance"]);
    assert!(said[0].starts_with("refused 9 column 6"), "{said:?}");
    let orders: Vec<String> = (1..=17).map(|n| format!("do {n} order {n} 7")).collect();
    let orders: Vec<&str> = orders.iter().map(String::as_str).collect();
    let said = robot.hears(&orders);
    assert_eq!(said.len(), 17);
    let refused = said.iter().find(|line| line.starts_with("refused"));
    let refused = refused.map(String::as_str);
    assert_eq!(
        refused,
        Some("refused 17 16 actions are under way; wait for their end")
    );
}

#[test]
fn a_number_that_was_heard_before_carries_nothing_out_again() {
    let mut robot = extended(Mode::Autonomous);
    assert_eq!(robot.hears(&["do 7 order 70 7"]), ["[orders 7]"]);
    // The same line again, an older number, and both behind a newer one in one read.
    for (line, number) in [
        ("do 7 order 70 7", 7),
        ("do 6 clear", 6),
        ("do 7 order 71 7", 7),
    ] {
        let said = robot.hears(&[line]);
        assert_eq!(said.len(), 1, "{line}: {said:?}");
        let refused =
            format!("refused {number} the last action on this connection had the number 7");
        assert!(said[0].starts_with(&refused), "{line}: {said:?}");
    }
    let said = robot.hears(&["do 9 order 72 7", "do 8 order 73 7", "do 9 order 72 7"]);
    let orders = |said: &[String]| said.iter().filter(|line| *line == "[orders 7]").count();
    assert_eq!(orders(&said), 1, "{said:?}");
    let refused = said.iter().filter_map(|line| line.get(..10));
    let refused = refused.filter(|line| line.starts_with("refused"));
    assert!(refused.eq(["refused 8 ", "refused 9 "]), "{said:?}");
    // A new connection begins its own numbers.
    robot.disconnect();
    robot.connect();
    robot.hears(&["lager 1 station"]);
    let said = robot.hears(&["do 1 order 74 7"]);
    assert_eq!(orders(&said), 1, "{said:?}");
}
