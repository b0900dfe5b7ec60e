//! Whole missions among things that come and go, and in warehouses with ways that stay blocked. At
//! each node the planned way is compared with that of an oracle, which knows what the robot knows
//! there and nothing of how it plans.

use std::collections::BTreeMap;
use std::time::Duration;

use lager_floor::{Edge, Heading, Node};
use lager_plant::noise::Noise;
use lager_plant::{NamedProduct, Obstacle, Warehouse};
use lager_topics::{FailureKind, Goal, NavigatorStatus, Phase, Remedy};

use super::Whole;
use crate::config::Config;

/// Virtual time in which a mission must be over: the ways are tried again each minute.
const LIMIT: Duration = Duration::from_secs(3_000);

/// The built-in warehouse with things on these edges.
fn with_obstacles(name: &str, edges: &[[Node; 2]]) -> Warehouse {
    let mut warehouse = Warehouse::builtin(name).expect("built in");
    let stands = |between: &[Node; 2]| Obstacle { between: *between };
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
            let decisions = run_beside_oracle(&mut whole, &warehouse);
            assert!(decisions > 5, "{name} {seed}: only {decisions} decisions");
            assert_eq!(whole.robot.world().collisions(), 0, "{name} {seed}");
            blocked += whole.blocked;
        }
    }
    assert!(blocked > 10, "only {blocked} ways were found blocked");
}

#[test]
fn goods_without_a_way_are_unreachable_and_the_failure_says_what_would_end_it() {
    let warehouse = Warehouse::builtin("small").expect("built in");
    let product = &warehouse.products[0];
    // On the goods' own edge.
    let edge = Edge::of(product.square, product.side);
    let closed = with_obstacles("small", &[edge.ends()]);
    let mut whole = whole(&closed, &[product.id], 1, 0);
    let why = whole.run(LIMIT).expect("a failure");
    assert!(why.contains("the robot cannot get from"), "{why}");
    let failure = whole.navigator.status().failure;
    assert_eq!(failure.kind, FailureKind::Unreachable);
    assert_eq!(failure.remedy, Remedy::Way);
}

#[test]
fn a_mission_in_a_large_hall_full_of_things_goes_the_shortest_ways_that_the_robot_knows_of() {
    let product = |id, [x, y]: [u8; 2], side| NamedProduct {
        id,
        name: None,
        square: Node::new(x, y),
        side,
    };
    let mut hall = Warehouse {
        size: Node::new(20, 20),
        delivery: Node::new(0, 0),
        products: vec![
            product(1, [9, 8], Heading::Up),
            product(2, [3, 12], Heading::Left),
            product(3, [18, 1], Heading::Right),
        ],
        ..Warehouse::builtin("small").expect("built in")
    };
    let mut noise = Noise::new(20, 5);
    let mut edges = BTreeMap::new();
    while edges.len() < 60 {
        let [x, y] = [0, 0].map(|_: u8| (noise.bits() % 20) as u8);
        let side = [Heading::Down, Heading::Left][noise.bits() as usize % 2];
        let edge = Edge::of(Node::new(x, y), side);
        // The way out of the corner, and the goods' own, stay open.
        let is_free = hall
            .products
            .iter()
            .all(|product| Edge::of(product.square, product.side) != edge);
        if x + y > 2 && is_free {
            edges.insert([x, y], edge);
        }
    }
    let stands = |edge: Edge| Obstacle {
        between: edge.ends(),
    };
    hall.obstacles.extend(edges.into_values().map(stands));
    let mut whole = whole(&hall, &[1, 2], 3, 0);
    let decisions = run_beside_oracle(&mut whole, &hall);
    assert!(decisions > 60, "only {decisions} decisions");
    assert!(
        whole.blocked > 3,
        "only {} ways were blocked",
        whole.blocked
    );
    assert_eq!(whole.robot.world().collisions(), 0);
}

/// A node as the oracle counts, which also looks beside the floor.
type At = [i16; 2];

/// Runs the mission to its end, and compares the way planned at each node with the oracle's. How
/// many have been compared.
fn run_beside_oracle(whole: &mut Whole, warehouse: &Warehouse) -> u32 {
    let (mut before, mut decisions) = (NavigatorStatus::default(), 0);
    loop {
        assert!(whole.now < LIMIT, "it never ends");
        let outcome = whole.turn();
        let now = whole.navigator.status();
        let at = |status: &NavigatorStatus| [status.x, status.y];
        let passes = at(&now) != at(&before)
            && matches!(
                before.phase.get(),
                Some(Phase::Driving | Phase::Approaching)
            );
        let decides = now.phase != before.phase
            && matches!(now.phase.get(), Some(Phase::Turning | Phase::Looking));
        if passes && now.phase != Phase::Stuck || decides {
            let goals = goals(warehouse, &now);
            if !goals.is_empty() && !goals.contains(&at(&now)) {
                let oracle = best(warehouse, whole, &now, &goals);
                assert_eq!(Some(planned(whole, &now)), oracle, "{now:#?}");
                decisions += 1;
            }
        }
        before = now;
        if let Some(outcome) = outcome {
            assert_eq!(outcome, Ok(()));
            return decisions;
        }
    }
}

fn node(node: Node) -> At {
    [node.x, node.y].map(i16::from)
}

/// Where the robot must get to.
fn goals(warehouse: &Warehouse, status: &NavigatorStatus) -> Vec<At> {
    match status.goal.get() {
        Some(Goal::Product) => {
            let is_it = |product: &&NamedProduct| product.id == status.product;
            let product = warehouse.products.iter().find(is_it).expect("a product");
            let edge = Edge::of(product.square, product.side);
            edge.ends().map(node).to_vec()
        }
        Some(Goal::Delivery | Goal::Home) => vec![node(warehouse.delivery)],
        _ => Vec::new(),
    }
}

/// Steps along the headings, in their order.
const STEPS: [At; 4] = [[-1, 0], [0, 1], [1, 0], [0, -1]];

fn quarters(from: usize, to: usize) -> u32 {
    [0, 1, 2, 1][(4 + to - from) % 4]
}

/// Edges and quarter turns of the route from where the robot is.
fn planned(whole: &Whole, status: &NavigatorStatus) -> (u32, u32) {
    let (mut x, mut y) = (status.x, status.y);
    let mut heading = status.heading.get().expect("a heading") as usize;
    let mut turns = 0;
    let nodes = whole.navigator.route().nodes();
    for next in nodes {
        let step = [i16::from(next.x) - x, i16::from(next.y) - y];
        let along = STEPS.iter().position(|one| *one == step).expect("a step");
        turns += quarters(heading, along);
        heading = along;
        [x, y] = [i16::from(next.x), i16::from(next.y)];
    }
    (nodes.len() as u32, turns)
}

/// The same of the best way round what the robot knows to be blocked: every move is tried until
/// none is an improvement.
fn best(
    warehouse: &Warehouse,
    whole: &Whole,
    status: &NavigatorStatus,
    goals: &[At],
) -> Option<(u32, u32)> {
    let ways = whole.navigator.blocks();
    let is_open = |[x, y]: At, along: usize| {
        !ways.ways().iter().any(|way| {
            let heading = way
                .heading
                .get()
                .map_or(0, |heading: Heading| heading as usize);
            let one = [i16::from(way.x), i16::from(way.y)];
            let other = [one[0] + STEPS[heading][0], one[1] + STEPS[heading][1]];
            (one, heading) == ([x, y], along) || (other, (heading + 2) % 4) == ([x, y], along)
        })
    };
    let [width, height] = node(warehouse.size);
    let start = ([status.x, status.y], status.heading.get()? as usize);
    let mut costs = BTreeMap::from([(start, (0, 0))]);
    let mut open = vec![start];
    while let Some((at, heading)) = open.pop() {
        let (edges, turns) = costs[&(at, heading)];
        for (along, step) in STEPS.iter().enumerate() {
            let there = [at[0] + step[0], at[1] + step[1]];
            let is_inside = (0..=width).contains(&there[0]) && (0..=height).contains(&there[1]);
            let cost = (edges + 1, turns + quarters(heading, along));
            let known = costs.get(&(there, along));
            if is_inside && is_open(at, along) && known.is_none_or(|known| cost < *known) {
                costs.insert((there, along), cost);
                open.insert(0, (there, along));
            }
        }
    }
    let is_goal = |((at, _), _): &(&(At, usize), &(u32, u32))| goals.contains(at);
    costs.iter().filter(is_goal).map(|(_, cost)| *cost).min()
}
