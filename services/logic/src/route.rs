//! Shortest ways over open edges: the breadth-first search of L5.
//!
//! The search runs from the goal and yields every node's distance to it, so that one search
//! answers both questions the navigator has: which of two nodes is nearer, and where to go from
//! here. Among equally short ways the one that goes straight on longest without turning is
//! preferred, because a turn costs three seconds. Nothing is allocated and nothing is remembered.

use lager_topics::{Heading, Route, RouteNode};

use crate::heading::{Compass, HEADINGS, Spin};
use crate::map::{MAX_NODES, Map, Node};

/// Distance of a node from which the goal cannot be reached.
const UNREACHABLE: u16 = u16::MAX;

/// How many edges each node is away from one goal.
#[derive(Clone, Debug)]
pub struct Distances {
    edges: [u16; MAX_NODES],
}

impl Distances {
    /// Searches from `goal` over all open ways. The goal must be in the map.
    pub fn to(map: &Map, goal: Node) -> Self {
        let mut edges = [UNREACHABLE; MAX_NODES];
        let mut queue = [goal; MAX_NODES];
        let mut queued = 1;
        edges[map.index(goal)] = 0;
        let mut next = 0;
        while next < queued {
            let node = queue[next];
            next += 1;
            for heading in HEADINGS {
                // A way is open at both ends or at none, so searching backwards is the same.
                let Some(neighbour) = map
                    .neighbour(node, heading)
                    .filter(|_| map.is_open(node, heading))
                else {
                    continue;
                };
                let place = map.index(neighbour);
                if edges[place] == UNREACHABLE {
                    edges[place] = edges[map.index(node)] + 1;
                    queue[queued] = neighbour;
                    queued += 1;
                }
            }
        }
        Self { edges }
    }

    /// Edges from `node` to the goal, `None` if there is no way.
    pub fn from(&self, map: &Map, node: Node) -> Option<u16> {
        Some(self.edges[map.index(node)]).filter(|edges| *edges != UNREACHABLE)
    }

    /// Where to go from `node`, facing `facing`: along a shortest way, straight on if that is
    /// one. `None` at the goal and where there is no way.
    pub fn next(&self, map: &Map, node: Node, facing: Heading) -> Option<Heading> {
        let here = self.from(map, node)?;
        [0, 1, 3, 2]
            .map(|quarters| facing.turned(Spin::Right, quarters))
            .into_iter()
            .filter(|heading| map.is_open(node, *heading))
            .find(|heading| {
                map.neighbour(node, *heading)
                    .and_then(|next| self.from(map, next))
                    .is_some_and(|there| there + 1 == here)
            })
    }
}

/// The nearer of the two nodes a station lies between, with the distances to it; `None` if
/// neither can be reached (L5). Of two equally near ones it is the first.
pub fn nearer(map: &Map, from: Node, ends: [Node; 2]) -> Option<(Node, Distances)> {
    ends.map(|end| {
        let distances = Distances::to(map, end);
        distances
            .from(map, from)
            .map(|edges| (edges, end, distances))
    })
    .into_iter()
    .flatten()
    .min_by_key(|(edges, ..)| *edges)
    .map(|(_, end, distances)| (end, distances))
}

/// Writes the nodes from `from` to the goal of `distances` into `route`, the next one first.
pub fn write_route(
    map: &Map,
    distances: &Distances,
    from: Node,
    facing: Heading,
    route: &mut Route,
) {
    *route = Route::default();
    let (mut node, mut heading) = (from, facing);
    while let Some(next) = distances.next(map, node, heading) {
        let Some(neighbour) = map.neighbour(node, next) else {
            return;
        };
        (node, heading) = (neighbour, next);
        route.nodes[usize::from(route.length)] = RouteNode {
            x: node.x,
            y: node.y,
        };
        route.length += 1;
    }
}

#[cfg(test)]
mod tests {
    use lager_topics::WarehouseMap;
    use proptest::prelude::*;

    use super::*;

    fn grid(width: u8, height: u8) -> Map {
        Map::new(&WarehouseMap {
            width,
            height,
            side_length_cm: 50,
            ..WarehouseMap::default()
        })
        .unwrap()
    }

    /// All distances by relaxing every edge until nothing changes (Floyd and Warshall): slow,
    /// and nothing like a breadth-first search. From `a` to `b` at `a * nodes + b`.
    fn oracle(map: &Map) -> Vec<Option<u16>> {
        let count = map.node_count();
        let mut edges = vec![None; count * count];
        for from in 0..count {
            edges[from * count + from] = Some(0);
            for heading in HEADINGS {
                if map.is_open(map.node(from), heading) {
                    let to = map.index(map.neighbour(map.node(from), heading).unwrap());
                    edges[from * count + to] = Some(1);
                }
            }
        }
        for via in 0..count {
            for pair in 0..count * count {
                let (from, to) = (pair / count, pair % count);
                let (first, second) = (edges[from * count + via], edges[via * count + to]);
                if let (Some(first), Some(second)) = (first, second) {
                    let round: u16 = first + second;
                    if edges[pair].is_none_or(|direct| round < direct) {
                        edges[pair] = Some(round);
                    }
                }
            }
        }
        edges
    }

    proptest! {
        #[test]
        fn distances_and_routes_are_shortest_around_any_obstacles(
            (width, height) in (1u8..6, 1u8..6),
            blocks in prop::collection::vec((0u8..6, 0u8..6, 0usize..4), 0..30),
            facing in 0usize..4,
        ) {
            let mut map = grid(width, height);
            for (x, y, heading) in blocks {
                map.block(Node::new(x, y), HEADINGS[heading]);
            }
            let count = map.node_count();
            let truth = oracle(&map);
            for goal in 0..count {
                let distances = Distances::to(&map, map.node(goal));
                for from in 0..count {
                    let node = map.node(from);
                    let shortest = truth[from * count + goal];
                    prop_assert_eq!(distances.from(&map, node), shortest);
                    let mut route = Route::default();
                    write_route(&map, &distances, node, HEADINGS[facing], &mut route);
                    prop_assert_eq!(route.length, shortest.unwrap_or(0));
                    let mut at = node;
                    for step in route.nodes() {
                        let to = Node::new(step.x, step.y);
                        let open = HEADINGS.into_iter().any(|heading| {
                            map.is_open(at, heading) && map.neighbour(at, heading) == Some(to)
                        });
                        prop_assert!(open, "{} to {} is no open way", at, to);
                        at = to;
                    }
                    if shortest.is_some() {
                        prop_assert_eq!(at, map.node(goal));
                    }
                }
            }
        }

        #[test]
        fn the_nearer_end_is_nearer(
            (width, height) in (1u8..6, 1u8..6),
            blocks in prop::collection::vec((0u8..6, 0u8..6, 0usize..4), 0..30),
            picks in (0usize..36, 0usize..36, 0usize..36),
        ) {
            let mut map = grid(width, height);
            for (x, y, heading) in blocks {
                map.block(Node::new(x, y), HEADINGS[heading]);
            }
            let count = map.node_count();
            let (from, first, second) = (picks.0 % count, picks.1 % count, picks.2 % count);
            let ends = [map.node(first), map.node(second)];
            let truth = oracle(&map);
            let best = [first, second].into_iter().filter_map(|end| truth[from * count + end]).min();
            let found = nearer(&map, map.node(from), ends);
            let distance = found.and_then(|(end, _)| truth[from * count + map.index(end)]);
            prop_assert_eq!(distance, best);
        }
    }

    #[test]
    fn straight_on_is_preferred_among_equals() {
        let map = grid(3, 3);
        let distances = Distances::to(&map, Node::new(3, 3));
        let from = Node::new(0, 0);
        assert_eq!(distances.next(&map, from, Heading::Up), Some(Heading::Up));
        assert_eq!(
            distances.next(&map, from, Heading::Right),
            Some(Heading::Right)
        );
        let mut route = Route::default();
        write_route(&map, &distances, from, Heading::Up, &mut route);
        let nodes: Vec<_> = route.nodes().iter().map(|node| (node.x, node.y)).collect();
        assert_eq!(nodes, [(0, 1), (0, 2), (0, 3), (1, 3), (2, 3), (3, 3)]);
    }

    #[test]
    fn at_the_goal_there_is_nowhere_to_go() {
        let map = grid(1, 1);
        let distances = Distances::to(&map, Node::new(1, 0));
        assert_eq!(distances.next(&map, Node::new(1, 0), Heading::Left), None);
    }
}
