//! The robot's pose on the floor, and how the speeds of its wheels change it.
//!
//! The pose is that of the middle of the wheels' axle. [`crate::contact`] knows about obstacles;
//! this module does not.

use core::f64::consts::TAU;

use serde::{Deserialize, Serialize};

/// Effective distance between the wheel tracks in mm. Together with [`crate::motor::CRUISE`] it
/// gives 360 degrees in 12 s at the standard duty (W4).
pub const TRACK: f64 = 280.0;
/// How far the line sensors are ahead of the axle, in mm (P4).
pub const LINE_SENSOR_AHEAD: f64 = 160.0;
/// How far the IR ranger is ahead of the axle, in mm (P4).
pub const IR_AHEAD: f64 = 100.0;

/// Position and heading of the robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Middle of the axle, in mm.
    pub x: f64,
    /// Middle of the axle, in mm.
    pub y: f64,
    /// Heading in rad, counter-clockwise from +x; not wrapped.
    pub heading: f64,
}

impl Pose {
    /// The point `ahead` mm in front of the axle and `left` mm to the left.
    pub fn point(&self, ahead: f64, left: f64) -> (f64, f64) {
        let (sin, cos) = self.heading.sin_cos();
        (
            self.x + ahead * cos - left * sin,
            self.y + ahead * sin + left * cos,
        )
    }

    /// The pose after both wheels have run at these speeds in mm/s for `seconds`.
    ///
    /// It moves along a straight line with the heading of the middle of the step, which is exact to
    /// the third order.
    #[must_use]
    pub fn moved(&self, left: f64, right: f64, seconds: f64) -> Self {
        let turned = (right - left) / TRACK * seconds;
        let (sin, cos) = (self.heading + turned / 2.0).sin_cos();
        let travelled = (left + right) / 2.0 * seconds;
        Self {
            x: self.x + travelled * cos,
            y: self.y + travelled * sin,
            heading: self.heading + turned,
        }
    }

    /// The heading from 0 up to a full turn.
    pub fn wrapped_heading(&self) -> f64 {
        self.heading.rem_euclid(TAU)
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    #[test]
    fn equal_speeds_go_straight() {
        let pose = Pose {
            x: 1.0,
            y: 2.0,
            heading: FRAC_PI_2,
        }
        .moved(50.0, 50.0, 2.0);
        assert!((pose.x - 1.0).abs() < 1e-9 && (pose.y - 102.0).abs() < 1e-9);
    }

    #[test]
    fn opposite_speeds_turn_on_the_spot() {
        let mut pose = Pose::default();
        for _ in 0..12_000 {
            pose = pose.moved(-crate::motor::CRUISE, crate::motor::CRUISE, 0.001);
        }
        assert!(pose.x.abs() < 1e-6 && pose.y.abs() < 1e-6);
        assert!(
            (pose.heading - 2.0 * PI).abs() < 0.01,
            "W4: {}",
            pose.heading
        );
    }

    #[test]
    fn a_circle_closes() {
        let mut pose = Pose::default();
        // Radius 350 mm: inner wheel 210, outer 490.
        let (left, right) = (60.0, 140.0);
        let steps = (2.0 * PI * 350.0 / 100.0 / 0.001).round() as usize;
        for _ in 0..steps {
            pose = pose.moved(left, right, 0.001);
        }
        assert!(pose.x.abs() < 0.2 && pose.y.abs() < 0.2, "{pose:?}");
    }

    #[test]
    fn left_is_to_the_left() {
        let pose = Pose {
            x: 0.0,
            y: 0.0,
            heading: FRAC_PI_2,
        };
        let (x, y) = pose.point(160.0, 35.0);
        assert!((x + 35.0).abs() < 1e-9 && (y - 160.0).abs() < 1e-9);
    }
}
