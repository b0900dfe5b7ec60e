//! Shortest ways over open edges: the breadth-first search of L5.
//!
//! The search runs from the goals and gives every node's distance to the nearest goal. So one
//! search answers both questions of the navigator: which of two nodes is nearer, and where to go
//! from here. The result is kept until the goals, the map or the blocks change, so the robot does
//! not search again on its way. Among equally short ways it takes the one with the fewest quarter
//! turns, because each costs three seconds; and among those the one that goes straight on first.
//! Only the tables are allocated, at start-up.
//!
//! The search queues the nodes by their distance, so a second pass in that order already knows the
//! turns of every nearer node. A robot that leaves `n` along `h` towards `m` has as many turns to
//! come as the best way from `m` after arriving there along `h`.

use lager_floor::{Heading, MAX_NODES, Node, Spin};
use lager_topics::{Route, RouteNode};

use crate::blocks::Blocks;
use crate::map::Map;

/// Distance of a node from which no goal can be reached.
const UNREACHABLE: u16 = u16::MAX;

/// How many edges each node is away from the nearest of some goals.
#[derive(Clone, Debug)]
pub struct Distances {
    edges: [u16; MAX_NODES],
    queue: [Node; MAX_NODES],
    /// For each node and heading: how many quarter turns are to come on a shortest way that begins
    /// along this heading; [`UNREACHABLE`] if none begins so.
    turns: [[u16; 4]; MAX_NODES],
    /// What was searched last: the goals, and the revision of the blocks.
    searched: Option<([Node; 2], u32)>,
}

impl Default for Distances {
    fn default() -> Self {
        Self {
            edges: [UNREACHABLE; MAX_NODES],
            queue: [Node::default(); MAX_NODES],
            turns: [[UNREACHABLE; 4]; MAX_NODES],
            searched: None,
        }
    }
}

impl Distances {
    /// Forgets the last search, because the floor has changed.
    pub fn forget(&mut self) {
        self.searched = None;
    }

    /// Searches from the `goals`, which must be in the map, over all open ways.
    pub fn search(&mut self, map: &Map, blocks: &Blocks, goals: [Node; 2]) {
        let searched = Some((goals, blocks.revision()));
        if self.searched == searched {
            return;
        }
        self.searched = searched;
        self.edges.fill(UNREACHABLE);
        let (mut queued, mut next) = (0, 0);
        for goal in goals {
            if self.edges[map.grid.index(goal)] != 0 {
                self.edges[map.grid.index(goal)] = 0;
                self.queue[queued] = goal;
                queued += 1;
            }
        }
        while next < queued {
            let node = self.queue[next];
            next += 1;
            for heading in Heading::ALL {
                // A way is open at both ends or at none, so searching backwards is the same.
                let Some(neighbour) = map
                    .grid
                    .neighbour(node, heading)
                    .filter(|_| blocks.is_open(map, node, heading))
                else {
                    continue;
                };
                let place = map.grid.index(neighbour);
                if self.edges[place] == UNREACHABLE {
                    self.edges[place] = self.edges[map.grid.index(node)] + 1;
                    self.queue[queued] = neighbour;
                    queued += 1;
                }
            }
        }
        for index in 0..queued {
            let node = self.queue[index];
            self.turns[map.grid.index(node)] =
                Heading::ALL.map(|heading| self.turns_after(map, blocks, node, heading));
        }
    }

    /// The turns to come after leaving `node` along `heading`, once those of all nearer nodes are
    /// known.
    fn turns_after(&self, map: &Map, blocks: &Blocks, node: Node, heading: Heading) -> u16 {
        let next = map
            .grid
            .neighbour(node, heading)
            .filter(|_| blocks.is_open(map, node, heading))
            .map(|next| map.grid.index(next));
        match next {
            Some(next) if self.edges[next] + 1 == self.edges[map.grid.index(node)] => {
                match self.edges[next] {
                    0 => 0,
                    _ => self
                        .fewest(next, heading)
                        .map_or(UNREACHABLE, |(turns, _)| turns),
                }
            }
            _ => UNREACHABLE,
        }
    }

    /// The fewest turns to come at a node for a robot that looks along `facing`, and its next
    /// heading.
    fn fewest(&self, place: usize, facing: Heading) -> Option<(u16, Heading)> {
        [(0, 0), (1, 1), (3, 1), (2, 2)]
            .into_iter()
            .filter_map(|(quarters, turns)| {
                let heading = facing.turned(Spin::Right, quarters);
                let after = self.turns[place][heading as usize];
                (after != UNREACHABLE).then(|| (turns + after, heading))
            })
            .min_by_key(|(turns, _)| *turns)
    }

    /// Edges from `node` to the nearest goal, `None` if there is no way.
    pub fn from(&self, map: &Map, node: Node) -> Option<u16> {
        Some(self.edges[map.grid.index(node)]).filter(|edges| *edges != UNREACHABLE)
    }

    /// The next heading from `node` for a robot that looks along `facing`: on a shortest way, and
    /// among those on one with the fewest turns. `None` at a goal and if there is no way.
    pub fn next(&self, map: &Map, node: Node, facing: Heading) -> Option<Heading> {
        self.from(map, node).filter(|edges| *edges > 0)?;
        let (_, heading) = self.fewest(map.grid.index(node), facing)?;
        Some(heading)
    }

    /// Writes the nodes from `from` to the nearest goal into `route`, the next one first: as many
    /// as there is room for, and how many there are.
    pub fn write_route(&self, map: &Map, from: Node, facing: Heading, route: &mut Route) {
        *route = Route::default();
        let (mut node, mut heading) = (from, facing);
        while let Some(next) = self.next(map, node, heading) {
            let Some(neighbour) = map.grid.neighbour(node, next) else {
                return;
            };
            (node, heading) = (neighbour, next);
            if let Some(place) = route.nodes.get_mut(usize::from(route.length)) {
                *place = RouteNode {
                    x: node.x,
                    y: node.y,
                };
            }
            route.length += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use lager_topics::BlockSource;
    use proptest::prelude::*;

    use super::*;
    use crate::blocks::Block;

    fn blocked(map: &Map, ways: Vec<(u8, u8, usize)>) -> Blocks {
        let mut blocks = Blocks::default();
        for (x, y, heading) in ways {
            let block = Block {
                node: Node::new(x, y),
                heading: Heading::ALL[heading],
                since: Duration::ZERO,
                source: BlockSource::Sensor,
            };
            blocks.block(map, block);
        }
        blocks
    }

    /// All distances by relaxing every edge until nothing changes (Floyd and Warshall): slow,
    /// and nothing like a breadth-first search. From `a` to `b` at `a * nodes + b`.
    fn oracle(map: &Map, blocks: &Blocks) -> Vec<Option<u16>> {
        let count = map.grid.node_count();
        let mut edges = vec![None; count * count];
        for from in 0..count {
            edges[from * count + from] = Some(0);
            for heading in Heading::ALL {
                if blocks.is_open(map, map.grid.node(from), heading) {
                    let to = map
                        .grid
                        .index(map.grid.neighbour(map.grid.node(from), heading).unwrap());
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

    fn quarters(from: Heading, to: Heading) -> u16 {
        [0, 1, 2, 1][usize::from(from.quarters_right_to(to))]
    }

    /// Edges and quarter turns of the best way, by relaxing every move of every pose until nothing
    /// changes (Bellman and Ford).
    fn cheapest(
        map: &Map,
        blocks: &Blocks,
        start: (Node, Heading),
        goal: Node,
    ) -> Option<(u16, u16)> {
        let pose = |node: Node, heading: Heading| map.grid.index(node) * 4 + heading as usize;
        let mut costs = vec![None; map.grid.node_count() * 4];
        costs[pose(start.0, start.1)] = Some((0, 0));
        let mut changed = true;
        while core::mem::take(&mut changed) {
            for place in 0..costs.len() {
                let Some((edges, turns)) = costs[place] else {
                    continue;
                };
                let node = map.grid.node(place / 4);
                for heading in Heading::ALL
                    .into_iter()
                    .filter(|to| blocks.is_open(map, node, *to))
                {
                    let there = pose(map.grid.neighbour(node, heading).unwrap(), heading);
                    let cost = (
                        edges + 1,
                        turns + quarters(Heading::ALL[place % 4], heading),
                    );
                    if costs[there].is_none_or(|known| cost < known) {
                        costs[there] = Some(cost);
                        changed = true;
                    }
                }
            }
        }
        Heading::ALL
            .into_iter()
            .filter_map(|heading| costs[pose(goal, heading)])
            .min()
    }

    proptest! {
        #[test]
        fn distances_and_routes_are_shortest_around_any_obstacles(
            (width, height) in (1u8..6, 1u8..6),
            ways in prop::collection::vec((0u8..6, 0u8..6, 0usize..4), 0..30),
            facing in 0usize..4,
        ) {
            let map = Map::grid(width, height);
            let blocks = blocked(&map, ways);
            let count = map.grid.node_count();
            let truth = oracle(&map, &blocks);
            let mut distances = Box::<Distances>::default();
            for goal in 0..count {
                distances.search(&map, &blocks, [map.grid.node(goal); 2]);
                for from in 0..count {
                    let node = map.grid.node(from);
                    let shortest = truth[from * count + goal];
                    prop_assert_eq!(distances.from(&map, node), shortest);
                    let mut route = Route::default();
                    distances.write_route(&map, node, Heading::ALL[facing], &mut route);
                    prop_assert_eq!(route.length, shortest.unwrap_or(0));
                    let mut at = node;
                    for step in route.nodes() {
                        let to = Node::new(step.x, step.y);
                        let open = Heading::ALL.into_iter().any(|heading| {
                            blocks.is_open(&map, at, heading) && map.grid.neighbour(at, heading) == Some(to)
                        });
                        prop_assert!(open, "{} to {} is no open way", at, to);
                        at = to;
                    }
                    if shortest.is_some() {
                        prop_assert_eq!(at, map.grid.node(goal));
                    }
                }
            }
        }

        #[test]
        fn among_the_shortest_ways_the_one_with_the_fewest_turns_is_taken(
            (width, height) in (1u8..5, 1u8..5),
            ways in prop::collection::vec((0u8..5, 0u8..5, 0usize..4), 0..20),
            picks in (0usize..25, 0usize..25, 0usize..4),
        ) {
            let map = Map::grid(width, height);
            let blocks = blocked(&map, ways);
            let (from, goal) = (picks.0 % map.grid.node_count(), picks.1 % map.grid.node_count());
            let facing = Heading::ALL[picks.2];
            let mut distances = Box::<Distances>::default();
            distances.search(&map, &blocks, [map.grid.node(goal); 2]);
            let mut route = Route::default();
            distances.write_route(&map, map.grid.node(from), facing, &mut route);
            let (mut at, mut heading, mut turns) = (map.grid.node(from), facing, 0);
            for step in route.nodes() {
                let to = Node::new(step.x, step.y);
                let next = Heading::ALL.into_iter().find(|next| next.step_from(at) == Some(to));
                turns += quarters(heading, next.unwrap());
                (at, heading) = (to, next.unwrap());
            }
            let best = cheapest(&map, &blocks, (map.grid.node(from), facing), map.grid.node(goal));
            let way = distances.from(&map, map.grid.node(from)).map(|edges| (edges, turns));
            prop_assert_eq!(way, best);
        }

        #[test]
        fn the_nearer_end_is_nearer(
            (width, height) in (1u8..6, 1u8..6),
            ways in prop::collection::vec((0u8..6, 0u8..6, 0usize..4), 0..30),
            picks in (0usize..36, 0usize..36, 0usize..36),
        ) {
            let map = Map::grid(width, height);
            let blocks = blocked(&map, ways);
            let count = map.grid.node_count();
            let (from, first, second) = (picks.0 % count, picks.1 % count, picks.2 % count);
            let ends = [map.grid.node(first), map.grid.node(second)];
            let truth = oracle(&map, &blocks);
            let best = [first, second].into_iter().filter_map(|end| truth[from * count + end]).min();
            let mut distances = Box::<Distances>::default();
            distances.search(&map, &blocks, ends);
            prop_assert_eq!(distances.from(&map, map.grid.node(from)), best);
        }
    }

    #[test]
    fn straight_on_is_preferred_among_equals() {
        let map = Map::grid(3, 3);
        let blocks = Blocks::default();
        let mut distances = Box::<Distances>::default();
        distances.search(&map, &blocks, [Node::new(3, 3); 2]);
        let from = Node::new(0, 0);
        assert_eq!(distances.next(&map, from, Heading::Up), Some(Heading::Up));
        assert_eq!(
            distances.next(&map, from, Heading::Right),
            Some(Heading::Right)
        );
        let mut route = Route::default();
        distances.write_route(&map, from, Heading::Up, &mut route);
        let nodes: Vec<_> = route.nodes().iter().map(|node| (node.x, node.y)).collect();
        assert_eq!(nodes, [(0, 1), (0, 2), (0, 3), (1, 3), (2, 3), (3, 3)]);
    }

    #[test]
    fn at_the_goal_there_is_nowhere_to_go() {
        let map = Map::grid(1, 1);
        let blocks = Blocks::default();
        let mut distances = Box::<Distances>::default();
        distances.search(&map, &blocks, [Node::new(1, 0); 2]);
        let next = distances.next(&map, Node::new(1, 0), Heading::Left);
        assert_eq!(next, None);
    }

    #[test]
    fn the_largest_floor_is_crossed() {
        let map = Map::grid(99, 99);
        let blocks = Blocks::default();
        let mut distances = Box::<Distances>::default();
        distances.search(&map, &blocks, [Node::new(99, 99); 2]);
        let mut route = Route::default();
        distances.write_route(&map, Node::new(0, 0), Heading::Up, &mut route);
        assert_eq!(route.length, 198);
        assert_eq!(route.nodes().len(), 198);
    }

    #[test]
    fn a_search_is_made_anew_when_a_way_is_blocked() {
        let map = Map::grid(1, 1);
        let mut blocks = Blocks::default();
        let mut distances = Box::<Distances>::default();
        let (from, goal) = (Node::new(0, 0), Node::new(1, 0));
        distances.search(&map, &blocks, [goal; 2]);
        assert_eq!(distances.from(&map, from), Some(1));
        blocks = blocked(&map, vec![(0, 0, 2)]);
        distances.search(&map, &blocks, [goal; 2]);
        assert_eq!(distances.from(&map, from), Some(3));
    }
}
