//! How the robot really is, one line of JSON at a time, and back.
//!
//! The emulator knows no topic; the process that started it reads these lines and publishes them. A
//! line is a sample of the topic `truth/pose` as JSON, so no other format is needed. A killed
//! emulator goes on from the last line.

use core::time::Duration;

use lager_plant::arm::SERVOS;
use lager_plant::{Edge, Good, GoodState, HandsOff, Pose, Standing, World, WorldState};
use serde::{Deserialize, Serialize};

use crate::rig::Rig;

/// One piece of goods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TruthGood {
    /// The product's number.
    pub id: i32,
    /// Its middle in mm.
    pub x_mm: f64,
    /// Its middle in mm.
    pub y_mm: f64,
    /// Its middle in mm.
    pub z_mm: f64,
    /// Where it is.
    pub state: TruthGoodState,
}

/// Where a piece of goods is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)] // As `lager_plant::GoodState`.
pub enum TruthGoodState {
    Shelf,
    Held,
    Lying,
    Delivered,
}

/// A thing that stands in the middle of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TruthObstacle {
    /// Column of the edge's left or lower node.
    pub x: u8,
    /// Row of the edge's left or lower node.
    pub y: u8,
    /// Where the edge leaves that node.
    pub heading: TruthHeading,
    /// 1 = it came by chance and goes again by itself.
    pub by_chance: u8,
}

/// The two directions in which an edge leaves its left or lower node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)] // They say it.
pub enum TruthHeading {
    Right,
    Up,
}

/// A line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TruthLine {
    /// Time since the start of the world in ns.
    pub time_ns: u64,
    /// Middle of the axle in mm.
    pub x_mm: f64,
    /// Middle of the axle in mm.
    pub y_mm: f64,
    /// Heading in rad, counter-clockwise from +x; not wrapped.
    pub heading_rad: f64,
    /// Speed of the left wheels in mm/s.
    pub left_mm_per_s: f64,
    /// Speed of the right wheels in mm/s.
    pub right_mm_per_s: f64,
    /// Duty at the left driver, 0 to 255, whichever way it turns.
    pub left_duty: u8,
    /// Duty at the right driver.
    pub right_duty: u8,
    /// The product in the claw, -1 = none.
    pub carrying: i32,
    /// How many goods there are.
    pub good_count: u16,
    /// Position of servo n at index n - 1, 0 to 1023.
    pub servo_position: [u16; SERVOS],
    /// The part of the battery's charge that is left, 0 to 1.
    pub battery_charge: f64,
    /// How often the body has run into something.
    pub collisions: u32,
    /// The goods.
    pub goods: Vec<TruthGood>,
    /// What stands on edges.
    pub obstacles: Vec<TruthObstacle>,
    /// How many of them there are.
    pub obstacle_count: u16,
}

/// What somebody's hands do: a line of JSON on standard input.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Hand {
    /// They put the robot somewhere, at rest.
    Place {
        /// Middle of the axle in mm.
        x_mm: f64,
        /// Middle of the axle in mm.
        y_mm: f64,
        /// Heading in rad, counter-clockwise from +x.
        heading_rad: f64,
    },
    /// They put a thing between two neighbouring nodes.
    Put {
        /// The nodes.
        between: [[u8; 2]; 2],
    },
    /// They take the thing between two neighbouring nodes away.
    Take {
        /// The nodes.
        between: [[u8; 2]; 2],
    },
}

impl Hand {
    /// Does it.
    pub fn act(self, world: &mut World) -> HandLine {
        let edge = |[a, b]: [[u8; 2]; 2]| Edge::between(a, b).ok_or(HandsOff::NoEdge);
        let done = match self {
            Self::Place {
                x_mm: x,
                y_mm: y,
                heading_rad: heading,
            } => {
                world.place(Pose { x, y, heading });
                Ok(())
            }
            Self::Put { between } => edge(between).and_then(|edge| world.put_obstacle(edge)),
            Self::Take { between } => edge(between).and_then(|edge| world.take_obstacle(edge)),
        };
        let hand = match done {
            Ok(()) => Hands::Done,
            Err(HandsOff::NoEdge) => Hands::NoEdge,
            Err(HandsOff::NoRoom) => Hands::NoRoom,
            Err(HandsOff::RobotThere) => Hands::RobotThere,
            Err(HandsOff::NothingThere) => Hands::NothingThere,
            Err(HandsOff::Full) => Hands::Full,
        };
        HandLine { hand }
    }
}

/// What became of it: a line of JSON among those of the truth, one for each that was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HandLine {
    /// What became of it.
    pub hand: Hands,
}

/// What became of what hands did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)] // As `lager_plant::HandsOff`.
pub enum Hands {
    Done,
    NoEdge,
    NoRoom,
    RobotThere,
    NothingThere,
    Full,
}

impl TruthLine {
    /// How the robot is now.
    pub fn of(rig: &Rig) -> Self {
        let world = rig.world();
        let state = world.state();
        let [left_duty, right_duty] = rig.duties().map(|duty| duty.unsigned_abs().min(255) as u8);
        Self {
            time_ns: rig.world_time().as_nanos() as u64,
            x_mm: state.pose.x,
            y_mm: state.pose.y,
            heading_rad: state.pose.heading,
            left_mm_per_s: state.wheel_speeds[0],
            right_mm_per_s: state.wheel_speeds[1],
            left_duty,
            right_duty,
            carrying: world.goods().held().unwrap_or(-1),
            good_count: state.goods.len() as u16,
            servo_position: state.servo_positions,
            battery_charge: state.battery_charge,
            collisions: state.collisions,
            goods: state.goods.iter().map(TruthGood::of).collect(),
            obstacle_count: state.obstacles.len() as u16,
            obstacles: state.obstacles.iter().map(TruthObstacle::of).collect(),
        }
    }

    /// The world to go on with.
    pub fn world_state(&self) -> WorldState {
        WorldState {
            time: Duration::from_nanos(self.time_ns),
            pose: Pose {
                x: self.x_mm,
                y: self.y_mm,
                heading: self.heading_rad,
            },
            wheel_speeds: [self.left_mm_per_s, self.right_mm_per_s],
            servo_positions: self.servo_position.map(|position| position.min(1_023)),
            goods: self.goods.iter().map(TruthGood::good).collect(),
            battery_charge: self.battery_charge,
            collisions: self.collisions,
            obstacles: self.obstacles.iter().map(TruthObstacle::stands).collect(),
        }
    }
}

impl TruthObstacle {
    fn of(stands: &Standing) -> Self {
        let [x, y] = stands.edge.from;
        Self {
            x,
            y,
            heading: match stands.edge.to[0] > x {
                true => TruthHeading::Right,
                false => TruthHeading::Up,
            },
            by_chance: stands.by_chance.into(),
        }
    }

    fn stands(&self) -> Standing {
        let Self { x, y, .. } = *self;
        Standing {
            edge: Edge {
                from: [x, y],
                to: match self.heading {
                    TruthHeading::Right => [x.saturating_add(1), y],
                    TruthHeading::Up => [x, y.saturating_add(1)],
                },
            },
            by_chance: self.by_chance != 0,
        }
    }
}

impl TruthGood {
    fn of(good: &Good) -> Self {
        Self {
            id: good.id,
            x_mm: good.position[0],
            y_mm: good.position[1],
            z_mm: good.position[2],
            state: match good.state {
                GoodState::Shelf => TruthGoodState::Shelf,
                GoodState::Held => TruthGoodState::Held,
                GoodState::Lying => TruthGoodState::Lying,
                GoodState::Delivered => TruthGoodState::Delivered,
            },
        }
    }

    fn good(&self) -> Good {
        Good {
            id: self.id,
            position: [self.x_mm, self.y_mm, self.z_mm],
            state: match self.state {
                TruthGoodState::Shelf => GoodState::Shelf,
                TruthGoodState::Held => GoodState::Held,
                TruthGoodState::Lying => GoodState::Lying,
                TruthGoodState::Delivered => GoodState::Delivered,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_world_survives_its_line() {
        let good = |id, state| Good {
            id,
            position: [1.5, -2.0, 25.0],
            state,
        };
        let world = WorldState {
            time: Duration::from_millis(12_345),
            pose: Pose {
                x: 100.25,
                y: -3.0,
                heading: 1.5,
            },
            wheel_speeds: [73.0, -20.5],
            servo_positions: [1, 2, 3, 4, 5, 6, 7, 1_023],
            goods: vec![
                good(7, GoodState::Shelf),
                good(8, GoodState::Held),
                good(9, GoodState::Lying),
                good(10, GoodState::Delivered),
            ],
            battery_charge: 0.625,
            collisions: 3,
            obstacles: vec![
                Standing {
                    edge: Edge {
                        from: [1, 2],
                        to: [2, 2],
                    },
                    by_chance: true,
                },
                Standing {
                    edge: Edge {
                        from: [0, 0],
                        to: [0, 1],
                    },
                    by_chance: false,
                },
            ],
        };
        let truth = TruthLine {
            time_ns: world.time.as_nanos() as u64,
            x_mm: world.pose.x,
            y_mm: world.pose.y,
            heading_rad: world.pose.heading,
            left_mm_per_s: world.wheel_speeds[0],
            right_mm_per_s: world.wheel_speeds[1],
            left_duty: 100,
            right_duty: 120,
            carrying: 8,
            good_count: 4,
            servo_position: world.servo_positions,
            battery_charge: world.battery_charge,
            collisions: world.collisions,
            goods: world.goods.iter().map(TruthGood::of).collect(),
            obstacles: world.obstacles.iter().map(TruthObstacle::of).collect(),
            obstacle_count: 2,
        };
        let line = serde_json::to_string(&truth).unwrap();
        assert!(!line.contains('\n'));
        let back: TruthLine = serde_json::from_str(&line).unwrap();
        assert_eq!(back.world_state(), world);
    }

    #[test]
    fn hands_are_lines_too() {
        let line = r#"{"put":{"between":[[1,0],[2,0]]}}"#;
        let put = Hand::Put {
            between: [[1, 0], [2, 0]],
        };
        assert_eq!(serde_json::to_string(&put).unwrap(), line);
        assert_eq!(serde_json::from_str::<Hand>(line).unwrap(), put);
    }
}
