//! The arm on the robot: calculates the claw's place and opening from the servos' positions.
//!
//! ```text
//!            elbow (4, 5)
//!             o----.  FOREARM           servo 1   base, turns the whole arm
//!   UPPER    /      \                   2, 3      shoulder, a mirrored pair
//!     ARM   /        v claw (8)         4, 5      elbow, a mirrored pair
//!          o shoulder (2, 3)            6, 7      wrist and its rotation: they turn the claw
//!        ==+== base (1), 60 mm ahead              but do not move its middle
//!    ------+------- axle                8         claw
//! ```
//! With all servos at 512 the upper arm is straight up, the forearm points level ahead, and the
//! claw is 80 mm open. The mirrored servo of a pair stands at 1023 minus its partner's position.
//! The direction in which a servo counts depends on its mounting. Here it counts as the constants
//! below say; [`crate::ArmBuild`] has the ids of the servos and those that count the other way.

/// Number of servos, of which two may be absent (AMB-32). `lager_wire` says it too: a world knows of no packets.
pub const SERVOS: usize = 8;
/// The servos' positions before a robot starts: the pose for driving, the claw open. An unpowered
/// arm stays where somebody put it.
pub const RESTING: [u16; SERVOS] = [512, 600, 423, 400, 623, 512, 512, 512];
/// Radians per unit of position: 1024 units span 300 degrees.
pub const UNIT: f64 = 300.0 / 1023.0 * core::f64::consts::PI / 180.0;

/// How far the base's axis is ahead of the wheels' axle, in mm.
pub const BASE_AHEAD: f64 = 60.0;
/// Height of the shoulder over the floor in mm.
pub const SHOULDER_HEIGHT: f64 = 120.0;
/// Shoulder to elbow in mm.
pub const UPPER_ARM: f64 = 150.0;
/// Elbow to the middle of the claw in mm.
pub const FOREARM: f64 = 150.0;

/// The middle of every servo's range.
const CENTRE: f64 = 512.0;
/// Position of the claw's servo at which the jaws meet, and how many mm each further unit opens.
const CLAW_CLOSED: f64 = 210.0;
const GAP_PER_UNIT: f64 = 80.0 / 302.0;
/// Widest opening of the claw in mm.
const WIDEST: f64 = 100.0;

/// The claw in the robot's own coordinates, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claw {
    /// Distance of its middle ahead of the axle.
    pub ahead: f64,
    /// Distance of its middle to the left.
    pub left: f64,
    /// Height of its middle over the floor.
    pub up: f64,
    /// Space between the jaws.
    pub gap: f64,
}

/// The claw's place when servo n stands at `positions[n - 1]`.
pub fn claw(positions: &[f64; SERVOS]) -> Claw {
    let angle = |position: f64| (position - CENTRE) * UNIT;
    let pair = |one: f64, mirrored: f64| f64::midpoint(one, 1023.0 - mirrored);
    let base = angle(positions[0]);
    let shoulder = angle(pair(positions[1], positions[2]));
    let elbow = angle(pair(positions[3], positions[4]));
    // Measured from straight up: higher positions lift the upper arm and stretch the forearm.
    let upper = core::f64::consts::FRAC_PI_2 + shoulder;
    let fore = upper - core::f64::consts::FRAC_PI_2 + elbow;
    let reach = UPPER_ARM * upper.cos() + FOREARM * fore.cos();
    Claw {
        ahead: BASE_AHEAD + reach * base.cos(),
        left: reach * base.sin(),
        up: SHOULDER_HEIGHT + UPPER_ARM * upper.sin() + FOREARM * fore.sin(),
        gap: gap(positions[7]),
    }
}

/// Space between the jaws in mm at a position of the claw's servo.
pub fn gap(position: f64) -> f64 {
    ((position - CLAW_CLOSED) * GAP_PER_UNIT).clamp(0.0, WIDEST)
}

/// The position of the claw's servo at which the jaws are `gap` mm apart.
pub fn claw_position(gap: f64) -> f64 {
    CLAW_CLOSED + gap / GAP_PER_UNIT
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEUTRAL: [f64; SERVOS] = [512.0, 512.0, 511.0, 512.0, 511.0, 512.0, 512.0, 512.0];

    fn with(changes: &[(usize, f64)]) -> Claw {
        let mut positions = NEUTRAL;
        for &(servo, change) in changes {
            positions[servo - 1] += change;
        }
        claw(&positions)
    }

    #[test]
    fn the_neutral_pose_is_as_drawn() {
        let claw = claw(&NEUTRAL);
        assert!((claw.ahead - 210.0).abs() < 1e-6 && claw.left.abs() < 1e-6);
        assert!((claw.up - 270.0).abs() < 1e-6 && (claw.gap - 80.0).abs() < 1e-6);
    }

    #[test]
    fn every_joint_moves_the_claw_its_way() {
        let neutral = claw(&NEUTRAL);
        assert!(with(&[(1, 30.0)]).left > 5.0);
        let lowered = with(&[(2, -60.0), (3, 60.0)]);
        assert!(lowered.up < neutral.up - 20.0 && lowered.ahead > neutral.ahead);
        let stretched = with(&[(2, -120.0), (3, 120.0), (4, 60.0), (5, -60.0)]);
        assert!(stretched.ahead > with(&[(2, -120.0), (3, 120.0)]).ahead);
        assert!(with(&[(8, 50.0)]).gap > neutral.gap);
    }

    #[test]
    fn half_of_a_pair_moves_half_the_way() {
        let both = with(&[(2, -60.0), (3, 60.0)]);
        let neutral = claw(&NEUTRAL);
        let one = with(&[(2, -60.0)]);
        assert!(one.up < neutral.up && one.up > both.up);
    }

    #[test]
    fn gap_and_position_are_inverse() {
        for wanted in [0.0, 50.0, 80.0] {
            assert!((gap(claw_position(wanted)) - wanted).abs() < 1e-9);
        }
        assert_eq!(gap(2_000.0), WIDEST);
    }
}
