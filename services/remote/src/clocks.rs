//! [`Clocks`]: how far apart the robot's clock and this machine's are, from round trips.
//!
//! ```text
//!   here    sent ──────────────────────── received        offset = robot - (sent + received) / 2
//!                  \                  /                    unsure = (received - sent) / 2
//!   robot           ────── robot ────
//! ```
//!
//! The answer was given at some moment between `sent` and `received`, so the true offset is at most
//! `unsure` away, whatever the ways there and back have taken. The best round trip is kept. Quartz
//! clocks drift apart, so it becomes less sure with time, until another one is better.
//!
//! **Law:** the true offset is within `unsure` of what is told. The tests hold it for any ways.

/// By how much two clocks drift apart at most, in ns for each ms: 200 parts in a million. Ordinary
/// quartz has 50, and Linux slews a clock by at most 500 of which a machine rarely uses a tenth.
const DRIFT_NS_PER_MS: u64 = 200;

/// What has to be added to this machine's clock for the robot's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Offset {
    /// In ns.
    pub ns: i64,
    /// How far that may be wrong, in ns.
    pub unsure_ns: u64,
}

/// The round trips so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clocks {
    /// The best one, and when it was over by this machine's clock.
    best: Option<(Offset, u64)>,
}

impl Clocks {
    /// Takes a round trip: when it began and ended by this machine's clock, and the robot's clock
    /// between, all in ns.
    pub fn exchange(&mut self, sent_ns: u64, robot_ns: u64, received_ns: u64) {
        let took = received_ns.saturating_sub(sent_ns);
        let middle = sent_ns.saturating_add(took / 2);
        let offset = Offset {
            ns: robot_ns.wrapping_sub(middle).cast_signed(),
            // Also for what the halves have lost.
            unsure_ns: (took / 2).saturating_add(1),
        };
        let is_better = |best: Offset| offset.unsure_ns <= best.unsure_ns;
        if self.offset(received_ns).is_none_or(is_better) {
            self.best = Some((offset, received_ns));
        }
    }

    /// The offset at this moment of this machine's clock in ns; `None` before the first round trip.
    pub fn offset(&self, here_ns: u64) -> Option<Offset> {
        let (best, at_ns) = self.best?;
        let drifted = here_ns.abs_diff(at_ns) / 1_000_000;
        let drifted = drifted.saturating_mul(DRIFT_NS_PER_MS);
        Some(Offset {
            unsure_ns: best.unsure_ns.saturating_add(drifted),
            ..best
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn the_best_round_trip_counts_until_it_is_too_old() {
        let mut clocks = Clocks::default();
        assert_eq!(clocks.offset(0), None);
        // 10 s ahead, 1 ms there and 1 ms back.
        clocks.exchange(S, 11 * S + 1_000_000, S + 2_000_000);
        let first = clocks.offset(S + 2_000_000).expect("an offset");
        assert_eq!((first.ns, first.unsure_ns), (10_000_000_000, 1_000_001));
        // A slower one tells less.
        clocks.exchange(2 * S, 12 * S + 9_000_000, 2 * S + 10_000_000);
        assert_eq!(clocks.offset(2 * S).expect("an offset").ns, first.ns);
        // A faster one tells more.
        clocks.exchange(3 * S, 13 * S + 1_000, 3 * S + 2_000);
        assert_eq!(
            clocks.offset(3 * S + 2_000).expect("an offset").unsure_ns,
            1_001
        );
        let old = clocks.offset(103 * S).expect("an offset");
        assert!(old.unsure_ns > 15_000_000, "{old:?}");
        // By then the slow one is the better one.
        clocks.exchange(103 * S, 113 * S, 103 * S + 10_000_000);
        assert_eq!(
            clocks
                .offset(103 * S + 10_000_000)
                .expect("an offset")
                .unsure_ns,
            5_000_001
        );
    }

    #[test]
    fn clocks_without_sense_harm_nobody() {
        let mut clocks = Clocks::default();
        clocks.exchange(u64::MAX, 0, 0);
        clocks.exchange(0, u64::MAX, u64::MAX);
        clocks.offset(0).expect("an offset");
    }

    proptest! {
        #[test]
        fn the_truth_is_within_what_is_told(
            ahead in -100_000_000_000_i64..100_000_000_000,
            drift in -150_i64..150,
            trips in proptest::collection::vec(
                (0_u64..5_000_000_000, 0_u64..50_000_000, 0_u64..50_000_000),
                1..20,
            ),
        ) {
            let start = 200 * S;
            // The robot's clock, which drifts by so many ns for each ms.
            let robot = |here: u64| {
                let since = here.saturating_sub(start) / 1_000_000;
                let offset = ahead + drift * since.cast_signed();
                (here.saturating_add_signed(offset), offset)
            };
            let (mut clocks, mut here) = (Clocks::default(), start);
            for (pause, there, back) in trips {
                let sent = here + pause;
                let (told, _) = robot(sent + there);
                here = sent + there + back;
                clocks.exchange(sent, told, here);
                let (offset, (_, truth)) = (clocks.offset(here).expect("a trip"), robot(here));
                // What the drift adds within one trip is less than this.
                let slack = 20_000;
                prop_assert!(offset.ns.abs_diff(truth) <= offset.unsure_ns + slack);
            }
        }
    }
}
