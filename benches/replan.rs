//! `replan/*`: a way is found blocked, and the way to the goal is planned anew (L6), on the largest
//! floor that a robot takes: 100 x 100 nodes. Beside it looking once at every way of that floor,
//! which is the least that any search can do that has to be sure.
//!
//! `far` has the goal in the opposite corner. `walled` has it straight ahead behind a wall of as
//! many blocks as there is room for, so that the way leads around it. One iteration is two plans.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use lager_logic::blocks::{Block, Blocks, MAX_BLOCKS};
use lager_logic::heading::HEADINGS;
use lager_logic::map::Map;
use lager_logic::node::Node;
use lager_logic::route::Distances;
use lager_topics::{BlockSource, Heading, Route, WarehouseMap};

/// Squares of a side: one less than its nodes.
const SQUARES: u8 = 99;

fn floor() -> Map {
    let floor = WarehouseMap {
        width: SQUARES,
        height: SQUARES,
        side_length_cm: 40,
        ..WarehouseMap::default()
    };
    Map::new(&floor).expect("the largest floor")
}

fn blocked(node: Node, heading: Heading) -> Block {
    Block {
        node,
        heading,
        since: Duration::ZERO,
        source: BlockSource::Sensor,
    }
}

/// As many blocks as there is room for beside one more.
fn wall(map: &Map) -> Blocks {
    let mut blocks = Blocks::default();
    for x in 0..MAX_BLOCKS as u8 - 1 {
        let is_new = blocks.block(map, blocked(Node::new(x, 50), Heading::Up));
        assert!(is_new);
    }
    blocks
}

fn replan(criterion: &mut Criterion) {
    let map = floor();
    let mut group = criterion.benchmark_group("replan/100x100");
    group.bench_function("baseline-look-at-every-way", |bencher| {
        let blocks = Blocks::default();
        bencher.iter(|| {
            let node = |index| map.node(index);
            let ways = (0..map.node_count()).map(node).flat_map(|node| {
                HEADINGS.map(|heading| blocks.is_open(black_box(&map), node, heading))
            });
            black_box(ways.filter(|open| *open).count())
        });
    });
    let from = Node::new(0, 0);
    for (name, goal, mut blocks, least) in [
        ("far", Node::new(SQUARES, SQUARES), Blocks::default(), 198),
        ("walled", Node::new(0, SQUARES), wall(&map), 225),
    ] {
        let mut distances = Distances::default();
        let mut route = Route::default();
        let found = blocked(from, Heading::Right);
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                // Found blocked, and open again: two plans.
                assert!(blocks.block(&map, found));
                distances.search(&map, &blocks, [goal; 2]);
                distances.write_route(&map, from, Heading::Right, &mut route);
                assert!(blocks.open(found.node, found.heading));
                distances.search(&map, &blocks, [goal; 2]);
                distances.write_route(&map, from, Heading::Right, &mut route);
                black_box(&route);
            });
        });
        // None where this bench was not asked for.
        assert!(route.length == 0 || route.length >= least);
    }
    group.finish();
}

criterion_group!(benches, replan);
criterion_main!(benches);
