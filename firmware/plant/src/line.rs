//! The line sensor: eleven reflectance sensors side by side, ahead of the axle (S5, P4).
//!
//! ```text
//!        o o o o o o o o o o o      11 spots, 7 mm apart, channel 0 on the left
//!                  |
//!                  | 160 mm
//!        ==========+==========      axle
//! ```
//! Black tape reflects little, so its voltage is high (S6). The seed gives every sensor its own
//! white and black level, and each reading a little noise. For a varied robot ([`crate::make`]) the
//! floor is darker and the tape paler in some places, by up to 25 steps, in waves of 0.7 to 3 m. A
//! floor may also have a weaker contrast everywhere ([`crate::warehouse::Floor`]).

use core::f64::consts::TAU;

use crate::body::{LINE_SENSOR_AHEAD, Pose};
use crate::make::Make;
use crate::noise::Noise;
use crate::tape::{Near, Tape};
use crate::warehouse::Floor;

/// Number of sensors (S5).
pub const CHANNELS: usize = 11;
/// Distance between neighbouring sensors in mm.
pub const PITCH: f64 = 7.0;
/// Radius of the spot that one sensor sees, in mm.
pub const SPOT: f64 = 2.5;

/// The array sees nothing farther from its middle than this, in mm.
const REACH: f64 = (CHANNELS - 1) as f64 / 2.0 * PITCH + SPOT;

/// How far a sensor's own levels may be from the mean, in steps.
const LEVEL_SPREAD: f64 = 15.0;
/// Deviation of one reading, in steps.
const READING_NOISE: f64 = 2.0;
/// How much floor and tape differ between places, in steps.
const DRIFT: f64 = 25.0;
/// Shortest and longest wavelength of these differences, in mm.
const WAVES: [f64; 2] = [700.0, 3_000.0];

/// How the floor or the tape differs between places: the sum of a wave along x and one along y.
#[derive(Clone, Copy, Debug)]
struct Drift {
    /// For each wave: radians per mm, and the angle at the origin.
    waves: [[f64; 2]; 2],
    most: f64,
}

impl Drift {
    fn new(noise: &mut Noise, make: Make, most: f64) -> Self {
        let mut wave = || {
            let length = make.draw(noise, WAVES[1], WAVES[0], WAVES[1]);
            [TAU / length, noise.spread(TAU / 2.0)]
        };
        Self {
            waves: [wave(), wave()],
            most: match make {
                Make::Nominal => 0.0,
                Make::Varied => most,
            },
        }
    }

    /// The difference at a point, from 0 to `most`.
    fn at(&self, x: f64, y: f64) -> f64 {
        if self.most == 0.0 {
            return 0.0;
        }
        let [along, across] = self.waves;
        let sum = (along[0] * x + along[1]).sin() + (across[0] * y + across[1]).sin();
        (0.5 + sum / 4.0) * self.most
    }
}

/// Values that all sensors share at a pose, calculated once for each pose.
#[derive(Clone, Copy, Debug)]
struct UnderArray {
    pose: Pose,
    /// The middle of the array.
    middle: (f64, f64),
    /// The way from one sensor to the next.
    step: (f64, f64),
    /// How much darker the floor and how much paler the tape is here.
    drift: [f64; 2],
    /// The tape that any of the sensors may see.
    near: Near,
}

/// The array and its imperfections.
#[derive(Clone, Debug)]
pub struct LineSensor {
    white: [f64; CHANNELS],
    black: [f64; CHANNELS],
    /// The differences of the floor and those of the tape.
    drifts: [Drift; 2],
    place: Option<UnderArray>,
    noise: Noise,
}

impl LineSensor {
    /// An array over this floor, with levels and noise from `noise`.
    pub fn new(mut noise: Noise, make: Make, floor: Floor) -> Self {
        let [white, black] = [floor.white, floor.tape].map(f64::from);
        // On a floor of weak contrast all differences are smaller.
        let part = (black - white) / Floor::default().contrast();
        let mut levels =
            |mean: f64| core::array::from_fn(|_| mean + noise.spread(LEVEL_SPREAD * part));
        let (white, black) = (levels(white), levels(black));
        let drifts = [0, 1].map(|_| Drift::new(&mut noise, make, DRIFT * part));
        Self {
            white,
            black,
            drifts,
            place: None,
            noise,
        }
    }

    /// One conversion: 8 bits, high over tape. A channel that does not exist reads 0, like an input
    /// of the multiplexer that is tied to ground.
    pub fn read(&mut self, channel: u8, pose: &Pose, tape: &Tape) -> u8 {
        let channel = usize::from(channel);
        if channel >= CHANNELS {
            return 0;
        }
        let UnderArray {
            middle,
            step,
            drift,
            near,
            ..
        } = self.place_at(pose, tape);
        let left = (CHANNELS - 1) as f64 / 2.0 - channel as f64;
        let (x, y) = (middle.0 + left * step.0, middle.1 + left * step.1);
        let covered = tape.coverage(near, x, y, SPOT);
        let white = self.white[channel] + drift[0];
        let black = self.black[channel] - drift[1];
        let level = white + (black - white) * covered;
        (level + self.noise.bell(READING_NOISE)).clamp(0.0, 255.0) as u8
    }

    fn place_at(&mut self, pose: &Pose, tape: &Tape) -> UnderArray {
        if let Some(place) = self.place.filter(|place| place.pose == *pose) {
            return place;
        }
        let middle = pose.point(LINE_SENSOR_AHEAD, 0.0);
        let first = pose.point(LINE_SENSOR_AHEAD, PITCH);
        let place = UnderArray {
            pose: *pose,
            middle,
            step: (first.0 - middle.0, first.1 - middle.1),
            drift: self.drifts.map(|drift| drift.at(middle.0, middle.1)),
            near: tape.near(middle.0, middle.1, REACH),
        };
        *self.place.insert(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Warehouse;

    fn bits(x: f64, y: f64) -> u16 {
        let tape = Tape::new(&Warehouse::builtin("small").unwrap());
        let mut sensor = LineSensor::new(Noise::new(3, 9), Make::Nominal, Floor::default());
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
        // The crossing (1, 0) at the lower border has a way up and none down.
        assert_eq!(bits(500.0 - 160.0, 0.0), 0b111_1111_0000);
        // The crossing (1, 1) is inside.
        assert_eq!(bits(500.0 - 160.0, 500.0), 0b111_1111_1111);
    }

    #[test]
    fn off_the_tape_there_is_nothing() {
        assert_eq!(bits(100.0, 200.0), 0);
        let tape = Tape::new(&Warehouse::builtin("small").unwrap());
        let mut sensor = LineSensor::new(Noise::new(3, 9), Make::Nominal, Floor::default());
        assert_eq!(sensor.read(11, &Pose::default(), &tape), 0);
    }

    #[test]
    fn floor_and_tape_differ_from_place_to_place_and_stay_apart() {
        let tape = Tape::new(&Warehouse::builtin("small").unwrap());
        let (mut floors, mut tapes) = (Vec::new(), Vec::new());
        for seed in 0..20 {
            let noise = Noise::new(seed, 9);
            let mut sensor = LineSensor::new(noise, Make::Varied, Floor::default());
            for step in 0..40 {
                let x = f64::from(step) * 8.0 + 10.0;
                let heading = 0.0;
                let on = Pose { x, y: 0.0, heading };
                tapes.push(sensor.read(5, &on, &tape));
                let beside = Pose {
                    x,
                    y: 200.0,
                    heading,
                };
                floors.push(sensor.read(5, &beside, &tape));
            }
        }
        let span = |levels: &[u8]| (*levels.iter().min().unwrap(), *levels.iter().max().unwrap());
        let ((floor_low, floor_high), (tape_low, tape_high)) = (span(&floors), span(&tapes));
        assert!(floor_high - floor_low > 30 && tape_high - tape_low > 30);
        assert!(
            floor_high < 110 && tape_low > 145,
            "{floor_high} {tape_low}"
        );
    }
}
