//! What the document does not tell about the arm: limits, poses, loads and times (AMB-32).

use lager_ax12::table;

use super::SERVOS;

/// Where a servo may be sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Least position, 0..=1023.
    pub lowest: u16,
    /// Greatest position, 0..=1023.
    pub highest: u16,
}

impl Limits {
    /// All positions a servo has.
    pub const ALL: Self = Self {
        lowest: 0,
        highest: table::MAX_POSITION,
    };

    pub(crate) fn clamp(&self, position: u16) -> u16 {
        position.clamp(self.lowest, self.highest)
    }
}

/// A pose of the joints that carry the gripper; positions 0..=1023 of servos 1, 2, 4 and 6.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pose {
    /// Servo 1.
    pub base: u16,
    /// Servo 2; servo 3 is mirrored.
    pub shoulder: u16,
    /// Servo 4; servo 5 is mirrored.
    pub elbow: u16,
    /// Servo 6.
    pub wrist: u16,
}

/// The arm's numbers. [`Default`] is the robot of the simulator's world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArmConfig {
    /// Size of one step in position units of 0.29 degrees (A5, `INCREMENTAL_ANGLE`; AMB-31).
    pub step: u16,
    /// Goal speed of a step, 0 = full (A5, `STANDARD_SPEED`), else units of 0.111 rpm.
    pub step_speed: u16,
    /// Goal speed of every longer way, units of 0.111 rpm; the arm moves softly (E16).
    pub sequence_speed: u16,
    /// Torque limit, 0..=1023 of full.
    pub torque_limit: u16,
    /// Where each servo may be sent, at index id - 1. Those of servos 3 and 5 follow from their partners.
    pub limits: [Limits; SERVOS],
    /// Gripper position when open.
    pub gripper_open: u16,
    /// Gripper position when closed on nothing.
    pub gripper_closed: u16,
    /// Load, 0..=1023 of full, that ends a squeeze.
    pub squeeze_load: u16,
    /// Where goods are let go.
    pub drop: Pose,
    /// Where the arm is while the robot drives.
    pub carry: Pose,
    /// How long a servo may take to answer, in microseconds.
    pub reply_timeout_us: u32,
    /// How often a moving servo is looked at, in microseconds.
    pub look_period_us: u32,
    /// Pause between two steps of a squeeze, in microseconds.
    pub squeeze_period_us: u32,
    /// How long a step may take, in microseconds.
    pub step_timeout_us: u32,
    /// How long each part of a longer way may take, in microseconds.
    pub sequence_timeout_us: u32,
    /// How often, the servos taking turns, one is looked at and told of, in microseconds.
    pub round_period_us: u32,
}

impl Default for ArmConfig {
    fn default() -> Self {
        Self {
            step: 3,
            step_speed: table::FULL_SPEED,
            sequence_speed: 100,
            torque_limit: 1023,
            limits: [Limits::ALL; SERVOS],
            gripper_open: 512,
            gripper_closed: 210,
            squeeze_load: 300,
            drop: Pose {
                base: 512,
                shoulder: 300,
                elbow: 512,
                wrist: 512,
            },
            carry: Pose {
                base: 512,
                shoulder: 600,
                elbow: 400,
                wrist: 512,
            },
            reply_timeout_us: 3_000,
            look_period_us: 10_000,
            squeeze_period_us: 20_000,
            step_timeout_us: 200_000,
            sequence_timeout_us: 4_000_000,
            round_period_us: 100_000,
        }
    }
}
