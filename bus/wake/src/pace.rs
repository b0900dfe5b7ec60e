//! [`Pace`]: how often an observer looks into its queues, for which nobody rings.

use core::time::Duration;

use crate::urgency;

/// How long the wait may be for each place of a queue. At 500 samples a second a quarter of the
/// queue then stays free. A look that finds more makes the next wait shorter.
const PLACE: Duration = Duration::from_micros(1_500);

/// How long an observer waits between two looks, so that most of each queue stays free.
///
/// Every look takes a core from another thread, and sixty observers may look at once.
#[derive(Clone, Debug)]
pub struct Pace {
    shortest: Duration,
    longest: Duration,
    wait: Duration,
    /// At the last look: the share of the fullest queue's places that were taken, and the longest
    /// wait that the smallest queue allows.
    fullest: f64,
    allowed: Duration,
}

impl Pace {
    /// For the calling thread, which records or shows every sample with its contents.
    pub fn keeping() -> Self {
        urgency::wake_with_others(Duration::from_millis(1));
        Self::between(Duration::from_millis(1), Duration::from_millis(12))
    }

    /// For the calling thread, which reads only the stamps and may read them late.
    pub fn counting() -> Self {
        urgency::wake_with_others(Duration::from_millis(10));
        Self::between(Duration::from_millis(5), Duration::from_millis(50))
    }

    const fn between(shortest: Duration, longest: Duration) -> Self {
        Self {
            shortest,
            longest,
            wait: shortest,
            fullest: 0.0,
            allowed: longest,
        }
    }

    /// Always the same wait.
    pub const fn every(wait: Duration) -> Self {
        Self::between(wait, wait)
    }

    /// To be called when a look has found `samples` in a queue of `places`.
    pub fn found(&mut self, samples: u64, places: usize) {
        self.fullest = self.fullest.max(samples as f64 / places as f64);
        let places = u32::try_from(places).unwrap_or(u32::MAX);
        self.allowed = self.allowed.min(PLACE.saturating_mul(places));
    }

    /// How long to wait after a look into all queues.
    pub fn wait(&mut self) -> Duration {
        let wait = match self.fullest {
            full if full > 0.25 => self.wait / 2,
            full if full > 0.125 => self.wait,
            _ => self.wait * 2,
        };
        self.wait = wait.min(self.allowed).min(self.longest).max(self.shortest);
        (self.fullest, self.allowed) = (0.0, self.longest);
        self.wait
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// The wait after many looks at queues, each given as samples a second and places.
    fn settled(queues: &[(u64, usize)]) -> Duration {
        let mut pace = Pace::between(2 * MS, 50 * MS);
        let mut wait = pace.wait();
        for _ in 0..100 {
            for (per_second, places) in queues {
                let samples = per_second * wait.as_micros() as u64 / 1_000_000;
                pace.found(samples, *places);
            }
            wait = pace.wait();
        }
        wait
    }

    #[test]
    fn most_of_each_queue_stays_free() {
        assert_eq!(settled(&[(200, 256)]), 50 * MS);
        assert!((4 * MS..8 * MS).contains(&settled(&[(10_000, 256)])));
        let of_both = settled(&[(200, 256), (10_000, 256)]);
        assert_eq!(of_both, settled(&[(10_000, 256)]));
        for (per_second, places) in [(1_000, 256), (1_000, 64), (250, 16), (500, 16)] {
            let wait = settled(&[(per_second, places)]);
            let filled = wait.as_secs_f64() * per_second as f64 / places as f64;
            assert!(filled < 0.5, "{per_second} in {places}: {wait:?}");
        }
    }

    #[test]
    fn a_small_queue_is_looked_at_often_also_before_anything_has_come() {
        assert_eq!(settled(&[(0, 1)]), 2 * MS);
        assert_eq!(settled(&[(0, 256), (0, 1)]), 2 * MS);
        assert_eq!(settled(&[(0, 8)]), 12 * MS);
        assert_eq!(settled(&[(0, usize::MAX)]), 50 * MS);
        // The small queue is gone again.
        let mut pace = Pace::between(2 * MS, 50 * MS);
        pace.found(0, 1);
        pace.wait();
        let waits = [pace.wait(), pace.wait(), pace.wait()];
        assert_eq!(waits, [4 * MS, 8 * MS, 16 * MS]);
    }

    #[test]
    fn one_pace_stays_as_it_is() {
        let mut pace = Pace::every(MS);
        pace.found(256, 256);
        assert_eq!(pace.wait(), MS);
        pace.found(0, 256);
        assert_eq!(pace.wait(), MS);
    }
}
