//! When the samples of a paced row are due, and when they are sent.
//!
//! ```text
//!   due       |    |    |    |    |    |    |    |      every `period`, whatever happens
//!   sent      |    |-------------- |  |  |  |  |    |   a stall: all that were due meanwhile follow
//!                   answered late ─┘
//! ```
//!
//! A real sensor does not wait for a stalled receiver. So each sample keeps the time at which it was
//! due, also if it is sent later because the one before it was not yet answered, and nothing that was
//! due is left out: a stall of 50 ms at 10 kHz makes 500 samples late, not one.
//!
//! - **response time**: from when a sample was due until it had its effect. Who waits for it has this.
//! - **service time**: from when it was sent. The software takes this for one sample.

/// The plan of a paced row; times in ns of one clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    /// When the next sample is due.
    due: u64,
    period: u64,
    /// The least time from an answer to the next sample.
    rest: u64,
    /// No sample is sent before.
    earliest: u64,
}

impl Plan {
    /// A sample is due at `first`, and then every `period`. One that is late is sent at once, but not
    /// before `rest` has passed since the answer to the one before it.
    pub(crate) const fn new(first: u64, period: u64, rest: u64) -> Self {
        Self {
            due: first,
            period,
            rest,
            earliest: first,
        }
    }

    /// When the next sample is due, and when it is to be sent.
    pub(crate) fn next(&mut self) -> Due {
        let due = self.due;
        self.due += self.period;
        Due {
            due,
            send: due.max(self.earliest),
        }
    }

    /// The last sample was answered.
    pub(crate) const fn answered(&mut self, at: u64) {
        self.earliest = at + self.rest;
    }
}

/// A sample of a plan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Due {
    /// When it is due.
    pub(crate) due: u64,
    /// When it is to be sent: then, or later if those before it are late.
    pub(crate) send: u64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rounds::Taken;
    use crate::stats::Distribution;

    const MS: u64 = 1_000_000;

    /// What a sender finds that plans so, if each sample takes `service`, and the receiver stands
    /// still for `stall` when sample `at` comes; all in ns.
    fn taken(period: u64, samples: u64, service: u64, (at, stall): (u64, u64)) -> Taken {
        let mut plan = Plan::new(period, period, 0);
        let mut taken = Taken::default();
        for number in 0..samples {
            let due = plan.next();
            let answered = due.send + service + if number == at { stall } else { 0 };
            taken.add(Some(due.due), due.send, answered);
            plan.answered(answered);
        }
        taken
    }

    #[test]
    fn a_stall_hurts_each_sample_that_was_due_meanwhile() {
        // 100 Hz for a minute, and a stall of a second in the middle.
        let taken = taken(10 * MS, 6_000, 20_000, (3_000, 1_000 * MS));
        let late = |times: &[u64]| times.iter().filter(|time| **time >= 10 * MS).count();
        assert_eq!((late(&taken.service), late(&taken.response)), (1, 100));
        let response: Distribution = taken.response.iter().copied().collect();
        assert_eq!(response.quantiles().n, 6_000);
        let percentile = |percent| response.percentile(percent).unwrap();
        assert!(percentile(98.0) < MS / 10);
        assert!(percentile(99.0).abs_diff(395 * MS) <= 15 * MS);
        // Six samples lie beyond p99.9, which is too few for a figure.
        assert_eq!(response.percentile(99.9), None);
        assert_eq!(response.quantiles().max_ns, 1_000 * MS + 20_000);
    }

    #[test]
    fn a_stall_of_50_ms_at_10_khz_makes_about_500_samples_late() {
        let taken = taken(MS / 10, 20_000, 5_000, (9_000, 50 * MS));
        let late = taken.response.iter().filter(|time| **time > MS / 10);
        assert!((495..=540).contains(&late.count()));
    }

    #[test]
    fn what_keeps_to_its_plan_has_the_same_times_twice() {
        let taken = taken(MS, 1_000, 30_000, (0, 0));
        assert_eq!(taken.service, taken.response);
    }

    #[test]
    fn a_sample_waits_for_the_rest_after_an_answer_even_if_it_is_late() {
        let mut plan = Plan::new(1_000, 1_000, 600);
        assert_eq!(plan.next().send, 1_000);
        plan.answered(5_000);
        let [second, third] = [plan.next(), plan.next()];
        assert_eq!((second.due, second.send), (2_000, 5_600));
        assert_eq!((third.due, third.send), (3_000, 5_600));
        plan.answered(5_650);
        assert_eq!(plan.next().send, 6_250);
    }
}
