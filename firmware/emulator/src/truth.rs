//! How the robot really is, one line of JSON at a time, and back.
//!
//! The emulator knows no topic; whoever started it reads these lines and publishes them. A line is
//! a sample of the topic `truth/pose` as JSON, so it is read and written there without another
//! format. A killed emulator goes on from the last line.

use core::time::Duration;

use lager_plant::arm::SERVOS;
use lager_plant::{Good, GoodState, Pose, WorldState};
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

/// A line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
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
    /// The goods.
    pub goods: Vec<TruthGood>,
}

impl Truth {
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
            goods: state.goods.iter().map(TruthGood::of).collect(),
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
        };
        let truth = Truth {
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
            goods: world.goods.iter().map(TruthGood::of).collect(),
        };
        let line = serde_json::to_string(&truth).unwrap();
        assert!(!line.contains('\n'));
        let back: Truth = serde_json::from_str(&line).unwrap();
        assert_eq!(back.world_state(), world);
    }
}
