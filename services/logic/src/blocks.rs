//! The ways that are blocked now: which, since when, and who says so. The map never changes
//! ([`crate::map`]) and never has blocks.
//!
//! The navigator tells this file which ways are blocked and asks it which are open. It senses
//! nothing. It forgets a block only when the navigator says so, or when it is full: then it forgets
//! the oldest block that the robot itself has found.

use core::time::Duration;

use lager_floor::{Heading, MAX_NODES, MAX_SQUARES, Node};
use lager_topics::{BlockSource, BlockedWay, BlockedWays};

use crate::map::Map;

/// How many ways can be blocked at once.
pub const MAX_BLOCKS: usize = 64;

/// A blocked way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// A node at one end of the way.
    pub node: Node,
    /// Where the way leads from there.
    pub heading: Heading,
    /// Since when, in robot time.
    pub since: Duration,
    /// Who says so.
    pub source: BlockSource,
}

/// All blocked ways of a floor.
#[derive(Clone, Debug)]
pub struct Blocks {
    list: heapless::Vec<Block, MAX_BLOCKS>,
    /// For each node the blocked headings, a bit each; both ends of a way have theirs.
    closed: [u8; MAX_NODES],
    /// Counts changes, so that others can see whether their results are out of date.
    revision: u32,
}

impl Default for Blocks {
    fn default() -> Self {
        Self {
            list: heapless::Vec::new(),
            closed: [0; MAX_NODES],
            revision: 0,
        }
    }
}

impl Blocks {
    /// Whether the way from `node` along `heading` to the next node is open.
    pub fn is_open(&self, map: &Map, node: Node, heading: Heading) -> bool {
        map.grid.contains(node)
            && self.closed[place(node)] & bit(heading) == 0
            && map.grid.neighbour(node, heading).is_some()
    }

    /// Blocks the way from `node` along `heading` at both of its ends (addObstacle of L4, and
    /// AMB-47). Returns whether it was open. A way that was already blocked keeps its time.
    pub fn block(&mut self, map: &Map, block: Block) -> bool {
        if !self.is_open(map, block.node, block.heading) {
            return false;
        }
        if self.list.is_full() {
            // Forget a person's block only if there is no other.
            let sensed = |block: &Block| block.source == BlockSource::Sensor;
            let oldest = self.list.iter().position(sensed).unwrap_or(0);
            let oldest = self.list.remove(oldest);
            self.mark(&oldest, false);
        }
        self.mark(&block, true);
        // There is a place now.
        let _ = self.list.push(block);
        true
    }

    /// Opens a way again. Returns whether it was blocked.
    pub fn open(&mut self, node: Node, heading: Heading) -> bool {
        let Some(index) = self.list.iter().position(|block| {
            let far = block.heading.step_from(block.node);
            (block.node, block.heading) == (node, heading)
                || (far, block.heading.back()) == (Some(node), heading)
        }) else {
            return false;
        };
        let block = self.list.remove(index);
        self.mark(&block, false);
        true
    }

    /// Opens every way that the robot itself has found blocked, up to `until`. Returns whether
    /// there was one.
    pub fn open_sensed(&mut self, until: Duration) -> bool {
        let before = self.list.len();
        while let Some(index) = self
            .list
            .iter()
            .position(|block| block.source == BlockSource::Sensor && block.since <= until)
        {
            let block = self.list.remove(index);
            self.mark(&block, false);
        }
        self.list.len() != before
    }

    /// When the robot itself last found a way blocked that is still blocked.
    pub fn last_sensed(&self) -> Option<Duration> {
        self.list
            .iter()
            .filter(|block| block.source == BlockSource::Sensor)
            .map(|block| block.since)
            .max()
    }

    /// The blocks in their published form, without what only the map and the mission know.
    pub fn to_payload(&self) -> BlockedWays {
        let mut ways = BlockedWays::default();
        for (place, block) in ways.ways.iter_mut().zip(&self.list) {
            *place = BlockedWay {
                since_ns: block.since.as_nanos() as u64,
                x: block.node.x,
                y: block.node.y,
                heading: block.heading.into(),
                source: block.source.into(),
                ..BlockedWay::default()
            };
            ways.count += 1;
        }
        ways
    }

    /// The blocks that an earlier navigator published. Impossible ones are left out.
    pub fn from_payload(ways: &BlockedWays) -> Self {
        let mut blocks = Self::default();
        for way in ways.ways() {
            let node = Node::new(way.x, way.y);
            let (Some(heading), Some(source)) = (way.heading.get(), way.source.get()) else {
                continue;
            };
            let is_inside = |node: Node| node.x.max(node.y) <= MAX_SQUARES;
            if is_inside(node) && heading.step_from(node).is_some_and(is_inside) {
                let block = Block {
                    node,
                    heading,
                    since: Duration::from_nanos(way.since_ns),
                    source,
                };
                blocks.mark(&block, true);
                // The published list has as many places.
                let _ = blocks.list.push(block);
            }
        }
        blocks
    }

    /// Forgets all of them, because the floor is another one.
    pub fn clear(&mut self) {
        while let Some(block) = self.list.pop() {
            self.mark(&block, false);
        }
    }

    /// Whether no way is blocked.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The blocked ways, the oldest first.
    pub fn iter(&self) -> impl Iterator<Item = &Block> {
        self.list.iter()
    }

    /// A number that changes with each change.
    pub(crate) fn revision(&self) -> u32 {
        self.revision
    }

    fn mark(&mut self, block: &Block, closed: bool) {
        let far = block.heading.step_from(block.node);
        let ends = [
            Some((block.node, block.heading)),
            far.map(|node| (node, block.heading.back())),
        ];
        for (node, heading) in ends.into_iter().flatten() {
            let ways = &mut self.closed[place(node)];
            *ways = match closed {
                true => *ways | bit(heading),
                false => *ways & !bit(heading),
            };
        }
        self.revision = self.revision.wrapping_add(1);
    }
}

/// A node's place in the table, whatever the size of the floor.
fn place(node: Node) -> usize {
    usize::from(node.y) * (usize::from(MAX_SQUARES) + 1) + usize::from(node.x)
}

fn bit(heading: Heading) -> u8 {
    1 << heading as u8
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn block(x: u8, y: u8, heading: Heading, seconds: u64) -> Block {
        Block {
            node: Node::new(x, y),
            heading,
            since: Duration::from_secs(seconds),
            source: BlockSource::Person,
        }
    }

    #[test]
    fn a_way_that_is_blocked_twice_keeps_its_time_and_opens_from_either_end() {
        let map = Map::grid(2, 2);
        let mut blocks = Blocks::default();
        assert!(blocks.block(&map, block(0, 0, Heading::Up, 1)));
        assert!(!blocks.block(&map, block(0, 1, Heading::Down, 5)));
        let since: Vec<_> = blocks.iter().map(|block| block.since.as_secs()).collect();
        assert_eq!(since, [1]);
        assert!(blocks.open(Node::new(0, 1), Heading::Down));
        assert!(blocks.is_open(&map, Node::new(0, 0), Heading::Up));
        assert!(!blocks.open(Node::new(0, 1), Heading::Down));
    }

    #[test]
    fn only_what_the_robot_has_seen_itself_is_forgotten_by_time() {
        let map = Map::grid(3, 3);
        let mut blocks = Blocks::default();
        let seen = |x, seconds| Block {
            source: BlockSource::Sensor,
            ..block(x, 0, Heading::Up, seconds)
        };
        for block in [seen(0, 1), seen(1, 5), block(2, 0, Heading::Up, 2)] {
            assert!(blocks.block(&map, block));
        }
        assert_eq!(blocks.last_sensed(), Some(Duration::from_secs(5)));
        assert!(blocks.open_sensed(Duration::from_secs(4)));
        let left =
            |blocks: &Blocks| -> Vec<u8> { blocks.iter().map(|block| block.node.x).collect() };
        assert_eq!(left(&blocks), [1, 2]);
        assert!(!blocks.open_sensed(Duration::from_secs(4)));
        assert!(blocks.open_sensed(Duration::from_secs(5)));
        assert_eq!(left(&blocks), [2]);
        assert!(!blocks.is_open(&map, Node::new(2, 1), Heading::Down));
    }

    #[test]
    fn where_there_is_no_place_left_the_oldest_block_is_forgotten() {
        let map = Map::grid(99, 1);
        let mut blocks = Blocks::default();
        for x in 0..=MAX_BLOCKS as u8 {
            assert!(blocks.block(&map, block(x, 0, Heading::Up, x.into())));
        }
        assert!(blocks.is_open(&map, Node::new(0, 0), Heading::Up));
        assert_eq!(blocks.iter().count(), MAX_BLOCKS);
        assert!(!blocks.is_open(&map, Node::new(1, 1), Heading::Down));
    }

    #[test]
    fn what_a_person_has_closed_is_forgotten_last() {
        let map = Map::grid(99, 1);
        let mut blocks = Blocks::default();
        for x in 0..=MAX_BLOCKS as u8 {
            let source = match x {
                5 => BlockSource::Sensor,
                _ => BlockSource::Person,
            };
            let block = block(x, 0, Heading::Up, x.into());
            assert!(blocks.block(&map, Block { source, ..block }));
        }
        assert!(blocks.is_open(&map, Node::new(5, 0), Heading::Up));
        assert!(!blocks.is_open(&map, Node::new(0, 0), Heading::Up));
        assert_eq!(blocks.iter().count(), MAX_BLOCKS);
    }

    proptest! {
        #[test]
        fn every_open_way_leads_back_whatever_is_blocked(
            (width, height) in (1u8..8, 1u8..8),
            ways in prop::collection::vec((0u8..9, 0u8..9, 0usize..4, any::<bool>()), 0..40),
        ) {
            let map = Map::grid(width, height);
            let mut blocks = Blocks::default();
            for (x, y, heading, open) in ways {
                let (node, heading) = (Node::new(x, y), Heading::ALL[heading]);
                let was_open = blocks.is_open(&map, node, heading);
                if open {
                    let is_way = map.grid.contains(node) && map.grid.neighbour(node, heading).is_some();
                    prop_assert_eq!(blocks.open(node, heading), is_way && !was_open);
                } else {
                    prop_assert_eq!(blocks.block(&map, block(x, y, heading, 0)), was_open);
                    prop_assert!(!blocks.is_open(&map, node, heading));
                }
            }
            for index in 0..map.grid.node_count() {
                let node = map.grid.node(index);
                for heading in Heading::ALL {
                    if blocks.is_open(&map, node, heading) {
                        let next = map.grid.neighbour(node, heading).unwrap();
                        prop_assert!(blocks.is_open(&map, next, heading.back()));
                    }
                }
            }
            let successor = Blocks::from_payload(&blocks.to_payload());
            prop_assert!(successor.iter().eq(blocks.iter()));
            prop_assert_eq!(successor.closed, blocks.closed);
            blocks.clear();
            prop_assert!(blocks.is_open(&map, Node::new(0, 0), Heading::Up));
        }
    }
}
