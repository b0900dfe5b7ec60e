//! Tests of goods that are not in their place: the robot refuses an order for them with the reason,
//! and drives to no empty shelf.

use std::time::Duration;

use lager_floor::Heading;
use lager_logic::{Input, LogicConfig};
use lager_orders::Pick;
use lager_topics::{EventKind, FailureKind, GoneWhy, InputKind, Phase};

use crate::double::Trouble;
use crate::floor::Exit;
use crate::trial::{Trial, warehouse};

const EXIT: Exit = Exit::Straight(450.0);
const SECOND: Duration = Duration::from_secs(1);

/// A robot with nothing to do, and two products.
fn robot(pick: Pick) -> Trial {
    let config = LogicConfig {
        pick,
        ..LogicConfig::default()
    };
    let products = [(0, 0, Heading::Up), (0, 0, Heading::Right)];
    let map = warehouse((1, 1), (0, 0), 45, &products);
    Trial::with(config, map, EXIT, Trouble::NONE, 3)
}

/// A robot that has just delivered product 1.
fn delivered() -> Trial {
    let mut trial = robot(Pick::Manual);
    trial.order(1, 1);
    trial.deliver(1);
    trial
}

/// The numbers of the refused orders.
fn refused(trial: &Trial) -> Vec<u32> {
    let events = trial.events.iter();
    let refused = events.filter(|(kind, ..)| *kind == EventKind::Refused);
    refused.map(|(_, id, _)| *id).collect()
}

fn gone(trial: &Trial) -> Vec<(i32, Option<GoneWhy>)> {
    let gone = trial.queue.gone().iter();
    gone.map(|gone| (gone.product, gone.why.get())).collect()
}

#[test]
fn delivered_goods_are_not_fetched_again_until_they_are_back() {
    let mut trial = delivered();
    assert_eq!(gone(&trial), [(1, Some(GoneWhy::Delivered))]);
    trial.kill(Duration::from_millis(300));
    trial.run_for(SECOND * 40);
    trial.order(2, 1);
    assert_eq!(refused(&trial), [2], "{}", trial.story());
    let said = trial.thoughts.last().unwrap();
    assert!(
        said.starts_with("I cannot fetch goods 1: goods 1 were delivered "),
        "{said}"
    );
    assert!(
        said.contains("s ago; put them back and say that they are there"),
        "{said}"
    );
    assert!(
        trial.navigator.status().failure.is_none(),
        "it is no failure of the robot's"
    );

    trial.press(InputKind::GoodsBack, 2);
    trial.order(3, 1);
    assert_eq!(refused(&trial), [2, 3], "others are back");
    trial.press(InputKind::GoodsBack, 1);
    assert_eq!(gone(&trial), []);
    trial.order(4, 1);
    trial.deliver(2);
    assert_eq!(refused(&trial), [2, 3]);
    trial.press(InputKind::GoodsBack, lager_topics::Input::ALL_GOODS);
    assert_eq!(gone(&trial), []);
}

#[test]
fn what_waits_or_is_under_way_is_not_ordered_twice() {
    let mut trial = robot(Pick::Manual);
    trial.order(1, 1);
    trial.order(2, 1);
    assert_eq!(refused(&trial), [2], "under way");
    trial.order(3, 2);
    trial.order(4, 2);
    assert_eq!(refused(&trial), [2, 4], "waiting");
    let said = trial.thoughts.last().unwrap();
    assert!(said.contains("goods 2 are ordered already"), "{said}");
    // After a cancelled order the product can be ordered again.
    trial.press(InputKind::OrderCancelled, 3);
    trial.order(5, 2);
    trial.deliver(2);
    assert_eq!(refused(&trial), [2, 4]);
}

#[test]
fn goods_that_were_not_found_are_known_to_be_gone() {
    let mut trial = robot(Pick::Auto);
    trial.order(1, 1);
    let gave_up = trial.run_until(SECOND * 400, |trial| {
        trial.navigator.status().failure.kind == FailureKind::GoodsMissing
    });
    assert!(gave_up, "{}", trial.story());
    assert_eq!(gone(&trial), [(1, Some(GoneWhy::NotFound))]);
    trial.run_for(SECOND / 5);
    trial.press(InputKind::OrderCancelled, 1);
    trial.order(2, 1);
    assert_eq!(refused(&trial), [2], "{}", trial.story());
    trial.order(3, 2);
    trial.body.goods_at = Some(512);
    trial.deliver(1);
}

#[test]
fn goods_in_the_claw_of_a_robot_that_is_put_down_are_not_looked_for_on_their_shelf() {
    let mut trial = robot(Pick::Manual);
    trial.order(1, 1);
    let brings = |trial: &Trial| trial.phase() == Phase::Leaving;
    assert!(trial.run_until(SECOND * 90, brings), "{}", trial.story());
    assert_eq!(gone(&trial), [(1, Some(GoneWhy::PickedUp))]);
    trial.body.stopped = true;
    trial.tell_mode();
    trial.run_for(SECOND);
    trial.press(InputKind::ResetPressed, 0);
    assert_eq!(refused(&trial), [1], "the order is given up");
    trial.order(2, 1);
    assert_eq!(refused(&trial), [1, 2]);
}

#[test]
fn a_waiting_order_for_goods_that_are_told_to_be_gone_is_refused() {
    let mut trial = robot(Pick::Manual);
    trial.order(1, 1);
    trial.order(2, 2);
    trial.run_for(SECOND);
    trial.press(InputKind::GoodsGone, 2);
    assert_eq!(refused(&trial), [2]);
    assert_eq!(trial.queue.orders().len(), 0);
    assert_eq!(gone(&trial), [(2, Some(GoneWhy::Told))]);
    trial.press(InputKind::GoodsGoneEarlier, 2);
    assert_eq!(gone(&trial), [(2, Some(GoneWhy::EarlierRun))]);
    trial.deliver(1);
}

#[test]
fn goods_that_a_person_has_put_elsewhere_on_the_map_are_there() {
    let mut trial = delivered();
    let products = [(0, 0, Heading::Left), (0, 0, Heading::Right)];
    let map = warehouse((1, 1), (0, 0), 45, &products);
    trial.published = map;
    trial.body.floor = crate::floor::Floor::new(&map, EXIT);
    trial.tell(Input::Map(&map));
    assert_eq!(gone(&trial), []);
    trial.order(2, 1);
    trial.deliver(2);
}
