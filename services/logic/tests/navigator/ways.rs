//! Tests of ways that people block and open during a mission, and of the published blocks.

use std::time::Duration;

use lager_floor::Heading;
use lager_logic::Input;
use lager_topics::{EventKind, FailureKind, InputKind, Phase, Remedy, WarehouseMap};

use crate::double::Trouble;
use crate::floor::Exit;
use crate::trial::{Trial, warehouse};

const SECOND: Duration = Duration::from_secs(1);

fn floor() -> WarehouseMap {
    warehouse((2, 1), (0, 0), 45, &[(1, 0, Heading::Right)])
}

fn mission() -> Trial {
    Trial::new(floor(), Exit::Straight(450.0), Trouble::NONE, 3)
}

/// Blocks the way from a node, or opens it.
fn way(trial: &mut Trial, (x, y): (u8, u8), heading: Heading, open: bool) {
    let kind = match open {
        true => InputKind::WayOpened,
        false => InputKind::WayBlocked,
    };
    trial.press_at(kind, (x, y), heading);
}

#[test]
fn a_blocked_way_is_driven_round_and_the_same_floor_clears_nothing() {
    let mut trial = mission();
    way(&mut trial, (0, 0), Heading::Right, false);
    let same = floor();
    trial.tell(Input::Map(&same));
    trial.order(1, 1);
    trial.deliver(1);
    let first = trial
        .events
        .iter()
        .find(|(kind, ..)| *kind == EventKind::NextNode);
    assert_eq!(first.map(|(.., node)| (node.x, node.y)), Some((0, 1)));
}

#[test]
fn a_changed_list_of_products_clears_no_block() {
    let mut trial = mission();
    way(&mut trial, (0, 0), Heading::Right, false);
    let mut map = floor();
    map.products[0].id = 7;
    trial.tell(Input::Map(&map));
    trial.order(1, 7);
    let nodes = trial.navigator.route().nodes();
    assert_eq!((nodes[0].x, nodes[0].y), (0, 1), "{}", trial.story());
}

#[test]
fn who_finds_no_way_says_so_and_goes_on_when_one_is_open() {
    let mut trial = mission();
    trial.order(1, 1);
    // One way behind the robot and one ahead of it, while it drives along the lower edge.
    trial.run_for(SECOND);
    for (node, heading) in [((1, 0), Heading::Right), ((1, 1), Heading::Right)] {
        way(&mut trial, node, heading, false);
    }
    let stuck = trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Stuck);
    assert!(stuck, "{}", trial.story());
    let failure = trial.navigator.status().failure;
    assert_eq!(
        (
            failure.kind.get(),
            failure.remedy.get(),
            failure.x,
            failure.y
        ),
        (Some(FailureKind::NoWay), Some(Remedy::Way), 1, 0)
    );
    trial.run_for(SECOND * 5);
    assert_eq!(trial.phase(), Phase::Stuck);
    way(&mut trial, (2, 1), Heading::Left, true);
    assert!(trial.navigator.status().failure.is_none());
    trial.deliver(1);
}

#[test]
fn an_order_for_goods_without_a_way_waits_for_one_and_says_so() {
    let mut trial = mission();
    way(&mut trial, (0, 0), Heading::Right, false);
    way(&mut trial, (0, 0), Heading::Up, false);
    trial.order(1, 1);
    trial.step();
    let last = trial.events.last().map(|event| (event.0, event.1));
    assert_eq!(
        last.map(|event| event.0),
        Some(EventKind::Failed),
        "{}",
        trial.story()
    );
    let status = trial.navigator.status();
    assert_eq!(status.remedy.get(), Some(Remedy::Way));
    assert_eq!(trial.queue.orders()[0].put_off, 1);
    trial.run_for(SECOND * 90);
    assert_eq!(
        trial.status.waiting, 1,
        "a person's block stays, and so does the order"
    );
    way(&mut trial, (0, 0), Heading::Up, true);
    trial.deliver(1);
}

#[test]
fn a_distance_carries_its_age() {
    let mut trial = mission();
    assert_eq!(trial.navigator.status().distance_age_ms, u16::MAX);
    trial.tell(Input::Distance(37));
    trial.run_for(SECOND / 4);
    let status = trial.navigator.status();
    assert_eq!((status.distance_cm, status.distance_age_ms), (37, 250));
    trial.run_for(SECOND * 70);
    assert_eq!(trial.navigator.status().distance_age_ms, u16::MAX);
}
