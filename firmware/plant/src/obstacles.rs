//! The things on the edges: those of the warehouse's file, those that people put and take, and
//! those that come and go at random. A random thing stands in the middle of an edge for a while,
//! then nowhere for a while. No thing is put where the robot is.
//!
//! It only changes the list of things in the hall. It does not decide who sees a thing or runs into
//! it.

use thiserror::Error;

use crate::body::Pose;
use crate::noise::Noise;
use crate::room;
use crate::scene::{self, Block};
use crate::warehouse::{Edge, Warehouse};

/// The first of the streams of noise, one for each thing.
const STREAM: u64 = 1_000;
/// Nobody puts a thing whose middle would be nearer to the robot's axle than this, in mm: the robot
/// must be able to turn round before it.
const APART: f64 = 320.0;
/// For how long a thing stands, at least, and how much longer at most, in s.
const STANDS: [u64; 2] = [30, 60];
/// For how long it is away.
const AWAY: [u64; 2] = [5, 25];
/// How often a place is looked for where there was none, in ns.
const RETRY_NS: u64 = 500_000_000;

/// So many things may stand in a warehouse at once.
pub const MOST_OBSTACLES: usize = 64;

/// A thing that stands on an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    /// Where.
    pub edge: Edge,
    /// Whether it goes by itself, as those do that come by chance.
    pub by_chance: bool,
}

/// Why hands leave a thing as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum HandsOff {
    /// The warehouse has no such edge.
    #[error("there is no such way in this warehouse")]
    NoEdge,
    /// The ways are too short.
    #[error(
        "the ways are so short that a robot could not turn beside a thing; they must be {} cm or more",
        room::LEAST_SIDE_WITH_THINGS_CM
    )]
    NoRoom,
    /// The robot is there.
    #[error("the robot is there; wait until it has gone on")]
    RobotThere,
    /// Nothing stands there.
    #[error("nothing stands there")]
    NothingThere,
    /// There are too many already.
    #[error(
        "{} things stand in the warehouse, and there is no room for more; take one first",
        MOST_OBSTACLES
    )]
    Full,
}

/// All that stands on edges.
#[derive(Clone, Debug)]
pub(crate) struct Obstacles {
    side_cm: u16,
    places: Vec<(Edge, Block)>,
    standing: Vec<Standing>,
    things: Vec<Thing>,
    changes: u64,
}

/// One that comes and goes.
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
    /// Those of the warehouse's file. What the ranger sees of them is the scene's.
    pub(crate) fn new(warehouse: &Warehouse) -> Self {
        let side = scene::side_mm(warehouse);
        let edge = |[a, b]: [[u8; 2]; 2]| Edge::between(a, b);
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

    /// From now on so many more come and go, all of them away at first.
    pub(crate) fn scatter(&mut self, count: u32, seed: u64) {
        let thing = |number| Thing {
            noise: Noise::new(seed, STREAM + u64::from(number)),
            on: None,
            until_ns: 0,
        };
        self.things = (0..count).map(thing).collect();
    }

    /// The length of a way in cm.
    pub(crate) const fn side_cm(&self) -> u16 {
        self.side_cm
    }

    /// What stands now.
    pub(crate) fn standing(&self) -> &[Standing] {
        &self.standing
    }

    /// Counts what was put and taken, by whomever.
    pub(crate) const fn changes(&self) -> u64 {
        self.changes
    }

    /// Puts a thing on an edge; one that stands there already stays.
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

    /// Has nothing stand but `kept`. What came by chance goes again after its time, if as many come
    /// and go as before.
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

    /// Puts and takes what is due among the `blocks` that stand in the hall.
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

/// All edges between the nodes of so many squares.
fn edges([columns, rows]: [u8; 2]) -> impl Iterator<Item = Edge> {
    let nodes = (0..=columns).flat_map(move |x| (0..=rows).map(move |y| [x, y]));
    nodes.flat_map(move |from| {
        let [x, y] = from;
        let right = (x < columns).then(|| [x + 1, y]);
        let up = (y < rows).then(|| [x, y + 1]);
        [right, up]
            .into_iter()
            .flatten()
            .map(move |to| Edge { from, to })
    })
}

/// From the robot's axle to the middle of a block.
fn distance(pose: &Pose, block: &Block) -> f64 {
    let middle = |axis: usize| f64::midpoint(block.low[axis], block.high[axis]);
    (middle(0) - pose.x).hypot(middle(1) - pose.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs for `seconds` with a robot that stands at `pose`; what stood at each tenth of a second.
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
        assert_eq!(edges([3, 2]).count(), 3 * 3 + 2 * 4);
    }

    fn first_two() -> [Edge; 2] {
        [([0, 0], [1, 0]), ([1, 0], [2, 0])].map(|(from, to)| Edge { from, to })
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
            from: [9, 0],
            to: [10, 0],
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
