//! Orders are given, repeated where that does no harm, and done when the robot shows their effect.

use core::time::Duration;

use lager_floor::{Heading, Node, Place, ProductId};
use lager_operator::{Act, Begun, Driving, For, Orders, Seen};
use lager_orders::{Action, Moment, Reason};
use lager_topics::{
    AskKind, BridgeAnswer, Health, InputKind, NavigatorStatus, OrderQueue, Outcome, Phase,
    SteeringReport, WaitingOrder, WorldAnswer,
};
use lager_wire::{Callsign, OperatorCommand, Speed};

/// The moment `ms` ms after the robot was switched on, the same on both clocks.
fn at(ms: u64) -> Moment {
    Moment {
        robot: Duration::from_millis(ms),
        ns: ms * 1_000_000,
    }
}

/// An operator who waits for one order.
struct Waiting {
    orders: Orders<()>,
    seen: Seen,
}

impl Waiting {
    fn given(action: Action, seen: Seen) -> Self {
        let mut orders = Orders::default();
        let begun = orders.give(at(1_000), Duration::ZERO, (), action, &seen);
        assert_eq!(begun, Ok(Begun::Waits));
        Self { orders, seen }
    }

    /// The kinds of the presses to be made now.
    fn presses(&mut self) -> Vec<InputKind> {
        let acts = self.orders.acts().into_iter();
        acts.filter_map(|act| match act {
            Act::Press(input) => input.kind.get(),
            _ => None,
        })
        .collect()
    }

    /// How the order has ended, if it has.
    fn end(&mut self) -> Option<Result<(), String>> {
        let ended = self.orders.ended().pop()?;
        Some(ended.result.map_err(|why: Reason| why.as_str().to_owned()))
    }

    fn turn(&mut self, ms: u64) {
        self.orders.turn(at(ms), |()| true);
    }
}

fn queue(orders: &[u32]) -> OrderQueue {
    let mut queue = OrderQueue {
        count: orders.len() as u8,
        ..OrderQueue::default()
    };
    for (slot, id) in queue.orders.iter_mut().zip(orders) {
        *slot = WaitingOrder {
            id: *id,
            ..WaitingOrder::default()
        };
    }
    queue
}

fn seen(orders: &[u32]) -> Seen {
    Seen {
        health: Some(Health::default()),
        status: Some(NavigatorStatus::default()),
        queue: Some(queue(orders)),
        ..Seen::default()
    }
}

#[test]
fn an_order_is_repeated_until_logic_shows_it_or_is_given_up() {
    let product = ProductId::new(7).expect("a number");
    let add = Action::Add { order: 4, product };
    let mut one = Waiting::given(add, seen(&[]));
    assert_eq!(one.orders.acts().len(), 1);
    one.turn(1_249);
    assert!(one.orders.acts().is_empty());
    one.turn(1_250);
    assert_eq!(one.orders.acts().len(), 1, "it is repeated");
    one.orders.queue(at(1_300), &queue(&[4]));
    assert_eq!(one.end(), Some(Ok(())));

    let mut lost = Waiting::given(add, seen(&[]));
    lost.turn(3_499);
    assert_eq!(lost.end(), None);
    lost.turn(3_500);
    assert_eq!(lost.end(), Some(Err("order_untaken".into())));
    let mut twice = Orders::default();
    let refused = twice.give(at(0), Duration::ZERO, (), add, &seen(&[4]));
    assert_eq!(
        refused.map_err(|why| why.to_string()),
        Err("there is an order 4 already".into())
    );
}

#[test]
fn an_order_is_moved_up_step_by_step_and_no_press_is_repeated() {
    let mut one = Waiting::given(Action::First { order: 3 }, seen(&[1, 2, 3]));
    assert_eq!(one.presses(), [InputKind::OrderMovedUp]);
    one.turn(1_500);
    assert_eq!(one.presses(), [], "two of them would be two");
    one.orders.queue(at(1_600), &queue(&[1, 3, 2]));
    assert_eq!(one.presses(), [InputKind::OrderMovedUp]);
    one.orders.queue(at(1_700), &queue(&[3, 1, 2]));
    assert_eq!(one.end(), Some(Ok(())));
}

#[test]
fn a_simulated_robot_is_put_down_before_logic_hears_of_it() {
    let on = Place::new(Node::new(2, 1), Heading::Left);
    let simulated = Seen {
        is_simulated: true,
        ..seen(&[])
    };
    let mut one = Waiting::given(Action::Place(on), simulated);
    let [Act::AskWorld { id, .. }] = one.orders.acts()[..] else {
        panic!("the world is asked first");
    };
    let done = WorldAnswer {
        outcome: Outcome::Done.into(),
        ..WorldAnswer::default()
    };
    one.orders.world_answered(at(1_100), id, &Ok(done));
    assert_eq!(one.presses(), [InputKind::Placed]);
    let mut status = NavigatorStatus {
        phase: Phase::WaitingForOrder.into(),
        ..NavigatorStatus::default()
    };
    (status.x, status.y) = (2, 1);
    // Logic published this before it could hear of the order, so it shows nothing.
    one.orders.status(&status, at(1_050).ns);
    assert_eq!(one.end(), None);
    one.orders.status(&status, at(1_200).ns);
    assert_eq!(one.end(), Some(Ok(())));
}

#[test]
fn a_calibration_ends_when_the_board_says_so() {
    let mut one = Waiting::given(Action::Calibrate, seen(&[]));
    let [Act::Ask { id, ask }] = one.orders.acts()[..] else {
        panic!("the bridge is asked");
    };
    assert_eq!(ask.kind, AskKind::Calibrate);
    let seen = one.seen.clone();
    one.orders.answered(id, Ok(BridgeAnswer::default()), &seen);
    one.turn(5_000);
    assert_eq!(one.end(), None, "it takes its time");
    one.turn(9_001);
    assert_eq!(one.end(), Some(Err("calibration_silent".into())));
}

#[test]
fn a_board_has_restarted_when_it_is_up_once_more() {
    let health = |up: u8, reboots: u32| {
        let mut health = Health::default();
        (health.steering.up, health.steering.reboots) = (up, reboots);
        health.sensor.reboots = 9;
        health
    };
    let given = || {
        let seen = Seen {
            health: Some(health(1, 2)),
            ..seen(&[])
        };
        let mut one = Waiting::given(Action::Restart(Callsign::Steering), seen);
        let [Act::Ask { id, ask }] = one.orders.acts()[..] else {
            panic!("the bridge is asked");
        };
        assert_eq!(
            (ask.kind.get(), ask.board.get()),
            (Some(AskKind::Restart), Some(Callsign::Steering))
        );
        // The board is quicker than the answer.
        let quick = Seen {
            health: Some(health(0, 3)),
            ..one.seen.clone()
        };
        one.orders.answered(id, Ok(BridgeAnswer::default()), &quick);
        one
    };
    let mut one = given();
    for (up, reboots) in [(1, 2), (0, 2), (0, 3)] {
        one.orders.health(&health(up, reboots));
        assert_eq!(one.end(), None);
    }
    one.orders.health(&health(1, 3));
    assert_eq!(one.end(), Some(Ok(())));

    let mut one = given();
    one.turn(5_900);
    assert_eq!(one.end(), None, "it takes its time");
    one.turn(6_001);
    assert_eq!(one.end(), Some(Err("outcome_no_board".into())));
}

#[test]
fn a_setpoint_is_renewed_and_is_over_after_a_pause_or_a_silent_board() {
    let whose = For::Action {
        number: 1,
        until_ns: None,
    };
    let begun = || {
        let mut driving = Driving::default();
        let command = OperatorCommand::Forward(Speed::Full);
        driving.begin(at(0), Duration::ZERO, 9, command, whose);
        driving
    };
    let heard = SteeringReport {
        age_ms: 0,
        ..SteeringReport::default()
    };
    let why = |driving: &mut Driving| {
        let ended = driving.ended().pop().expect("an end").result;
        ended.expect_err("it is over").code().to_owned()
    };
    let mut driving = begun();
    assert_eq!(driving.renew(at(39).robot), None);
    assert!(driving.renew(at(40).robot).is_some());
    assert_eq!(driving.renew(at(160).robot), None, "held up for a lease");
    assert_eq!(why(&mut driving), "over_held_up");
    let mut driving = begun();
    driving.reported(at(30).robot, &heard);
    for ms in (40..=200).step_by(40) {
        assert!(driving.renew(at(ms).robot).is_some());
    }
    assert_eq!(driving.renew(at(240).robot), None);
    assert_eq!(why(&mut driving), "over_unheard");
}

#[test]
fn what_no_state_shows_is_done_when_it_is_given() {
    let mut orders = Orders::default();
    let begun = orders.give(at(0), Duration::ZERO, (), Action::Horn, &seen(&[]));
    assert_eq!(begun, Ok(Begun::Done));
    assert_eq!(orders.acts().len(), 1);
}
