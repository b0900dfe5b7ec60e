//! Tests of things on the floor: the robot sees them from a node or on its way, drives round them
//! or waits, and reports a goal to which no way is left.

use std::time::Duration;

use lager_floor::{Heading, Node};
use lager_logic::LogicConfig;
use lager_logic::map::Map;
use lager_topics::{BlockSource, BlockedWays, EventKind, FailureKind, Phase, Remedy};
use proptest::prelude::*;

use crate::double::Trouble;
use crate::floor::Exit;
use crate::trial::{SIDES, Trial, corners, missions, warehouse};

const SECOND: Duration = Duration::from_secs(1);
const EXIT: Exit = Exit::Straight(450.0);

type Edge = ((u8, u8), (u8, u8));

fn trial(size: (u8, u8), delivery: (u8, u8), side_cm: u16, product: (u8, u8, Heading)) -> Trial {
    let config = LogicConfig {
        ranger_cm: 80,
        ..LogicConfig::default()
    };
    let map = warehouse(size, delivery, side_cm, &[product]);
    Trial::with(config, map, EXIT, Trouble::NONE, 3)
}

/// The floor of the examples: the goods are on the right edge, with two ways to them.
///
/// ```text
///   (0,1)---(1,1)---(2,1)
///     |       |       P
///   (0,0)---(1,0)---(2,0)
/// ```
fn example(side_cm: u16) -> Trial {
    trial((2, 1), (0, 0), side_cm, (1, 0, Heading::Right))
}

fn put(trial: &mut Trial, (a, b): Edge) {
    let obstacle = trial.body.floor.obstacle(a, b);
    trial.body.obstacles.push(obstacle);
}

fn take(trial: &mut Trial, (a, b): Edge) {
    let gone = trial.body.floor.obstacle(a, b);
    trial.body.obstacles.retain(|stands| *stands != gone);
}

fn blocked(trial: &Trial) -> Vec<((u8, u8), Heading)> {
    let ways = trial.navigator.blocks();
    let way = |way: &lager_topics::BlockedWay| ((way.x, way.y), way.heading.get().unwrap());
    ways.ways().iter().map(way).collect()
}

fn failure(trial: &Trial) -> (Option<FailureKind>, Option<Remedy>) {
    let failure = trial.navigator.status().failure;
    (failure.kind.get(), failure.remedy.get())
}

/// Whether the robot tries the ways again within 70 s.
fn goes_on(trial: &mut Trial) -> bool {
    trial.run_until(SECOND * 70, |trial| trial.phase() != Phase::Stuck)
}

fn nodes(trial: &Trial) -> Vec<(u8, u8)> {
    trial
        .events
        .iter()
        .filter(|(kind, ..)| *kind == EventKind::NextNode)
        .map(|(.., node)| (node.x, node.y))
        .collect()
}

#[test]
fn a_turn_before_what_stands_close_behind_its_node_has_room() {
    let mut trial = example(45);
    put(&mut trial, ((1, 0), (2, 0)));
    trial.order(1, 1);
    let turns_up =
        |trial: &Trial| trial.phase() == Phase::Turning && trial.status.target == Heading::Up;
    assert!(trial.run_until(SECOND * 30, turns_up), "{}", trial.story());
    let at_node = trial.body.x;
    let has_turned = |trial: &Trial| trial.status.heading == Heading::Up;
    assert!(trial.run_until(SECOND * 5, has_turned), "{}", trial.story());
    let back = at_node - trial.body.x;
    assert!((15.0..35.0).contains(&back), "{back} mm: {}", trial.story());
    trial.deliver(1);
    assert!(!trial.body.touched, "{}", trial.story());
}

#[test]
fn who_would_touch_a_thing_behind_the_next_node_turns_back_before_it_and_goes_another_way() {
    // The body reaches 170 mm ahead of the axle. In squares of 40 cm a thing in the middle of a way
    // begins 160 mm behind its node; in larger squares it may stand anywhere.
    for (side_cm, behind) in [(40, 160.0), (50, 165.0), (60, 120.0), (100, 140.0)] {
        let mut trial = example(side_cm);
        let at = f64::from(side_cm) * 10.0 + behind;
        trial.body.obstacles.push(((at, -80.0), (at + 80.0, 80.0)));
        trial.order(1, 1);
        let halted = trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Halted);
        assert!(halted, "{}", trial.story());
        trial.deliver(1);
        assert!(!trial.body.touched, "{}", trial.story());
        assert_eq!(nodes(&trial)[..2], [(0, 0), (0, 1)], "{}", trial.story());
    }
}

#[test]
fn what_is_seen_from_a_node_is_driven_round_without_going_near_it() {
    let mut trial = example(50);
    put(&mut trial, ((1, 0), (2, 0)));
    trial.order(1, 1);
    trial.deliver(1);
    assert!(!trial.body.touched, "{}", trial.story());
    assert_eq!(nodes(&trial)[..3], [(1, 0), (1, 1), (2, 1)]);
    assert_eq!(blocked(&trial), [((1, 0), Heading::Right)]);
    assert_eq!(trial.count(EventKind::WayBlocked), 1);
    let seen = trial.navigator.blocks().ways()[0];
    assert_eq!(seen.source, BlockSource::Sensor);
    assert!(seen.since_ns > 0);
}

#[test]
fn an_open_way_straight_on_is_looked_at_without_standing() {
    let mut trial = trial((4, 1), (0, 0), 50, (3, 0, Heading::Down));
    trial.order(1, 1);
    // From the first drive until it reaches the goods, the only command is "forward".
    let drives = |trial: &Trial| trial.navigator.status().code == 3;
    assert!(trial.run_until(SECOND, drives), "{}", trial.story());
    while trial.phase() != Phase::Positioning {
        assert!(drives(&trial), "{}", trial.story());
        trial.step();
    }
    assert!(trial.count(EventKind::NextNode) >= 2);
}

#[test]
fn who_comes_upon_a_thing_on_the_way_goes_back_to_the_node_it_came_from() {
    // Seen from afar in the first case, put down just before the robot in the second.
    for (side_cm, late) in [(240, false), (120, true)] {
        let mut trial = example(side_cm);
        trial.order(1, 1);
        if late {
            let far = f64::from(side_cm) * 10.0 / 2.0 - 40.0 - 350.0;
            assert!(trial.run_until(SECOND * 60, |trial| trial.body.x > far));
        }
        put(&mut trial, ((0, 0), (1, 0)));
        let halted = trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Halted);
        assert!(halted, "{}", trial.story());
        trial.deliver(1);
        assert!(!trial.body.touched, "{}", trial.story());
        assert_eq!(nodes(&trial)[..2], [(0, 0), (0, 1)], "{}", trial.story());
    }
}

#[test]
fn who_goes_away_in_time_has_blocked_nothing() {
    let mut trial = example(240);
    trial.order(1, 1);
    put(&mut trial, ((0, 0), (1, 0)));
    assert!(trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Halted));
    trial.run_for(SECOND / 2);
    take(&mut trial, ((0, 0), (1, 0)));
    trial.deliver(1);
    assert_eq!(blocked(&trial), []);
    assert_eq!(nodes(&trial)[0], (1, 0));
}

#[test]
fn a_goal_is_unreachable_when_all_ways_were_tried_again_and_is_reached_when_one_opens() {
    let mut trial = example(50);
    let walls = [((1, 0), (2, 0)), ((1, 1), (2, 1))];
    for wall in walls {
        put(&mut trial, wall);
    }
    trial.order(1, 1);
    let waits = trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Stuck);
    assert!(waits, "{}", trial.story());
    assert_eq!(
        failure(&trial),
        (Some(FailureKind::NoWay), Some(Remedy::Way))
    );
    let gives_up = |trial: &Trial| failure(trial).0 == Some(FailureKind::Unreachable);
    assert!(trial.run_until(SECOND * 150, gives_up), "{}", trial.story());
    assert!(trial.count(EventKind::Failed) == 2, "{}", trial.story());
    take(&mut trial, walls[1]);
    assert!(goes_on(&mut trial), "{}", trial.story());
    trial.deliver(1);
    assert!(!trial.body.touched, "{}", trial.story());
}

#[test]
fn goods_on_a_closed_edge_are_unreachable_and_say_so() {
    let mut trial = example(50);
    put(&mut trial, ((2, 0), (2, 1)));
    trial.order(1, 1);
    let gives_up = |trial: &Trial| failure(trial).0 == Some(FailureKind::Unreachable);
    assert!(trial.run_until(SECOND * 300, gives_up), "{}", trial.story());
    take(&mut trial, ((2, 0), (2, 1)));
    assert!(goes_on(&mut trial), "{}", trial.story());
    trial.deliver(1);
    assert!(!trial.body.touched, "{}", trial.story());
}

#[test]
fn who_must_look_and_hears_no_distance_stands_and_says_what_would_end_it() {
    let mut trial = example(50);
    trial.order(1, 1);
    trial.body.sees_cm = None;
    trial.run_for(SECOND * 3);
    assert!(trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Looking));
    trial.run_for(SECOND * 3);
    let status = trial.navigator.status();
    assert_eq!((status.remedy.get(), status.code), (Some(Remedy::Light), 1));
    trial.body.sees_cm = Some(80);
    trial.deliver(1);
}

#[test]
fn a_killed_navigator_goes_round_what_it_has_seen() {
    let mut trial = trial((1, 1), (0, 0), 70, (0, 0, Heading::Up));
    put(&mut trial, ((0, 0), (0, 1)));
    trial.order(1, 1);
    let outages = [20, 90, 130, 250, 700].map(Duration::from_millis);
    let mut kills = 0;
    while !(trial.status.delivered == 1 && trial.is_home()) {
        trial.run_for(Duration::from_millis(135));
        let mut fork = trial.clone();
        fork.kill(outages[kills % outages.len()]);
        fork.thoughts
            .push(format!("(killed at {:?})", trial.body.now));
        fork.deliver(1);
        assert!(!fork.body.touched, "{}", fork.story());
        kills += 1;
    }
    assert!(kills > 200, "only {kills}");
}

#[test]
fn a_navigator_killed_while_it_turns_back_turns_back_all_the_same() {
    // Near enough to the node to back up, and too far, so that it turns round.
    for far in [60.0, 150.0, 190.0] {
        killed_on_the_way_back(far);
    }
}

fn killed_on_the_way_back(far: f64) {
    let mut trial = trial((1, 1), (0, 0), 100, (0, 0, Heading::Up));
    trial.order(1, 1);
    assert!(trial.run_until(SECOND * 60, |trial| trial.body.y > far
        || trial.body.x > far));
    let edge = match trial.body.y > far {
        true => ((0, 0), (0, 1)),
        false => ((0, 0), (1, 0)),
    };
    put(&mut trial, edge);
    turns_back_however_it_is_killed(trial);
}

#[test]
fn a_navigator_killed_while_it_backs_up_from_a_node_to_turn_round_does_so_all_the_same() {
    for side_cm in [50, 60] {
        let mut trial = example(side_cm);
        // 120 mm behind the node.
        let at = f64::from(side_cm) * 10.0 + 120.0;
        trial.body.obstacles.push(((at, -80.0), (at + 80.0, 80.0)));
        trial.order(1, 1);
        turns_back_however_it_is_killed(trial);
    }
}

/// Kills the navigator again and again, from the halt until the robot has turned round.
fn turns_back_however_it_is_killed(mut trial: Trial) {
    assert!(trial.run_until(SECOND * 60, |trial| trial.phase() == Phase::Halted));
    let outages = [20, 90, 130, 250, 700].map(Duration::from_millis);
    let mut kills = 0;
    let leaves = |trial: &Trial| matches!(trial.phase(), Phase::Halted | Phase::TurningBack);
    while leaves(&trial) {
        trial.run_for(Duration::from_millis(95));
        let mut fork = trial.clone();
        fork.kill(outages[kills % outages.len()]);
        fork.thoughts
            .push(format!("(killed at {:?})", trial.body.now));
        fork.deliver(1);
        assert!(!fork.body.touched, "{}", fork.story());
        kills += 1;
    }
    assert!(kills > 15, "only {kills}");
}

/// The number of edges and quarter turns of the best way to the nearest of `goals`: relaxes every
/// move until nothing changes.
fn best(
    map: &Map,
    ways: &BlockedWays,
    from: (Node, Heading),
    goals: [Node; 2],
) -> Option<(u16, u16)> {
    let is_open = |node: Node, heading: Heading| {
        let there = map.grid.neighbour(node, heading)?;
        let closed = ways.ways().iter().any(|way| {
            let (at, along) = (Node::new(way.x, way.y), way.heading.get().unwrap());
            (at, along) == (node, heading) || (at, along) == (there, heading.back())
        });
        (!closed).then_some(there)
    };
    let pose = |node: Node, heading: Heading| map.grid.index(node) * 4 + heading as usize;
    let mut costs = vec![None; map.grid.node_count() * 4];
    costs[pose(from.0, from.1)] = Some((0, 0));
    let mut changed = true;
    while std::mem::take(&mut changed) {
        for place in 0..costs.len() {
            let Some((edges, turns)) = costs[place] else {
                continue;
            };
            for heading in Heading::ALL {
                let Some(there) = is_open(map.grid.node(place / 4), heading) else {
                    continue;
                };
                let quarters =
                    [0, 1, 2, 1][usize::from(Heading::ALL[place % 4].quarters_right_to(heading))];
                let cost = (edges + 1, turns + quarters);
                let known = &mut costs[pose(there, heading)];
                if known.is_none_or(|known| cost < known) {
                    *known = Some(cost);
                    changed = true;
                }
            }
        }
    }
    let arrivals = goals
        .into_iter()
        .flat_map(|goal| Heading::ALL.map(|heading| pose(goal, heading)));
    arrivals.filter_map(|place| costs[place]).min()
}

/// The number of edges and quarter turns of the published route from the robot's place.
fn planned(trial: &Trial) -> (u16, u16) {
    let status = trial.navigator.status();
    let mut at = Node::new(status.x as u8, status.y as u8);
    let mut heading = status.heading.get().unwrap();
    let mut turns = 0;
    for step in trial.navigator.route().nodes() {
        let to = Node::new(step.x, step.y);
        let next = Heading::ALL
            .into_iter()
            .find(|next| next.step_from(at) == Some(to))
            .unwrap();
        turns += [0, 1, 2, 1][usize::from(heading.quarters_right_to(next))];
        (at, heading) = (to, next);
    }
    (trial.navigator.route().length, turns)
}

/// The nodes from which the robot reaches the goods, or the delivery.
fn goals(trial: &Trial) -> [Node; 2] {
    let status = trial.navigator.status();
    let map = trial.map();
    match status.goal.get().unwrap() {
        lager_topics::Goal::Product => map.station(status.product).unwrap().edge.ends(),
        _ => [map.grid.delivery(); 2],
    }
}

proptest! {
    #![proptest_config(missions(40))]

    #[test]
    fn every_way_taken_is_the_best_that_is_known_and_nothing_is_touched(
        (width, height) in (1u8..5, 1u8..5),
        corner in 0usize..4,
        square in (0u8..5, 0u8..5),
        side in 0usize..4,
        side_cm in 48u16..110,
        edges in prop::collection::vec((0u8..5, 0u8..5, any::<bool>()), 0..7),
    ) {
        let product = (square.0 % width, square.1 % height, SIDES[side]);
        let delivery = corners((width, height))[corner];
        let mut trial = trial((width, height), delivery, side_cm, product);
        let map = trial.map();
        for (x, y, up) in edges {
            let from = Node::new(x % (width + 1), y % (height + 1));
            let heading = if up { Heading::Up } else { Heading::Right };
            if let Some(to) = map.grid.neighbour(from, heading) {
                put(&mut trial, ((from.x, from.y), (to.x, to.y)));
            }
        }
        trial.order(1, 1);
        let unreachable = |trial: &Trial| failure(trial).0 == Some(FailureKind::Unreachable);
        let mut decided = None;
        while trial.status.delivered == 0 && !unreachable(&trial) {
            trial.step();
            prop_assert!(trial.body.now < SECOND * 1_500, "{}", trial.story());
            let status = trial.navigator.status();
            // At a node, before it drives: with the known blocks no plan is better.
            let decision = (status.x, status.y, status.heading, trial.navigator.blocks());
            let decides = matches!(status.phase.get(), Some(Phase::Looking | Phase::Turning));
            if decides && decided != Some(decision) {
                decided = Some(decision);
                let from = (Node::new(status.x as u8, status.y as u8), status.heading.get().unwrap());
                let oracle = best(&map, &trial.navigator.blocks(), from, goals(&trial));
                let at_goal = goals(&trial).contains(&from.0);
                prop_assert!(
                    at_goal || oracle == Some(planned(&trial)),
                    "{:?} {:?} {}", oracle, planned(&trial), trial.story()
                );
            }
        }
        prop_assert!(!trial.body.touched, "{}", trial.story());
        if unreachable(&trial) {
            // Then the robot has seen everything that stands in the way.
            let status = trial.navigator.status();
            let from = (Node::new(status.x as u8, status.y as u8), status.heading.get().unwrap());
            let ways = trial.navigator.blocks();
            let reached = best(&map, &ways, from, goals(&trial));
            prop_assert!(reached.is_none() || goals(&trial).iter().all(|goal| {
                map.station(status.product).is_some_and(|station| {
                    station.edge.heading_from(*goal).is_some()
                })
            }), "{}", trial.story());
        }
    }
}
