//! `replan/*`: times how long the navigator plans a new way to its goal when it finds its way
//! blocked (L6). The floor is the largest that a robot takes, 100 x 100 nodes. The row beside it
//! looks once at every way of that floor: any reliable search must do at least that.
//!
//! In `far` the goal is in the opposite corner. In `walled` it is straight ahead behind a wall of
//! as many blocks as possible, so that the way leads around it. One iteration is two plans.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use lager_floor::{Heading, MAX_SQUARES, Node};
use lager_logic::blocks::{Block, Blocks, MAX_BLOCKS};
use lager_logic::map::Map;
use lager_logic::route::Distances;
use lager_topics::{BlockSource, Route, WarehouseMap};

fn floor() -> Map {
    let floor = WarehouseMap {
        width: MAX_SQUARES,
        height: MAX_SQUARES,
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

/// A wall of as many blocks as the memory of blocks holds, less one.
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
            let node = |index| map.grid.node(index);
            let ways = (0..map.grid.node_count()).map(node).flat_map(|node| {
                Heading::ALL.map(|heading| blocks.is_open(black_box(&map), node, heading))
            });
            black_box(ways.filter(|open| *open).count())
        });
    });
    let from = Node::new(0, 0);
    for (name, goal, mut blocks, least) in [
        (
            "far",
            Node::new(MAX_SQUARES, MAX_SQUARES),
            Blocks::default(),
            198,
        ),
        ("walled", Node::new(0, MAX_SQUARES), wall(&map), 225),
    ] {
        let mut distances = Distances::default();
        let mut route = Route::default();
        let found = blocked(from, Heading::Right);
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                // The way is found blocked, and then open again: two plans.
                assert!(blocks.block(&map, found));
                distances.search(&map, &blocks, [goal; 2]);
                distances.write_route(&map, from, Heading::Right, &mut route);
                assert!(blocks.open(found.node, found.heading));
                distances.search(&map, &blocks, [goal; 2]);
                distances.write_route(&map, from, Heading::Right, &mut route);
                black_box(&route);
            });
        });
        // There is none if the command line did not choose this bench.
        assert!(route.length == 0 || route.length >= least);
    }
    group.finish();
}

criterion_group!(benches, replan);
criterion_main!(benches);
