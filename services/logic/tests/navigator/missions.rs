//! Tests of whole missions: every corner, every side and every size, with and without disturbances.

use std::time::Duration;

use lager_floor::Heading;
use lager_topics::EventKind;
use proptest::prelude::*;

use crate::double::Trouble;
use crate::floor::Exit;
use crate::trial::{SIDES, Trial, corners, missions, warehouse};

const STRAIGHT: Exit = Exit::Straight(600.0);

fn fetch(
    size: (u8, u8),
    delivery: (u8, u8),
    side_cm: u16,
    product: (u8, u8, Heading),
    exit: Exit,
    trouble: Trouble,
) -> Trial {
    let map = warehouse(size, delivery, side_cm, &[product]);
    let mut trial = Trial::new(map, exit, trouble, 7);
    trial.order(1, 1);
    trial.deliver(1);
    assert_eq!(trial.count(EventKind::GettingItem), 1, "{}", trial.story());
    assert_eq!(trial.count(EventKind::InPosition), 1, "{}", trial.story());
    assert_eq!(
        trial.count(EventKind::ItemDelivered),
        1,
        "{}",
        trial.story()
    );
    trial
}

#[test]
fn one_square_from_every_corner_to_every_side() {
    for delivery in corners((1, 1)) {
        for side in SIDES {
            fetch((1, 1), delivery, 50, (0, 0, side), STRAIGHT, Trouble::NONE);
        }
    }
}

#[test]
fn every_square_and_side_of_a_warehouse() {
    for delivery in corners((2, 2)) {
        for square in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            for side in SIDES {
                let product = (square.0, square.1, side);
                fetch((2, 2), delivery, 50, product, STRAIGHT, Trouble::NONE);
            }
        }
    }
}

#[test]
fn the_largest_warehouse_with_long_and_short_edges() {
    for side_cm in [40, 75] {
        for delivery in corners((5, 4)) {
            for side in SIDES {
                let far = (4 - delivery.0.min(4), 3 - delivery.1.min(3), side);
                fetch((5, 4), delivery, side_cm, far, STRAIGHT, Trouble::NONE);
            }
        }
    }
}

#[test]
fn a_way_out_that_curves() {
    for delivery in corners((2, 1)) {
        let exit = Exit::Curved(300.0, 800.0);
        fetch(
            (2, 1),
            delivery,
            50,
            (1, 0, Heading::Up),
            exit,
            Trouble::NONE,
        );
    }
}

#[test]
fn every_crossing_on_the_way_is_announced() {
    let trial = fetch(
        (3, 1),
        (0, 0),
        50,
        (2, 0, Heading::Down),
        STRAIGHT,
        Trouble::NONE,
    );
    let nodes: Vec<_> = trial
        .events
        .iter()
        .filter(|(kind, ..)| *kind == EventKind::NextNode)
        .map(|(.., node)| (node.x, node.y))
        .collect();
    // Along the lower edge to the near end of the station's edge, back to the corner, and back from
    // the place of delivery.
    assert_eq!(nodes, [(1, 0), (2, 0), (2, 0), (1, 0), (0, 0), (0, 0)]);
}

#[test]
fn a_crossing_passed_straight_on_does_not_stop_the_robot() {
    let trial = fetch(
        (4, 1),
        (0, 0),
        50,
        (3, 0, Heading::Down),
        STRAIGHT,
        Trouble::NONE,
    );
    // In and out at the station, round at the bar; the lower edge needs no turn.
    let left = trial.body.begun.iter().filter(|code| **code == 7).count();
    let right = trial.body.begun.iter().filter(|code| **code == 10).count();
    assert_eq!((left, right), (2, 2), "{:?}", trial.body.begun);
    assert!(trial.body.begun.contains(&0xFB));
}

#[test]
fn three_orders_one_after_the_other() {
    let products = [
        (0, 0, Heading::Up),
        (1, 1, Heading::Left),
        (1, 0, Heading::Right),
    ];
    let mut trial = Trial::new(
        warehouse((2, 2), (2, 0), 50, &products),
        STRAIGHT,
        Trouble::NONE,
        1,
    );
    for (id, product) in [(1, 1), (2, 3), (3, 2)] {
        trial.order(id, product);
        trial.deliver(id);
    }
    assert_eq!(trial.count(EventKind::ItemDelivered), 3);
}

#[test]
fn a_waiting_order_is_begun_at_the_corner() {
    let products = [(0, 0, Heading::Up), (1, 1, Heading::Left)];
    let mut trial = Trial::new(
        warehouse((2, 2), (0, 0), 50, &products),
        STRAIGHT,
        Trouble::NONE,
        1,
    );
    trial.order(1, 1);
    trial.run_for(Duration::from_secs(5));
    trial.order(2, 2);
    trial.deliver(2);
    let kinds: Vec<_> = trial
        .events
        .iter()
        .filter(|(kind, ..)| *kind != EventKind::NextNode)
        .map(|(kind, id, _)| (*kind, *id))
        .collect();
    use EventKind::{GettingItem, InPosition, ItemDelivered};
    let both = [1, 2].map(|id| [(GettingItem, id), (InPosition, id), (ItemDelivered, id)]);
    assert_eq!(kinds, both.concat());
}

proptest! {
    #![proptest_config(missions(60))]

    #[test]
    fn any_mission_under_any_trouble_ends(
        (width, height) in (1u8..6, 1u8..5),
        corner in 0usize..4,
        square in (0u8..5, 0u8..4),
        side in 0usize..4,
        side_cm in 40u16..90,
        exit_mm in 400.0f64..1200.0,
        curve in prop::option::of(900.0f64..1500.0),
        slow_link in any::<bool>(),
        lost in 0u64..80,
        noise in 0u64..15,
        gains in (0.97f64..1.03, 0.97f64..1.03),
        seed in 1u64..1000,
    ) {
        let product = (square.0 % width, square.1 % height, SIDES[side]);
        let delivery = corners((width, height))[corner];
        let exit = match curve {
            Some(radius) => Exit::Curved(exit_mm, radius),
            None => Exit::Straight(exit_mm),
        };
        let frame_ms = if slow_link { 25 } else { 10 };
        let trouble = Trouble { frame_ms, lost, noise, gains };
        let map = warehouse((width, height), delivery, side_cm, &[product]);
        let mut trial = Trial::new(map, exit, trouble, seed);
        trial.order(1, 1);
        trial.deliver(1);
        prop_assert_eq!(trial.count(EventKind::ItemDelivered), 1);
    }
}
