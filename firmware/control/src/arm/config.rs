//! The arm's steps, speeds and times, which the document does not give (AMB-32). Limits and poses
//! depend on how a robot is built, so they stand in the profile, which the Pi can change.

use lager_ax12::table;
use lager_wire::{ArmProfile, ArmValues};

/// The arm's numbers. [`Default`] is for the simulator's robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArmConfig {
    /// Size of one step in position units of 0.29 degrees (A5, `INCREMENTAL_ANGLE`; AMB-31).
    pub step: u16,
    /// Goal speed of a step, 0 = full (A5, `STANDARD_SPEED`), else units of 0.111 rpm.
    pub step_speed: u16,
    /// Goal speed of every longer movement, in units of 0.111 rpm; slow, so the arm moves softly
    /// (E16).
    pub sequence_speed: u16,
    /// Limits, torque, poses and the squeeze's load, until the Pi sends others.
    pub profile: ArmValues,
    /// How long a servo may take to answer, in microseconds.
    pub reply_timeout_us: u32,
    /// How often the board asks a moving servo for its state, in microseconds.
    pub look_period_us: u32,
    /// Pause between two steps of a squeeze, in microseconds.
    pub squeeze_period_us: u32,
    /// How long a step may take, in microseconds.
    pub step_timeout_us: u32,
    /// How long each part of a longer movement may take, in microseconds.
    pub sequence_timeout_us: u32,
    /// How often the board asks one servo for its state and reports it, in microseconds. The servos
    /// take turns.
    pub round_period_us: u32,
}

impl Default for ArmConfig {
    fn default() -> Self {
        Self {
            step: 3,
            step_speed: table::FULL_SPEED,
            sequence_speed: 100,
            profile: ArmProfile::default().into(),
            reply_timeout_us: 3_000,
            look_period_us: 10_000,
            squeeze_period_us: 20_000,
            step_timeout_us: 200_000,
            sequence_timeout_us: 4_000_000,
            round_period_us: 100_000,
        }
    }
}
