//! Whole missions among things that come and go, and in warehouses with ways that stay blocked.

use std::time::Duration;

use lager_plant::{Obstacle, Warehouse};
use lager_topics::{FailureKind, Remedy};

use super::Whole;
use crate::config::Config;

/// Virtual time in which a mission must be over: the ways are tried again each minute.
const LIMIT: Duration = Duration::from_secs(3_000);

/// The built-in warehouse with things on these edges.
fn with_obstacles(name: &str, edges: &[[[u8; 2]; 2]]) -> Warehouse {
    let mut warehouse = Warehouse::builtin(name).expect("built in");
    let stands = |between: &[[u8; 2]; 2]| Obstacle { between: *between };
    warehouse.obstacles.extend(edges.iter().map(stands));
    warehouse
}

fn whole(warehouse: &Warehouse, mission: &[i32], seed: u64, obstacles: u32) -> Whole {
    Whole::new(&Config::default(), warehouse, mission, seed, obstacles).expect("a robot")
}

#[test]
fn missions_among_things_that_come_and_go_are_delivered() {
    let mut blocked = 0;
    for name in ["small", "curved", "large"] {
        let warehouse = Warehouse::builtin(name).expect("built in");
        let mission: Vec<i32> = warehouse.products.iter().take(3).map(|p| p.id).collect();
        for seed in 1..=4 {
            let mut whole = whole(&warehouse, &mission, seed, 4);
            assert_eq!(whole.run(LIMIT), None, "{name} {seed}");
            blocked += whole.blocked;
        }
    }
    assert!(blocked > 10, "only {blocked} ways were found blocked");
}

#[test]
fn goods_without_a_way_are_unreachable_and_the_failure_says_what_would_end_it() {
    let warehouse = Warehouse::builtin("small").expect("built in");
    let product = warehouse.products[0];
    // On the goods' own edge.
    let edge = lager_plant::Edge::of(product.square, product.side);
    let closed = with_obstacles("small", &[[edge.from, edge.to]]);
    let mut whole = whole(&closed, &[product.id], 1, 0);
    let why = whole.run(LIMIT).expect("a failure");
    assert!(why.contains("I cannot get from"), "{why}");
    let failure = whole.navigator.status().failure;
    assert_eq!(failure.kind, FailureKind::Unreachable);
    assert_eq!(failure.remedy, Remedy::Way);
}
