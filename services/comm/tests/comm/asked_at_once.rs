//! A peer that answers at once: how often it is asked, and that its answers count all the same.

use lager_orders::Mode;
use lager_topics::{Event, EventKind, Finish, Order, Origin, Phase, SteeringReport};

use crate::robot::Robot;

/// A robot that has just connected and asked nothing yet.
fn connected(mode: Mode) -> Robot {
    let mut robot = Robot::new(mode);
    robot.does(Phase::WaitingForOrder, None);
    robot.conversation.connected(robot.now);
    robot
}

/// Answers to what is asked about a warehouse in which product 7 stands.
fn described(robot: &mut Robot, question: &str) -> Vec<String> {
    robot.hears(&[match question {
        "sidelength" => "sidelength 40",
        "karta" => "karta 4 3 0 0",
        "prodlis" => "prodlis 1 7 1 0 down",
        _ => return Vec::new(),
    }])
}

/// A robot at the goods that has just asked for a step of its arm.
fn at_goods() -> (Robot, Vec<String>) {
    let mut robot = connected(Mode::Autonomous);
    robot.answered_at_once(Vec::new(), 1_000, described);
    let said = robot.does(Phase::Picking, Some(Order { id: 3, product: 7 }));
    assert_eq!(said, ["armcomm"]);
    (robot, said)
}

/// The least time between two questions one after the other, in ns.
fn least_pause(asked: &[(String, u64)]) -> u64 {
    let pauses = asked.windows(2).map(|two| two[1].1 - two[0].1);
    pauses.min().expect("it has asked twice")
}

#[test]
fn commands_are_asked_for_a_thousand_times_a_second_at_most() {
    let mut robot = connected(Mode::Manual);
    let mut codes = [2, 4].into_iter().cycle();
    let asked = robot.answered_at_once(Vec::new(), 1_000, |robot, question| {
        assert_eq!(question, "styrcomm");
        let code = codes.next().expect("it is a cycle");
        let said = robot.hears(&[&format!("styrcomm {code}")]);
        assert_eq!(said, [format!("[steers {code}]")], "each answer counts");
        said
    });
    assert_eq!(least_pause(&asked), 1_000_000);
    assert!((990..=1_001).contains(&asked.len()), "{}", asked.len());
}

#[test]
fn an_answer_that_took_its_time_is_followed_by_the_next_question_at_once() {
    let mut robot = Robot::connected(Mode::Manual);
    for _ in 0..100 {
        robot.leap_us(999);
        assert_eq!(robot.done(), [""; 0]);
        robot.leap_us(1);
        robot.done();
        let said = robot.hears(&["styrcomm 2"]);
        assert_eq!(said, ["[steers 2]", "styrcomm"]);
    }
}

#[test]
fn the_pace_holds_no_stop_back() {
    for stop in ["styrcomm 1", "stop 5"] {
        let mut robot = Robot::connected(Mode::Manual);
        robot.hears(&["lager 1 station"]);
        robot.hears(&["styrcomm 2"]);
        // This question has just been put.
        let said = robot.hears(&["styrcomm 4"]);
        assert_eq!(said, ["[steers 4]"], "the next one waits a little");
        let said = robot.hears(&[stop]);
        assert!(
            ["[steers 1]", "[stops]"].contains(&said[0].as_str()),
            "{said:?}"
        );
    }
}

#[test]
fn a_stop_in_place_of_a_step_of_the_arm_is_no_way_round_the_pace() {
    let (mut robot, said) = at_goods();
    let asked = robot.answered_at_once(said, 1_000, |robot, question| {
        assert_eq!(question, "armcomm");
        robot.hears(&["styrcomm 1"])
    });
    assert_eq!(least_pause(&asked), 1_000_000);
    assert!((990..=1_001).contains(&asked.len()), "{}", asked.len());
}

/// Asserts that in ten seconds everything was asked at most five times a second, and this again and
/// again.
fn assert_slow(asked: &[(String, u64)], again: &str) {
    for question in ["sidelength", "karta", "prodlis", "fetchprod", "armcomm"] {
        let times = asked.iter().filter(|(one, _)| one == question).count();
        assert!(times <= 51, "{question} was asked {times} times");
        assert!(
            question != again || times >= 40,
            "{question}: {times} times"
        );
    }
}

#[test]
fn impossible_answers_at_once_lead_to_no_more_than_five_questions_a_second() {
    for (asked_again, answer) in [
        ("sidelength", "sidelength 0"),
        ("karta", "karta 0 0 0 0"),
        ("prodlis", "prodlis 1 7 9 9 down"),
        ("prodlis", "prodlis 2 7 1 0 down 7 1 0 up"),
        ("fetchprod", "fetchprod 8"),
        ("fetchprod", "fetchprod many"),
    ] {
        let mut robot = connected(Mode::Autonomous);
        let asked = robot.answered_at_once(Vec::new(), 10_000, |robot, question| {
            match question == asked_again {
                true => robot.hears(&[answer]),
                false => described(robot, question),
            }
        });
        assert_slow(&asked, asked_again);
    }
}

#[test]
fn a_list_without_products_leads_to_no_more_than_five_questions_a_second() {
    let mut robot = connected(Mode::Autonomous);
    let asked = robot.answered_at_once(Vec::new(), 10_000, |robot, question| match question {
        "prodlis" => robot.hears(&["prodlis 0"]),
        "fetchprod" => robot.hears(&["fetchprod 7"]),
        _ => described(robot, question),
    });
    assert_slow(&asked, "fetchprod");
}

#[test]
fn an_order_that_logic_refuses_at_once_is_asked_for_five_times_a_second() {
    for is_shown in [false, true] {
        let mut robot = connected(Mode::Autonomous);
        let asked = robot.answered_at_once(Vec::new(), 10_000, |robot, question| {
            if question != "fetchprod" {
                return described(robot, question);
            }
            let mut said = robot.hears(&["fetchprod 7"]);
            let order = robot.ordered.take().expect("it is ordered");
            if is_shown {
                // It is under way for a moment.
                said.extend(robot.does(Phase::WaitingForOrder, Some(order)));
                said.extend(robot.does(Phase::WaitingForOrder, None));
            }
            said.extend(robot.event(&Event {
                kind: EventKind::Refused.into(),
                order_id: order.id,
                product: order.product,
                ..Event::default()
            }));
            said
        });
        assert_slow(&asked, "fetchprod");
    }
}

#[test]
fn goods_that_logic_does_not_feel_are_asked_about_five_times_a_second() {
    let (mut robot, said) = at_goods();
    let asked = robot.answered_at_once(said, 10_000, |robot, question| {
        assert_eq!(question, "armcomm");
        assert_eq!(robot.hears(&["pickup_done"]), ["[picked]"]);
        robot.event(&Event {
            kind: EventKind::PickupRefused.into(),
            order_id: 3,
            product: 7,
            ..Event::default()
        })
    });
    assert_slow(&asked, "armcomm");
}

#[test]
fn a_step_of_the_arm_that_is_not_done_is_followed_by_a_question_a_little_later() {
    let (mut robot, said) = at_goods();
    let asked = robot.answered_at_once(said, 10_000, |robot, question| {
        assert_eq!(question, "armcomm");
        assert_eq!(robot.hears(&["armcomm F3"]), ["[steers 243]"]);
        let said = robot.reports(&SteeringReport {
            finished_id: robot.steered.expect("an order").0,
            finished_origin: Origin::Operator.into(),
            finish: Finish::Aborted.into(),
            ..SteeringReport::default()
        });
        assert!(said[0].starts_with("thought in was cut short"), "{said:?}");
        said
    });
    assert_slow(&asked, "armcomm");
}

#[test]
fn the_question_after_a_delivery_comes_at_once() {
    let mut robot = connected(Mode::Autonomous);
    let asked = robot.answered_at_once(Vec::new(), 10, described);
    assert_eq!(
        asked.last().map(|(last, _)| last.as_str()),
        Some("fetchprod")
    );
    robot.hears(&["fetchprod 7"]);
    let order = robot.ordered.take();
    assert_eq!(robot.does(Phase::Driving, order), [""; 0]);
    robot.pass(1_000);
    assert_eq!(robot.does(Phase::BackingOff, None), ["fetchprod"]);
}
