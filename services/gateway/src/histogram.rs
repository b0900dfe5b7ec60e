//! A histogram with fixed buckets, as Prometheus adds them up.

/// The upper end of the first bucket is 2 to the power of this, in ns: about a quarter of a us.
const FIRST: u32 = 8;
/// The upper end of the last bucket but one is 2 to the power of this, in ns: about a second.
const LAST: u32 = 30;
/// One for each doubling, and one for what is longer.
const BUCKETS: usize = (LAST - FIRST + 2) as usize;

/// Durations, each in the bucket of its length.
#[derive(Clone, Debug, Default)]
pub(crate) struct Histogram {
    buckets: [u64; BUCKETS],
    sum_ns: u64,
}

impl Histogram {
    /// Counts a duration.
    pub(crate) fn record(&mut self, duration_ns: u64) {
        // An upper end belongs to the bucket below.
        let doublings = duration_ns.saturating_sub(1).checked_ilog2().unwrap_or(0) + 1;
        let bucket = doublings.saturating_sub(FIRST) as usize;
        self.buckets[bucket.min(BUCKETS - 1)] += 1;
        self.sum_ns = self.sum_ns.saturating_add(duration_ns);
    }

    /// The upper end of each bucket but the last, in s, and how many durations are no longer.
    pub(crate) fn cumulative(&self) -> impl Iterator<Item = (f64, u64)> + '_ {
        let ends = (FIRST..=LAST).map(|power| (1_u64 << power) as f64 / 1e9);
        let counts = self.buckets.iter().scan(0, |sum, count| {
            *sum += count;
            Some(*sum)
        });
        ends.zip(counts)
    }

    /// How many durations there are.
    pub(crate) fn count(&self) -> u64 {
        self.buckets.iter().sum()
    }

    /// All durations together, in s.
    pub(crate) fn sum_seconds(&self) -> f64 {
        self.sum_ns as f64 / 1e9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_holds_what_is_longer_than_the_one_before_and_no_longer_than_its_end() {
        for power in FIRST..=LAST {
            let end = 1_u64 << power;
            let mut histogram = Histogram::default();
            for duration in [end - 1, end, end + 1] {
                histogram.record(duration);
            }
            let within = |seconds: f64| {
                let mut all = histogram.cumulative();
                all.find(|(end, _)| *end >= seconds).map(|(_, count)| count)
            };
            assert_eq!(within(end as f64 / 1e9), Some(2), "2^{power}");
            assert_eq!(histogram.count(), 3);
        }
    }

    #[test]
    fn what_is_longer_than_all_is_counted_and_added_up() {
        let mut histogram = Histogram::default();
        for duration in [0, 1, 5_000_000_000] {
            histogram.record(duration);
        }
        let last = histogram.cumulative().last();
        assert_eq!(last.map(|(_, count)| count), Some(2));
        assert_eq!(histogram.count(), 3);
        assert!((histogram.sum_seconds() - 5.000_000_001).abs() < 1e-12);
    }
}
