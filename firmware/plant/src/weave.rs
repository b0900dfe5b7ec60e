//! Measures how well the robot keeps to its line: its largest lateral error after 1 m (E15).
//!
//! It compares the middle of the line sensors with the middle of the tape that they follow, while
//! neither wheel is driven backwards. The first metre and the first 300 mm after each turn do not
//! count: there the robot comes to its line from where somebody put it, or from a turn that ends
//! within a few degrees. Bends count: on the tightest one, a robot that follows well has the tape
//! under its outer sensors.
//!
//! Over 200 seeds and one product it is at most 18 mm on straight tape, 22 mm on the 40 cm bends of
//! `curved` and 23 mm on the 25 cm bend of `large`. `lager simulate` prints it as `lateral_mm`.

use crate::body::{LINE_SENSOR_AHEAD, Pose};
use crate::tape::Tape;

/// Way at the beginning that does not count, in mm.
const RUN_IN: f64 = 1_000.0;
/// Way after each turn that does not count, in mm.
const SETTLING: f64 = 300.0;

/// The way so far, and the largest error on it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Weave {
    driven: f64,
    straight: f64,
    worst: f64,
}

impl Weave {
    /// Adds a step: the robot's new pose, its duties, and the `way` of the step in mm.
    pub(crate) fn step(&mut self, pose: &Pose, duties: [i16; 2], way: f64, tape: &Tape) {
        if duties.iter().any(|duty| *duty < 0) {
            self.straight = 0.0;
            return;
        }
        self.driven += way;
        self.straight += way;
        if self.driven < RUN_IN || self.straight < SETTLING {
            return;
        }
        let (x, y) = pose.point(LINE_SENSOR_AHEAD, 0.0);
        if let Some(error) = tape.beside(x, y, pose.heading) {
            self.worst = self.worst.max(error);
        }
    }

    /// The largest error in mm.
    pub(crate) fn worst(&self) -> f64 {
        self.worst
    }
}
