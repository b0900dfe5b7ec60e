//! [`Limit`]: how many samples a second of a topic a gateway sends.
//!
//! ```text
//!              a stream                          a state
//!   due        is sent                           is sent
//!   not due    is left out and counted           is held; what was held before is left out
//! ```
//!
//! So a listener always gets a state's last value, at the latest when it is due.
//!
//! **Law:** sent + left out + held = offered. The tests hold it for any rate and any times.

/// What becomes of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is sent now.
    Send,
    /// It is kept until it is due, in place of the sample that was kept before.
    Hold,
    /// It is left out.
    LeaveOut,
}

/// The limit of one topic.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limit {
    /// The time between two samples in ns; `None` if all are sent.
    apart_ns: Option<u64>,
    is_state: bool,
    /// When the next sample may be sent.
    due_ns: u64,
    holds: bool,
    left_out: u64,
}

impl Limit {
    /// At most `hz` samples a second, which is above 0; `None` for all of them.
    pub fn new(hz: Option<f64>, is_state: bool) -> Self {
        Self {
            // A rate that is too low for a number of ns is one sample in 584 years.
            apart_ns: hz.map(|hz| (1e9 / hz) as u64),
            is_state,
            ..Self::default()
        }
    }

    /// Whether there is a limit at all.
    pub fn is_set(&self) -> bool {
        self.apart_ns.is_some()
    }

    /// How many samples have been left out.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Decides on a sample that was published at `published_ns`.
    pub fn offer(&mut self, published_ns: u64) -> Verdict {
        let Some(apart_ns) = self.apart_ns else {
            return Verdict::Send;
        };
        if published_ns >= self.due_ns {
            // This sample is newer than the one that was held.
            self.left_out += u64::from(std::mem::take(&mut self.holds));
            self.sent(published_ns, apart_ns);
            return Verdict::Send;
        }
        if self.is_state {
            self.left_out += u64::from(std::mem::replace(&mut self.holds, true));
            return Verdict::Hold;
        }
        self.left_out += 1;
        Verdict::LeaveOut
    }

    /// Whether the sample that is held is due now, at `now_ns`. If so, it counts as sent.
    pub fn is_due(&mut self, now_ns: u64) -> bool {
        let is_due = self.holds && now_ns >= self.due_ns;
        if let Some(apart_ns) = self.apart_ns.filter(|_| is_due) {
            self.holds = false;
            self.sent(now_ns, apart_ns);
        }
        is_due
    }

    /// The next time keeps the rate: a sample that is a little late does not delay the next one.
    fn sent(&mut self, at_ns: u64, apart_ns: u64) {
        let next = self.due_ns.saturating_add(apart_ns);
        self.due_ns = match next > at_ns {
            true => next,
            false => at_ns.saturating_add(apart_ns),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn without_a_limit_all_are_sent() {
        let mut limit = Limit::new(None, true);
        assert!(!limit.is_set());
        for at in [0, 0, 5, 3] {
            assert_eq!(limit.offer(at), Verdict::Send);
            assert!(!limit.is_due(u64::MAX));
        }
        assert_eq!(limit.left_out(), 0);
    }

    #[test]
    fn a_stream_of_100_hz_comes_10_times_a_second() {
        let mut limit = Limit::new(Some(10.0), false);
        // Each a little early or late.
        let times = (0..1_000_u64).map(|n| 10 * MS * (n + 1) + n % 3 * MS);
        let sent = times.filter(|at| limit.offer(*at) == Verdict::Send).count();
        assert!((99..=101).contains(&sent), "{sent}");
        assert_eq!(limit.left_out(), 1_000 - sent as u64);
    }

    #[test]
    fn the_last_value_of_a_state_is_sent_when_it_is_due() {
        let mut limit = Limit::new(Some(10.0), true);
        assert_eq!(limit.offer(1_000 * MS), Verdict::Send);
        assert_eq!(limit.offer(1_010 * MS), Verdict::Hold);
        assert_eq!(limit.offer(1_020 * MS), Verdict::Hold);
        assert_eq!(limit.left_out(), 1, "the first of both that were held");
        assert!(!limit.is_due(1_099 * MS));
        assert!(limit.is_due(1_100 * MS));
        assert!(!limit.is_due(5_000 * MS), "it is sent once");
        assert_eq!(limit.left_out(), 1);
    }

    #[test]
    fn a_clock_that_goes_back_and_a_rate_that_is_tiny_harm_nobody() {
        let mut limit = Limit::new(Some(f64::MIN_POSITIVE), false);
        assert_eq!(limit.offer(u64::MAX), Verdict::Send);
        assert_eq!(limit.offer(0), Verdict::LeaveOut);
    }

    proptest! {
        #[test]
        fn what_is_offered_is_sent_left_out_or_held(
            hz in 0.1_f64..2_000.0,
            is_state in any::<bool>(),
            steps in proptest::collection::vec((0_u64..30 * MS, any::<bool>()), 0..300),
        ) {
            let mut limit = Limit::new(Some(hz), is_state);
            let (mut now, mut offered, mut sent, mut held) = (0, 0_u64, 0_u64, false);
            for (step, is_sample) in steps {
                now += step;
                if is_sample {
                    offered += 1;
                    match limit.offer(now) {
                        Verdict::Send => { sent += 1; held = false; }
                        Verdict::Hold => { prop_assert!(is_state); held = true; }
                        Verdict::LeaveOut => prop_assert!(!is_state),
                    }
                } else if limit.is_due(now) {
                    prop_assert!(held);
                    sent += 1;
                    held = false;
                }
                prop_assert_eq!(sent + limit.left_out() + u64::from(held), offered);
            }
            // Never more than the rate, but for the first ones.
            prop_assert!(sent as f64 <= now as f64 / 1e9 * hz + 2.0);
        }
    }
}
