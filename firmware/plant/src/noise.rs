//! Seeded noise: the same seed gives the same disturbances, run after run.
//!
//! The generator (SplitMix64, the public-domain mixing function of Steele, Lea and Flood) stands
//! here, so that a seed in a report still means the same robot after an update of a dependency.
//! Every device has its own stream: reading one device more often does not change another one's
//! values. Do not use it where nobody may guess the numbers.

/// One stream of noise.
#[derive(Clone, Debug)]
pub struct Noise {
    state: u64,
}

/// The step of the counter: 2^64 divided by the golden ratio, odd.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

/// The number of the stream that spreads the start times of the boards in a world.
pub const START_STREAM: u64 = 100;

impl Noise {
    /// Stream number `stream` of `seed`. Streams of one seed are independent of each other.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut noise = Self {
            state: seed ^ stream.wrapping_mul(0xD1B5_4A32_D192_ED03),
        };
        noise.state = noise.bits();
        noise
    }

    /// 64 evenly distributed bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(STEP);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// Evenly distributed from -`range` to +`range`.
    pub fn spread(&mut self, range: f64) -> f64 {
        let unit = (self.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        (2.0 * unit - 1.0) * range
    }

    /// Bell-shaped around 0 with the standard deviation `sigma`, at most 3.5 `sigma`: the sum of
    /// four even 16-bit numbers, because one draw then gives a whole value.
    pub fn bell(&mut self, sigma: f64) -> f64 {
        let bits = self.bits();
        let sum = (bits & 0xFFFF) + (bits >> 16 & 0xFFFF) + (bits >> 32 & 0xFFFF) + (bits >> 48);
        let centred = sum as f64 / 65_535.0 - 2.0;
        centred * sigma * 3_f64.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_repeats_and_streams_differ() {
        let draw = |seed, stream| {
            let mut noise = Noise::new(seed, stream);
            [noise.bits(), noise.bits(), noise.bits()]
        };
        assert_eq!(draw(1, 0), draw(1, 0));
        assert_ne!(draw(1, 0), draw(1, 1));
        assert_ne!(draw(1, 0), draw(2, 0));
    }

    #[test]
    fn the_bell_has_the_deviation_it_was_asked_for() {
        let mut noise = Noise::new(7, 3);
        let samples: Vec<f64> = (0..20_000).map(|_| noise.bell(2.0)).collect();
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let variance =
            samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / samples.len() as f64;
        assert!(mean.abs() < 0.05, "mean {mean}");
        assert!(
            (variance.sqrt() - 2.0).abs() < 0.05,
            "deviation {}",
            variance.sqrt()
        );
        assert!(samples.iter().all(|s| s.abs() <= 7.0));
    }
}
