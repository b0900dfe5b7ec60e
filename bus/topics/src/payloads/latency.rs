//! How long the robot takes to react: `latency/path` and `latency/command`.
//!
//! Logic publishes how long each sensor frame takes to its decision. The bridge publishes how long
//! each order that follows from a frame takes to the wire. Each writes what it sees, on its own
//! topic. All counts begin when their writer starts and never go down before it ends. So a reader
//! that was away has missed nothing, and the difference of two samples covers the time between them
//! ([`Durations::since`]).

use lager_sample::payload;

/// How many buckets [`Durations`] has.
const BUCKETS: usize = 90;

/// The upper end of the first bucket is 2 to the power of this, in ns.
const FIRST: u32 = 8;

/// The upper end of the last bucket but one is 2 to the power of this, in ns.
const LAST: u32 = 30;

/// A percentile of a tail is a figure only if this many durations lie beyond it.
const BEYOND: u64 = 10;

/// Each doubling is divided into 2 to the power of this many buckets.
const PARTS: u32 = 2;

const _: () = assert!(
    BUCKETS == 2 + ((LAST - FIRST) << PARTS) as usize,
    "one below the first doubling, one above the last"
);

payload! {
    /// A histogram of durations, in ns of real time, since its writer was started.
    ///
    /// Each duration counts in one bucket (the counts are not cumulative). The edges are fixed:
    ///
    /// ```text
    ///  bucket      holds durations in ns
    ///  0           0 to 256
    ///  1 to 4      above 256 to 320, 384, 448 and 512
    ///  5 to 8      above 512 to 640, 768, 896 and 1024
    ///  ...         each doubling in four equal parts
    ///  85 to 88    above 2^29 to 2^29 * 5/4, 2^29 * 6/4, 2^29 * 7/4 and 2^30
    ///  89          above 2^30, about 1.07 s
    /// ```
    ///
    /// For `i` from 1 to 88 the upper end is `(5 + (i - 1) % 4) << (6 + (i - 1) / 4)`. A duration
    /// equal to it counts in the bucket ([`Durations::upper_ns`]). Every fourth upper end, from
    /// bucket 0 on, is a power of two, so four buckets can be added up to one. JSON leaves out the
    /// empty buckets at the end.
    pub struct Durations: 744 bytes {
        /// How many durations were counted: the sum of all buckets.
        pub count: u64,
        /// Their sum.
        pub sum_ns: u64,
        /// The longest.
        pub max_ns: u64,
        /// How many fell into each bucket.
        #[serde(with = "lager_sample::list")]
        pub buckets: [u64; 90],
    }
}

payload! {
    /// How long each sensor frame, `sensor/line` and `sensor/distance`, takes to logic's decision,
    /// whether the decision changes anything or not.
    ///
    /// ```text
    ///  bridge's reader          logic
    ///  read --> publish ~~wake~~> receive --> decided
    ///   read_publish | publish_receive | decide |
    ///   |<-------------- total --------------->|
    /// ```
    ///
    /// Frames that were lost on the bus, or that came while logic was away, do not count.
    pub struct PathLatency: 2976 bytes {
        /// From the `read` of the frame's last bytes to its publication.
        pub read_publish: Durations,
        /// From that publication until logic has received the frame: logic's wake-up.
        pub publish_receive: Durations,
        /// From that moment until logic ends the turn in which it received the frame: it has
        /// decided on all frames that were there, and has sent the orders that follow.
        pub decide: Durations,
        /// The three together: from the `read` until logic has decided.
        pub total: Durations,
    }
}

payload! {
    /// How long logic's orders take to the steering board's wire.
    ///
    /// ```text
    ///  bridge's reader          logic                bridge's main loop
    ///  read --> publish ~~~~~~> receive --> publish ~~wake~~> receive --> written
    ///                                            | order_receive | receive_write |
    ///   |<------------------------------- total -------------------------------->|
    /// ```
    ///
    /// A renewal carries the times of the newest frame on which logic had decided. It counts as a
    /// received order. It causes no write: the bridge repeats the command in force by itself.
    pub struct CommandLatency: 2232 bytes {
        /// From the publication of an order that follows from a sensor frame until the bridge has
        /// received it: its main loop's wake-up. Renewals and refused orders count too.
        pub order_receive: Durations,
        /// From that moment until the command is written. This counts the first write of an order
        /// that a sensor frame has caused, if the arbiter put the order in force and wrote it at
        /// once. Orders that were refused, replaced or held back do not count.
        pub receive_write: Durations,
        /// For the same orders: from the `read` of the frame's last bytes until the command is
        /// written.
        pub total: Durations,
    }
}

impl Durations {
    /// The longest duration that counts in a bucket, in ns; `None` for the last bucket, which has
    /// no end.
    pub const fn upper_ns(bucket: usize) -> Option<u64> {
        match bucket {
            0 => Some(1 << FIRST),
            bucket if bucket < BUCKETS - 1 => {
                let (doubling, part) = ((bucket - 1) >> PARTS, (bucket - 1) % (1 << PARTS));
                Some(((1 << PARTS) + part as u64 + 1) << (doubling as u32 + FIRST - PARTS))
            }
            _ => None,
        }
    }

    /// The bucket in which a duration counts.
    const fn bucket(duration_ns: u64) -> usize {
        if duration_ns <= 1 << FIRST {
            return 0;
        }
        if duration_ns > 1 << LAST {
            return BUCKETS - 1;
        }
        // An upper end belongs to the bucket below.
        let below = duration_ns - 1;
        let doubling = below.ilog2();
        let part = (below >> (doubling - PARTS)) % (1 << PARTS);
        1 + ((doubling - FIRST) << PARTS) as usize + part as usize
    }

    /// Counts a duration, in ns.
    pub fn record(&mut self, duration_ns: u64) {
        self.count += 1;
        self.sum_ns = self.sum_ns.saturating_add(duration_ns);
        self.max_ns = self.max_ns.max(duration_ns);
        self.buckets[Self::bucket(duration_ns)] += 1;
    }

    /// The durations counted after `earlier`, a sample of the same writer; all of them if the
    /// writer was restarted in between.
    ///
    /// The longest of these is not known exactly: `max_ns` is the upper end of its bucket, or the
    /// longest of all durations if that is shorter.
    pub fn since(&self, earlier: &Self) -> Self {
        let mut after = *self;
        let mut highest = None;
        for (bucket, (after, earlier)) in after.buckets.iter_mut().zip(&earlier.buckets).enumerate()
        {
            let Some(new) = after.checked_sub(*earlier) else {
                return *self;
            };
            *after = new;
            if new > 0 {
                highest = Some(bucket);
            }
        }
        after.count = self.count.saturating_sub(earlier.count);
        after.sum_ns = self.sum_ns.saturating_sub(earlier.sum_ns);
        after.max_ns = highest.map_or(0, |highest| {
            Self::upper_ns(highest).map_or(self.max_ns, |upper| upper.min(self.max_ns))
        });
        after
    }

    /// The duration in ns that the share `part` of all durations did not exceed. `part` is 0 to 1:
    /// 0.5 gives the median. 0 if nothing was counted.
    ///
    /// It is interpolated within its bucket, which ends at most a quarter above its lower end.
    pub fn quantile_ns(&self, part: f64) -> u64 {
        let counted = self.buckets.iter().sum::<u64>();
        let rank = ((part * counted as f64).ceil() as u64).clamp(1, counted.max(1));
        let (mut below, mut lower_ns) = (0, 0);
        for (bucket, count) in self.buckets.iter().enumerate() {
            let upper_ns = Self::upper_ns(bucket).unwrap_or(self.max_ns);
            if below + count >= rank {
                let width = u128::from(upper_ns.saturating_sub(lower_ns));
                let inside = width * u128::from(rank - below) / u128::from(*count);
                return self.max_ns.min(lower_ns + inside as u64);
            }
            (below, lower_ns) = (below + count, upper_ns);
        }
        0
    }

    /// The same far out in the tail, such as 0.999. `None` if fewer than ten durations lie beyond it:
    /// it would be little more than the longest by another name.
    pub fn tail_ns(&self, part: f64) -> Option<u64> {
        let beyond = self.buckets.iter().sum::<u64>() as f64 * (1.0 - part);
        // A part such as 0.999 is not exact in binary.
        (beyond + 1e-6 >= BEYOND as f64).then(|| self.quantile_ns(part))
    }

    /// The mean, in ns; 0 if nothing was counted.
    pub fn mean_ns(&self) -> u64 {
        self.sum_ns.checked_div(self.count).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(durations: impl IntoIterator<Item = u64>) -> Durations {
        let mut counted = Durations::default();
        for duration in durations {
            counted.record(duration);
        }
        counted
    }

    #[test]
    fn each_bucket_holds_what_is_above_the_one_before_up_to_its_own_end() {
        let upper: Vec<u64> = (0..BUCKETS).map_while(Durations::upper_ns).collect();
        assert_eq!(upper.len(), BUCKETS - 1);
        assert_eq!(upper[..6], [256, 320, 384, 448, 512, 640]);
        assert_eq!(upper[BUCKETS - 2], 1 << 30);
        for (bucket, upper) in upper.into_iter().enumerate() {
            assert_eq!(Durations::bucket(upper), bucket);
            assert_eq!(Durations::bucket(upper + 1), bucket + 1);
            if bucket > 0 {
                let formula = (5 + (bucket as u64 - 1) % 4) << (6 + (bucket - 1) / 4);
                assert_eq!(upper, formula, "the documented one");
            }
        }
        assert_eq!(Durations::bucket(0), 0);
        assert_eq!(Durations::bucket(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn sum_count_and_longest_are_exact() {
        let counted = of([0, 300, 5_000, 3_000_000_000]);
        assert_eq!(
            (counted.count, counted.sum_ns, counted.max_ns),
            (4, 3_000_005_300, 3_000_000_000)
        );
        assert_eq!(counted.buckets.iter().sum::<u64>(), 4);
        assert_eq!(counted.mean_ns(), 750_001_325);
    }

    #[test]
    fn quantiles_are_as_near_as_their_bucket_is_narrow() {
        // 1 to 10 000 us in no order: 7919 is a prime.
        let counted = of((0..10_000).map(|step| (step * 7_919 % 10_000 + 1) * 1_000));
        for (part, true_ns) in [
            (0.5, 5_000_000),
            (0.9, 9_000_000),
            (0.99, 9_900_000),
            (0.999, 9_990_000),
            (1.0, 10_000_000),
        ] {
            let told: u64 = counted.quantile_ns(part);
            assert!(
                told.abs_diff(true_ns) <= true_ns / 16,
                "{told} for {true_ns}"
            );
        }
        assert_eq!(of([700]).quantile_ns(0.5), 700, "never beyond the longest");
        assert_eq!(of([3_000_000_000]).quantile_ns(0.5), 3_000_000_000);
        assert_eq!(Durations::default().quantile_ns(0.99), 0);
        assert_eq!(Durations::default().mean_ns(), 0);
    }

    #[test]
    fn a_tail_needs_ten_durations_beyond_it() {
        let many = |count: u64| of((0..count).map(|_| 7_000));
        assert_eq!(many(10_000).tail_ns(0.999), Some(7_000));
        assert_eq!(many(9_999).tail_ns(0.999), None);
        assert_eq!(many(0).tail_ns(0.5), None);
    }

    #[test]
    fn the_difference_of_two_samples_is_what_came_between() {
        let before = of([1_000, 9_000_000]);
        let mut after = before;
        after.record(1_500);
        after.record(1_500);
        let between = after.since(&before);
        assert_eq!(
            (between.count, between.sum_ns, between.max_ns),
            (2, 3_000, 1_536)
        );
        assert_eq!(between.buckets, of([1_500, 1_500]).buckets);
        assert_eq!(after.since(&after).count, 0);
        assert_eq!(after.since(&after).max_ns, 0);
        let restarted = of([1_500]);
        assert_eq!(restarted.since(&before), restarted);
    }
}
