//! The line sensor: eleven reflectance sensors side by side, ahead of the axle (S5, P4).
//!
//! ```text
//!        o o o o o o o o o o o      11 spots, 7 mm apart, channel 0 on the left
//!                  |
//!                  | 160 mm
//!        ==========+==========      axle
//! ```
//! Black tape reflects little, so its voltage is high (S6). Every spot has its own white and
//! black level from the seed, and each reading has a little noise.

use crate::body::{LINE_SENSOR_AHEAD, Pose};
use crate::noise::Noise;
use crate::tape::Tape;

/// Number of sensors (S5).
pub const CHANNELS: usize = 11;
/// Distance between neighbouring sensors in mm.
pub const PITCH: f64 = 7.0;
/// Radius of the spot one sensor sees, in mm.
pub const SPOT: f64 = 2.5;

/// The mean 8-bit reading over white floor and over tape.
const WHITE: f64 = 45.0;
const BLACK: f64 = 205.0;
/// How far a sensor's own levels are from the mean.
const LEVEL_SPREAD: f64 = 15.0;
/// Deviation of one reading.
const READING_NOISE: f64 = 2.0;

/// The array and its imperfections.
#[derive(Clone, Debug)]
pub struct LineSensor {
    white: [f64; CHANNELS],
    black: [f64; CHANNELS],
    noise: Noise,
}

impl LineSensor {
    /// An array whose levels and noise come from `noise`.
    pub fn new(mut noise: Noise) -> Self {
        let mut levels = |mean: f64| core::array::from_fn(|_| mean + noise.spread(LEVEL_SPREAD));
        let (white, black) = (levels(WHITE), levels(BLACK));
        Self {
            white,
            black,
            noise,
        }
    }

    /// One conversion: 8 bits, high over tape. A channel that is not there reads 0, as an input
    /// of the multiplexer that is tied to ground.
    pub fn read(&mut self, channel: u8, pose: &Pose, tape: &Tape) -> u8 {
        let channel = usize::from(channel);
        if channel >= CHANNELS {
            return 0;
        }
        let left = ((CHANNELS - 1) as f64 / 2.0 - channel as f64) * PITCH;
        let (x, y) = pose.point(LINE_SENSOR_AHEAD, left);
        let covered = tape.coverage(x, y, SPOT);
        let level = self.white[channel] + (self.black[channel] - self.white[channel]) * covered;
        (level + self.noise.bell(READING_NOISE)).clamp(0.0, 255.0) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Warehouse;

    fn bits(x: f64, y: f64) -> u16 {
        let tape = Tape::new(&Warehouse::builtin("small").unwrap());
        let mut sensor = LineSensor::new(Noise::new(3, 9));
        let pose = Pose { x, y, heading: 0.0 };
        (0..CHANNELS as u8).fold(0, |bits, channel| {
            bits << 1 | u16::from(sensor.read(channel, &pose, &tape) > 127)
        })
    }

    #[test]
    fn the_middle_sensors_see_the_line() {
        assert_eq!(bits(100.0, 0.0), 0b000_0111_0000);
    }

    #[test]
    fn a_robot_left_of_the_line_has_it_on_its_right_half() {
        let seen = bits(100.0, 20.0);
        assert_ne!(seen, 0);
        assert_eq!(seen & 0b111_1110_0000, 0, "{seen:011b}");
    }

    #[test]
    fn a_mark_reaches_to_one_side_a_crossing_to_both() {
        // Product 1 has its mark to the left at x = 750; the array is 160 mm ahead.
        assert_eq!(bits(750.0 - 160.0, 0.0), 0b111_1111_0000);
        // The crossing (1, 0) at the lower border: a way up, none down.
        assert_eq!(bits(500.0 - 160.0, 0.0), 0b111_1111_0000);
        // The crossing (1, 1) inside.
        assert_eq!(bits(500.0 - 160.0, 500.0), 0b111_1111_1111);
    }

    #[test]
    fn off_the_tape_there_is_nothing() {
        assert_eq!(bits(100.0, 200.0), 0);
        let tape = Tape::new(&Warehouse::builtin("small").unwrap());
        let mut sensor = LineSensor::new(Noise::new(3, 9));
        assert_eq!(sensor.read(11, &Pose::default(), &tape), 0);
    }
}
