//! What the document does not say about the arm: its steps, speeds and times (AMB-32). Limits and
//! poses depend on how a robot is built; they are in the profile, which the Pi may change.

use lager_ax12::table;
use lager_wire::ArmProfile;

/// The arm's numbers. [`Default`] is the robot of the simulator's world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArmConfig {
    /// Size of one step in position units of 0.29 degrees (A5, `INCREMENTAL_ANGLE`; AMB-31).
    pub step: u16,
    /// Goal speed of a step, 0 = full (A5, `STANDARD_SPEED`), else units of 0.111 rpm.
    pub step_speed: u16,
    /// Goal speed of every longer way, units of 0.111 rpm; the arm moves softly (E16).
    pub sequence_speed: u16,
    /// Limits, torque, poses and the squeeze's load, until the Pi tells others.
    pub profile: ArmProfile,
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
            profile: ArmProfile::default(),
            reply_timeout_us: 3_000,
            look_period_us: 10_000,
            squeeze_period_us: 20_000,
            step_timeout_us: 200_000,
            sequence_timeout_us: 4_000_000,
            round_period_us: 100_000,
        }
    }
}
