//! The things on the edges: those of the warehouse's file, those that people put and take, and
//! random ones. A random thing stands in the middle of an edge for a while, then nowhere for a
//! while. No thing appears where the robot is.
//!
//! This module only changes the list of things in the hall. Other modules decide whether the ranger
//! sees a thing and whether the robot runs into it.

use lager_floor::{Edge, Heading, Node};
use serde::{Deserialize, Serialize};

use crate::body::Pose;
use crate::noise::Noise;
use crate::room;
use crate::scene::{self, Block};
use crate::warehouse::Warehouse;

/// Number of the first noise stream; each thing has one.
const STREAM: u64 = 1_000;
/// A thing cannot be put nearer to the robot's axle than this, in mm, measured to the thing's
/// middle: the robot must be able to turn round in front of it.
const APART: f64 = 320.0;
/// A random thing stands for the first number of seconds and for up to the second one longer.
const STANDS: [u64; 2] = [30, 60];
/// It is away for the first number of seconds and for up to the second one longer.
const AWAY: [u64; 2] = [5, 25];
/// If no place was found, the next search comes after this time, in ns.
const RETRY_NS: u64 = 500_000_000;

/// The most things that may stand in a warehouse at once.
pub const MOST_OBSTACLES: usize = 64;

/// A thing that stands on an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Standing {
    /// The edge.
    pub edge: Edge,
    /// Whether it is a random thing, which goes away by itself.
    pub by_chance: bool,
}

/// Why nothing was put or taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum HandsOff {
    /// The warehouse has no such edge.
    NoEdge,
    /// The ways are too short.
    NoRoom,
    /// The robot is there.
    RobotThere,
    /// Nothing stands there.
    NothingThere,
    /// Too many things stand already.
    Full,
}

/// All things on edges.
#[derive(Clone, Debug)]
pub(crate) struct Obstacles {
    side_cm: u16,
    places: Vec<(Edge, Block)>,
    standing: Vec<Standing>,
    things: Vec<Thing>,
    changes: u64,
}

/// A random thing.
#[derive(Clone, Debug)]
struct Thing {
    noise: Noise,
    on: Option<Edge>,
    until_ns: u64,
}

impl Thing {
    fn seconds(&mut self, [least, more]: [u64; 2]) -> u64 {
        (least * 1_000 + self.noise.bits() % (more * 1_000)) * 1_000_000
    }
}

impl Obstacles {
    /// The things of the warehouse's file. The scene puts the blocks for the ranger.
    pub(crate) fn new(warehouse: &Warehouse) -> Self {
        let side = scene::side_mm(warehouse);
        let edge = |[a, b]: [Node; 2]| Edge::between(a, b);
        let written = warehouse.obstacles.iter();
        Self {
            side_cm: warehouse.side_length_cm,
            places: edges(warehouse.size)
                .map(|edge| (edge, scene::obstacle(edge, side)))
                .collect(),
            standing: written
                .filter_map(|stands| edge(stands.between))
                .map(|edge| Standing {
                    edge,
                    by_chance: false,
                })
                .collect(),
            things: Vec::new(),
            changes: 0,
        }
    }

    /// From now on `count` random things come and go; at first all are away.
    pub(crate) fn scatter(&mut self, count: u32, seed: u64) {
        let thing = |number| Thing {
            noise: Noise::new(seed, STREAM + u64::from(number)),
            on: None,
            until_ns: 0,
        };
        self.things = (0..count).map(thing).collect();
    }

    /// The length of an edge in cm.
    pub(crate) const fn side_cm(&self) -> u16 {
        self.side_cm
    }

    /// The things that stand now.
    pub(crate) fn standing(&self) -> &[Standing] {
        &self.standing
    }

    /// Counts the things that were put and taken, by people or by chance.
    pub(crate) const fn changes(&self) -> u64 {
        self.changes
    }

    /// Puts a thing on an edge; a thing that stands there already stays.
    pub(crate) fn put(
        &mut self,
        edge: Edge,
        pose: &Pose,
        blocks: &mut Vec<Block>,
    ) -> Result<(), HandsOff> {
        let block = self.block(edge).ok_or(HandsOff::NoEdge)?;
        if self.standing.iter().any(|stands| stands.edge == edge) {
            return Ok(());
        }
        if self.side_cm < room::LEAST_SIDE_WITH_THINGS_CM {
            return Err(HandsOff::NoRoom);
        }
        if distance(pose, &block) < APART {
            return Err(HandsOff::RobotThere);
        }
        if self.standing.len() >= MOST_OBSTACLES {
            return Err(HandsOff::Full);
        }
        self.stand(edge, false, block, blocks);
        Ok(())
    }

    /// Takes the thing on an edge away.
    pub(crate) fn take(&mut self, edge: Edge, blocks: &mut Vec<Block>) -> Result<(), HandsOff> {
        let block = self.block(edge).ok_or(HandsOff::NoEdge)?;
        if !self.standing.iter().any(|stands| stands.edge == edge) {
            return Err(HandsOff::NothingThere);
        }
        self.go(edge, block, blocks);
        for thing in &mut self.things {
            thing.on = thing.on.filter(|on| *on != edge);
        }
        Ok(())
    }

    /// Replaces all things by `kept`. A random thing goes away again after its time, as long as the
    /// number of random things allows it.
    pub(crate) fn restore(&mut self, kept: &[Standing], now_ns: u64, blocks: &mut Vec<Block>) {
        for Standing { edge, .. } in self.standing.clone() {
            if let Some(block) = self.block(edge) {
                self.go(edge, block, blocks);
            }
        }
        for thing in &mut self.things {
            thing.on = None;
        }
        let mut dealt = 0;
        for Standing { edge, by_chance } in kept {
            let Some(block) = self.block(*edge) else {
                continue;
            };
            let mut thing = self.things.get_mut(dealt).filter(|_| *by_chance);
            if let Some(thing) = &mut thing {
                thing.on = Some(*edge);
                thing.until_ns = now_ns + thing.seconds(STANDS);
                dealt += 1;
            }
            let goes_again = thing.is_some();
            self.stand(*edge, goes_again, block, blocks);
        }
    }

    /// Puts and takes the random things that are due, in `blocks` too.
    pub(crate) fn step(&mut self, now_ns: u64, pose: &Pose, blocks: &mut Vec<Block>) {
        for index in 0..self.things.len() {
            let thing = &mut self.things[index];
            if now_ns < thing.until_ns {
                continue;
            }
            if let Some(edge) = thing.on.take() {
                thing.until_ns = now_ns + thing.seconds(AWAY);
                if let Some(block) = self.block(edge) {
                    self.go(edge, block, blocks);
                }
                continue;
            }
            let (edge, place) = self.places[thing.noise.bits() as usize % self.places.len()];
            let full = self.standing.len() >= MOST_OBSTACLES;
            if full || blocks.contains(&place) || distance(pose, &place) < APART {
                thing.until_ns = now_ns + RETRY_NS;
                continue;
            }
            thing.on = Some(edge);
            thing.until_ns = now_ns + thing.seconds(STANDS);
            self.stand(edge, true, place, blocks);
        }
    }

    fn stand(&mut self, edge: Edge, by_chance: bool, block: Block, blocks: &mut Vec<Block>) {
        self.standing.push(Standing { edge, by_chance });
        blocks.push(block);
        self.changes += 1;
    }

    fn go(&mut self, edge: Edge, block: Block, blocks: &mut Vec<Block>) {
        self.standing.retain(|stands| stands.edge != edge);
        blocks.retain(|one| *one != block);
        self.changes += 1;
    }

    fn block(&self, edge: Edge) -> Option<Block> {
        let mut places = self.places.iter();
        places.find(|(of, _)| *of == edge).map(|(_, block)| *block)
    }
}

/// All edges between the nodes of `size` squares.
fn edges(size: Node) -> impl Iterator<Item = Edge> {
    let inside = move |node: Node| node.x <= size.x && node.y <= size.y;
    let nodes = (0..=size.x).flat_map(move |x| (0..=size.y).map(move |y| Node::new(x, y)));
    nodes
        .flat_map(|node| [Heading::Right, Heading::Up].map(|way| Edge::leaving(node, way)))
        .flatten()
        .filter(move |edge| inside(edge.to))
}

/// Distance from the robot's axle to the middle of a block.
fn distance(pose: &Pose, block: &Block) -> f64 {
    let middle = |axis: usize| f64::midpoint(block.low[axis], block.high[axis]);
    (middle(0) - pose.x).hypot(middle(1) - pose.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs for `seconds` with a robot at `pose`. Returns the things at each tenth of a second.
    fn run(seed: u64, pose: &Pose, seconds: u64) -> Vec<Vec<Block>> {
        let warehouse = Warehouse::builtin("small").expect("built in");
        let mut obstacles = Obstacles::new(&warehouse);
        obstacles.scatter(3, seed);
        let mut blocks = Vec::new();
        (0..seconds * 10)
            .map(|tick| {
                obstacles.step(tick * 100_000_000, pose, &mut blocks);
                blocks.clone()
            })
            .collect()
    }

    #[test]
    fn things_come_and_go_and_a_seed_repeats() {
        let pose = Pose::default();
        let stood = run(1, &pose, 300);
        assert_eq!(stood, run(1, &pose, 300));
        assert_ne!(stood, run(2, &pose, 300));
        let counts: Vec<usize> = stood.iter().map(Vec::len).collect();
        assert!(counts.contains(&3) && counts.iter().any(|count| *count < 3));
        let changes = stood.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(changes > 12, "{changes}");
    }

    #[test]
    fn nobody_puts_a_thing_where_the_robot_is() {
        let pose = Pose {
            x: 250.0,
            y: 0.0,
            heading: 0.0,
        };
        for block in run(3, &pose, 2_000).into_iter().flatten() {
            assert!(distance(&pose, &block) >= APART, "{block:?}");
        }
    }

    #[test]
    fn every_edge_is_a_place() {
        assert_eq!(edges(Node::new(3, 2)).count(), 3 * 3 + 2 * 4);
    }

    fn first_two() -> [Edge; 2] {
        [0, 1].map(|x| Edge::of(Node::new(x, 0), Heading::Down))
    }

    #[test]
    fn hands_put_and_take_but_not_where_the_robot_is() {
        let warehouse = Warehouse::builtin("small").expect("built in");
        let mut obstacles = Obstacles::new(&warehouse);
        let mut blocks = scene::blocks(&warehouse);
        let before = blocks.clone();
        let [near, far] = first_two();
        let pose = Pose::default();
        assert_eq!(
            obstacles.put(near, &pose, &mut blocks),
            Err(HandsOff::RobotThere)
        );
        assert_eq!(obstacles.put(far, &pose, &mut blocks), Ok(()));
        assert_eq!(obstacles.put(far, &pose, &mut blocks), Ok(()), "it stays");
        assert_eq!(obstacles.standing().len(), 1);
        assert_eq!(blocks.len(), before.len() + 1);
        assert_eq!(obstacles.take(far, &mut blocks), Ok(()));
        assert_eq!(blocks, before);
        assert_eq!(
            obstacles.take(far, &mut blocks),
            Err(HandsOff::NothingThere)
        );
        let outside = Edge {
            from: Node::new(9, 0),
            to: Node::new(10, 0),
        };
        assert_eq!(
            obstacles.put(outside, &pose, &mut blocks),
            Err(HandsOff::NoEdge)
        );
        assert_eq!(obstacles.changes(), 2);
    }

    #[test]
    fn nothing_is_put_on_ways_so_short_that_a_robot_could_not_turn_beside_it() {
        let short = Warehouse {
            side_length_cm: 49,
            ..Warehouse::builtin("small").expect("built in")
        };
        let mut obstacles = Obstacles::new(&short);
        let [_, far] = first_two();
        assert_eq!(
            obstacles.put(far, &Pose::default(), &mut Vec::new()),
            Err(HandsOff::NoRoom)
        );
    }

    #[test]
    fn what_stood_stands_again_and_chance_takes_its_own_away() {
        let warehouse = Warehouse::builtin("small").expect("built in");
        let far_away = Pose {
            x: -5_000.0,
            ..Pose::default()
        };
        let [first, second] = first_two();
        let mut obstacles = Obstacles::new(&warehouse);
        obstacles.scatter(1, 1);
        let mut blocks = Vec::new();
        let kept = [
            Standing {
                edge: first,
                by_chance: false,
            },
            Standing {
                edge: second,
                by_chance: true,
            },
        ];
        obstacles.restore(&kept, 0, &mut blocks);
        assert_eq!(obstacles.standing(), kept);
        assert_eq!(blocks.len(), 2);
        let mut met = false;
        for tick in 0..2_000 {
            obstacles.step(tick * 100_000_000, &far_away, &mut blocks);
            met |= !obstacles.standing().contains(&kept[1]);
            assert!(obstacles.standing().contains(&kept[0]));
        }
        assert!(met, "what came by chance has gone");
    }
}
