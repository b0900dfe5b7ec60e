//! How a robot is made: as drawn, or with the deviations of real parts.
//!
//! | part | as drawn | varied, drawn from the seed | source |
//! |---|---|---|---|
//! | gain of a motor | 1 ± 3 % | 1 ± 10 % | assumed for brushed gear motors of one batch |
//! | dead band of a motor, in duty | 75 | 60 to 90 | assumed: a skidding platform on other floors |
//! | battery at the start | 11.1 V for ever | 50 to 100 % of its charge | [`crate::battery`] |
//! | resistance of the supply | 0 | 60 to 140 mΩ | assumed: three cells, switch, leads |
//! | floor and tape | levels ± 15 | the same, and drifting by 25 | 8-bit steps; [`crate::line`] |
//! | IR output at 80 cm | 0.415 V | 0.25 to 0.55 V | datasheet E4-A00201EN, p. 3 |
//! | IR output, 10 less 80 cm | 1.89 V ± 2 % | 1.65 to 2.15 V | the same |
//! | IR time between outputs | 38.3 ms | 28.7 to 47.9 ms | the same |
//! | sagging of a joint without torque | none | 10 to 80 units/s | assumed for a worn gear |
//! | slip of a bad grip after | 3 s | 1 to 6 s | assumed |
//!
//! The standard duty gives cruising speed with any dead band, because the people who chose 100 for
//! the duty and 12 s for a turn (W1, W4) measured it with their robot. So the line of speed over
//! duty goes through that point, starts at the dead band, and differs only in slope: one step of
//! duty changes the speed by a fortieth of cruise if the dead band is 60, and by a tenth if it is
//! 90.
//!
//! The robot learns these deviations. The steering board corrects its duties for the battery, and
//! learns at marks how much its two motors differ; logic learns there how fast the wheels are.
//! `Make::Nominal` is the robot as drawn, for exact figures.

use crate::noise::Noise;

/// How a robot is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Make {
    /// As drawn, with little noise, for tests that need exact figures.
    Nominal,
    /// With the deviations of parts that nobody has selected.
    #[default]
    Varied,
}

impl Make {
    /// `drawn` for a robot as drawn, otherwise a random value from `low` to `high`.
    pub(crate) fn draw(self, noise: &mut Noise, drawn: f64, low: f64, high: f64) -> f64 {
        match self {
            Self::Nominal => drawn,
            Self::Varied => f64::midpoint(low, high) + noise.spread((high - low) / 2.0),
        }
    }
}
