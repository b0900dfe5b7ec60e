//! Tests of the waiting orders (F3): carried out in their order, put off without a way, changed by
//! people while the robot drives, and kept after a kill at any moment.

use std::time::Duration;

use lager_floor::Heading;
use lager_logic::queue::MOST_ORDERS;
use lager_logic::{LogicConfig, Navigator};
use lager_topics::{EventKind, FailureKind, Hold, InputKind, OrderQueue, Phase};

use crate::double::{Body, Trouble};
use crate::floor::Exit;
use crate::trial::{Trial, warehouse};

const EXIT: Exit = Exit::Straight(450.0);
const SECOND: Duration = Duration::from_secs(1);

/// A robot with nothing to do. Product 2 is on the way to product 1, and product 3 elsewhere.
/// Product 4 is in the place of product 1, and so on.
fn robot() -> Trial {
    let places = [
        (1, 0, Heading::Right),
        (0, 0, Heading::Down),
        (0, 0, Heading::Left),
    ];
    let products: Vec<_> = places.into_iter().cycle().take(MOST_ORDERS + 2).collect();
    let map = warehouse((2, 1), (0, 0), 45, &products);
    Trial::new(map, EXIT, Trouble::NONE, 3)
}

/// The same robot with orders 1, 2, 3, … for these products; it has begun the first one.
fn busy(products: &[i32]) -> Trial {
    let mut trial = robot();
    for (id, product) in (1..).zip(products) {
        trial.order(id, *product);
    }
    trial.run_for(SECOND);
    trial
}

fn waiting(trial: &Trial) -> Vec<u32> {
    trial.queue.orders().iter().map(|order| order.id).collect()
}

/// The order number of each event of one kind, in turn.
fn orders(trial: &Trial, wanted: EventKind) -> Vec<u32> {
    let of_kind = trial.events.iter().filter(|(kind, ..)| *kind == wanted);
    of_kind.map(|(_, id, _)| *id).collect()
}

/// A person closes or opens the way from a node along a heading.
fn way(trial: &mut Trial, node: (u8, u8), heading: Heading, open: bool) {
    let kind = match open {
        true => InputKind::WayOpened,
        false => InputKind::WayBlocked,
    };
    trial.press_at(kind, node, heading);
}

#[test]
fn orders_are_carried_out_in_the_order_given() {
    let mut trial = busy(&[1, 3, 2, 4]);
    assert_eq!((trial.queue.under_way, trial.queue.order_id), (1, 1));
    assert_eq!(waiting(&trial), [2, 3, 4]);
    trial.deliver(4);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [1, 2, 3, 4]);
    assert_eq!(
        trial.queue,
        OrderQueue {
            order_id: 0,
            product: 0,
            ..trial.queue
        }
    );
    assert_eq!((trial.queue.under_way, trial.queue.count), (0, 0));
}

#[test]
fn waiting_orders_are_cancelled_moved_up_and_cleared_while_it_drives() {
    let mut trial = busy(&[1, 2, 3, 4]);
    trial.press(InputKind::OrderMovedUp, 4);
    assert_eq!(waiting(&trial), [2, 4, 3]);
    trial.press(InputKind::OrderMovedUp, 4);
    trial.press(InputKind::OrderMovedUp, 4);
    assert_eq!(
        waiting(&trial),
        [4, 2, 3],
        "before the first there is no place"
    );
    trial.press(InputKind::OrderCancelled, 2);
    trial.press(InputKind::OrderCancelled, 77);
    trial.press(InputKind::OrderMovedUp, 77);
    trial.press(InputKind::OrderMovedUp, 1);
    assert_eq!(waiting(&trial), [4, 3], "what is under way does not wait");
    let mut cleared = trial.clone();
    trial.deliver(3);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [1, 4, 3]);
    cleared.press(InputKind::QueueCleared, 0);
    assert_eq!(waiting(&cleared), [0; 0]);
    cleared.deliver(1);
}

#[test]
fn a_full_queue_refuses_and_says_how_many_wait() {
    let mut trial = busy(&[1]);
    for id in 2..MOST_ORDERS as u32 + 2 {
        trial.order(id, id as i32);
    }
    assert_eq!(trial.queue.orders().len(), MOST_ORDERS);
    assert_eq!(orders(&trial, EventKind::Refused), [0; 0]);
    trial.order(99, MOST_ORDERS as i32 + 2);
    assert_eq!(orders(&trial, EventKind::Refused), [99]);
    let said = trial.thoughts.last().unwrap();
    assert!(said.contains("31 orders are waiting already"), "{said}");
    trial.order(98, 77);
    let said = trial.thoughts.last().unwrap();
    assert!(said.contains("goods 77"), "{said}");
}

#[test]
fn an_order_without_a_way_is_put_off_and_carried_out_when_one_opens() {
    let mut trial = robot();
    // No way is left to the goods on the left edge, because that edge itself is closed.
    way(&mut trial, (0, 0), Heading::Up, false);
    trial.order(1, 3);
    trial.order(2, 2);
    trial.order(3, 1);
    trial.deliver_but(2, 1);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2, 3]);
    assert_eq!(waiting(&trial), [1]);
    assert_eq!(trial.queue.orders()[0].put_off, 1);
    way(&mut trial, (0, 0), Heading::Up, true);
    trial.deliver(3);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2, 3, 1]);
    assert_eq!(orders(&trial, EventKind::Refused), [0; 0]);
}

#[test]
fn an_order_that_loses_its_way_waits_while_another_one_is_carried_out() {
    let mut trial = busy(&[1, 2]);
    assert_eq!(trial.queue.order_id, 1);
    // A person closes the edge of product 1 while the robot drives there.
    way(&mut trial, (2, 0), Heading::Up, false);
    trial.deliver_but(1, 1);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2]);
    assert_eq!(waiting(&trial), [1]);
    way(&mut trial, (2, 0), Heading::Up, true);
    trial.deliver(2);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2, 1]);
}

#[test]
fn who_waits_at_home_for_a_way_to_a_cancelled_order_waits_no_more() {
    let mut trial = robot();
    way(&mut trial, (0, 0), Heading::Up, false);
    trial.order(1, 3);
    trial.step();
    let failure = trial.navigator.status().failure;
    assert_eq!(failure.kind.get(), Some(FailureKind::NoWay));
    trial.press(InputKind::OrderCancelled, 1);
    assert!(trial.navigator.status().failure.is_none());
    trial.order(2, 2);
    trial.deliver(1);
}

/// A robot on its way to product 1, with no way there any more and no other order.
fn without_a_way() -> Trial {
    let mut trial = busy(&[1]);
    way(&mut trial, (2, 0), Heading::Up, false);
    let stands = |trial: &Trial| trial.phase() == Phase::Stuck;
    assert!(trial.run_until(SECOND * 30, stands), "{}", trial.story());
    let failure = trial.navigator.status().failure;
    assert_eq!(failure.kind, FailureKind::NoWay, "{failure}");
    trial
}

#[test]
fn who_waits_for_a_way_takes_orders_and_carries_out_what_can_be_reached() {
    let mut trial = without_a_way();
    assert!(!trial.navigator.status().needs_reset());
    trial.order(2, 2);
    assert_eq!(orders(&trial, EventKind::Refused), [0; 0]);
    trial.deliver_but(1, 1);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2]);
    assert_eq!(waiting(&trial), [1]);
    way(&mut trial, (2, 0), Heading::Up, true);
    trial.deliver(2);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2, 1]);
}

#[test]
fn who_waits_for_a_way_and_is_driven_by_hand_does_not_know_its_place_any_more() {
    let mut trial = without_a_way();
    trial.body.autonomous = false;
    trial.tell_mode();
    trial.body.manual_duty = 100.0;
    trial.run_for(SECOND);
    trial.body.manual_duty = 0.0;
    let failure = trial.navigator.status().failure;
    assert_eq!(failure.kind, FailureKind::DrivenByHand, "{failure}");
    trial.order(2, 2);
    assert_eq!(orders(&trial, EventKind::Refused), [2]);
}

#[test]
fn the_order_under_way_is_taken_back_at_any_moment_before_its_goods_are_held() {
    let mut trial = busy(&[1]);
    let mut count = 0;
    // After 600 ms the operator says that the claw holds the goods, and the claw feels them.
    while trial.phase() != Phase::Picking {
        let mut fork = trial.clone();
        fork.press(InputKind::OrderCancelled, 1);
        assert_eq!((fork.queue.under_way, fork.queue.count), (0, 0));
        if count % 7 == 0 {
            fork.kill(Duration::from_millis(300));
        }
        fork.order(2, 2);
        fork.deliver(1);
        assert_eq!(
            orders(&fork, EventKind::ItemDelivered),
            [2],
            "{}",
            fork.story()
        );
        trial.run_for(Duration::from_millis(95));
        count += 1;
    }
    assert!(count > 100, "only {count} moments");
    trial.press(InputKind::OrderCancelled, 1);
    assert_eq!(trial.queue.under_way, 1);
    let said = trial.thoughts.last().unwrap();
    assert!(said.contains("I bring goods 1 all the same"), "{said}");
    trial.deliver(1);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [1]);
}

#[test]
fn who_stands_at_goods_that_nobody_picks_leaves_without_them_when_the_arm_is_carried() {
    let mut trial = busy(&[1]);
    let stands = |trial: &Trial| trial.phase() == Phase::Picking;
    assert!(trial.run_until(SECOND * 90, stands), "{}", trial.story());
    let [shoulder, claw] = [1, 7];
    trial.body.servos[claw] = 210;
    trial.body.claw_load = -20;
    trial.body.servos[shoulder] += 100;
    trial.run_for(SECOND / 10);
    trial.press(InputKind::OrderCancelled, 1);
    trial.run_for(SECOND / 2);
    trial.kill(SECOND / 5);
    trial.run_for(SECOND);
    let (status, order) = (trial.navigator.status(), trial.navigator.current_order());
    assert_eq!(status.hold, Hold::Arm, "{}", trial.story());
    assert_eq!(
        order.map(|order| (order.code, order.arm_granted)),
        Some((1, 1))
    );
    trial.body.servos[shoulder] -= 100;
    trial.order(2, 2);
    trial.run_for(SECOND);
    (trial.body.servos[claw], trial.body.claw_load) = (399, -311);
    trial.deliver(1);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2]);
}

#[test]
fn who_waits_at_goods_for_a_way_does_not_leave_with_its_arm_over_them() {
    let mut trial = busy(&[1]);
    let stands = |trial: &Trial| trial.phase() == Phase::Picking;
    assert!(trial.run_until(SECOND * 90, stands), "{}", trial.story());
    for y in [0, 1] {
        way(&mut trial, (1, y), Heading::Right, false);
    }
    let [shoulder, claw] = [1, 7];
    (trial.body.servos[claw], trial.body.claw_load) = (210, -20);
    trial.body.servos[shoulder] += 100;
    trial.run_for(SECOND / 10);
    trial.press(InputKind::OrderCancelled, 1);
    trial.run_for(SECOND);
    let failure = trial.navigator.status().failure;
    assert_eq!(failure.kind, FailureKind::NoWay, "{}", trial.story());
    way(&mut trial, (1, 0), Heading::Right, true);
    trial.run_for(SECOND);
    assert_eq!(trial.phase(), Phase::Leaving, "{}", trial.story());
    let (status, order) = (trial.navigator.status(), trial.navigator.current_order());
    assert_eq!(status.hold, Hold::Arm, "{}", trial.story());
    assert_eq!(order.map(|order| order.code), Some(1), "it turns");
    trial.body.servos[shoulder] -= 100;
    trial.order(2, 2);
    trial.run_for(SECOND);
    (trial.body.servos[claw], trial.body.claw_load) = (399, -311);
    trial.deliver(1);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2]);
}

#[test]
fn a_reset_gives_up_what_is_under_way_and_nothing_that_waits() {
    let mut trial = busy(&[1, 2]);
    trial.body.stopped = true;
    trial.tell_mode();
    trial.run_for(SECOND);
    let start = Body::new(&trial.published, EXIT, Trouble::NONE, 3);
    (trial.body.x, trial.body.y, trial.body.angle) = (start.x, start.y, start.angle);
    trial.press(InputKind::ResetPressed, 0);
    assert_eq!(orders(&trial, EventKind::Refused), [1]);
    trial.body.stopped = false;
    trial.tell_mode();
    trial.deliver(1);
    assert_eq!(orders(&trial, EventKind::ItemDelivered), [2]);
}

#[test]
fn every_order_survives_a_kill_at_every_step() {
    let mut trial = busy(&[2]);
    // One order has no way until the others are delivered, so it is put off.
    way(&mut trial, (1, 0), Heading::Right, false);
    way(&mut trial, (1, 1), Heading::Right, false);
    trial.order(2, 1);
    trial.order(3, 3);
    let mut kills = 0;
    while orders(&trial, EventKind::ItemDelivered) != [1, 3] {
        // The kill may come between status and queue: tries each mix of old and new ones.
        let (before, queue) = (trial.status, trial.queue);
        trial.step();
        kills += 1;
        let all_known = |navigator: &Navigator, delivered: &[u32]| {
            let queue = navigator.queue();
            let mut known: Vec<u32> = queue.orders().iter().map(|order| order.id).collect();
            known.extend((queue.under_way != 0).then_some(queue.order_id));
            known.extend(delivered);
            known.sort_unstable();
            known.dedup();
            known
        };
        for (status, queue) in [
            (before, queue),
            (before, trial.queue),
            (trial.status, trial.queue),
        ] {
            let config = LogicConfig::default();
            let successor = Navigator::resume(config, &status, &trial.blocks, &queue);
            let delivered = orders(&trial, EventKind::ItemDelivered);
            assert_eq!(
                all_known(&successor, &delivered),
                [1, 2, 3],
                "{}",
                trial.story()
            );
            let again = successor.queue();
            let numbers: Vec<u32> = again.orders().iter().map(|order| order.id).collect();
            assert!(
                !numbers.contains(&again.order_id) || again.under_way == 0,
                "{again:?}"
            );
        }
        if kills % 400 == 0 {
            let mut fork = trial.clone();
            fork.kill(Duration::from_millis(300));
            way(&mut fork, (1, 0), Heading::Right, true);
            fork.deliver(3);
        }
        assert!(trial.body.now < SECOND * 200, "{}", trial.story());
    }
    assert!(kills > 4_000, "only {kills} steps");
    assert_ne!(trial.phase(), Phase::Stuck);
}
