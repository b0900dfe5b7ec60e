//! [`Rhythm`]: learns from rings when looking without pause is worth it (`Policy::Adaptive`).
//!
//! ```text
//!     ring ─────── sleep ───────┬──────────── look ──────────────┬── sleep ──▶
//!                               │             ▲                  │
//!        mean - 2 deviations - lead      the usual ring   2 means + 4 deviations + margin,
//!                                                         at most the longest spin
//! ```
//!
//! A waiter may look without pause only after a streak of rings that came close to each other. A
//! distance that is too long halves the streak. A look that catches no ring also halves it, and
//! doubles the streak that is needed next time. So a quiet unit sleeps, a stream that ends costs
//! one useless look, and a single late ring is forgiven. A waiter that takes the core from the
//! writer it waits for soon stops looking. Between two rings the waiter sleeps until one is due,
//! which leaves the core to others.
//!
//! **Invariant:** pure: the clock is an argument, in nanoseconds, and the answer is a plan.

/// The shortest and the longest streak of rings that may be needed before looking is allowed. No
/// longer streak is counted.
const EASY: u32 = 4;
const HARD: u32 = 256;

/// Added to the learnt end of a look. A ring is late more often than early, and a missed ring costs
/// a sleep and a wake.
const MARGIN_NS: u64 = 100_000;

/// A short sleep ends this much earlier than the ring is due, because waking takes time, most of
/// all on a core that has halted.
const LEAD_NS: u64 = 130_000;

/// A shorter sleep between two rings is not worth its two system calls.
const SHORTEST_NAP_NS: u64 = 200_000;

/// What to do until the next ring. Times are absolute, in ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Plan {
    /// Sleep: no ring is due soon.
    Sleep,
    /// Sleep until `from`, if that is in the future, then look until `until`.
    Look { from: u64, until: u64 },
}

/// The knowledge about one waiter's rings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rhythm {
    longest_ns: u64,
    last_ns: Option<u64>,
    /// The mean distance in the present streak.
    mean_ns: u64,
    deviation_ns: u64,
    streak: u32,
    needed: u32,
}

impl Rhythm {
    /// Knows nothing yet. A look never lasts longer than `longest_ns` after a ring.
    pub(crate) fn new(longest_ns: u64) -> Self {
        Self {
            longest_ns,
            last_ns: None,
            mean_ns: 0,
            deviation_ns: 0,
            streak: 0,
            needed: EASY,
        }
    }

    /// Whether the streak is long enough to look.
    pub(crate) fn is_quick(&self) -> bool {
        self.streak >= self.needed
    }

    /// To be called when it has rung.
    pub(crate) fn rung(&mut self, now_ns: u64) {
        let gap = self.last_ns.map(|last| now_ns.saturating_sub(last));
        self.last_ns = Some(now_ns);
        match gap {
            Some(gap) if gap <= self.longest_ns => self.learn(gap),
            Some(_) => self.streak /= 2,
            None => (),
        }
    }

    /// To be called if it had rung before the waiter began to wait. No distance can be learnt, but
    /// the next one counts from now.
    pub(crate) fn touched(&mut self, now_ns: u64) {
        self.last_ns = Some(now_ns);
    }

    fn learn(&mut self, gap: u64) {
        self.streak = (self.streak + 1).min(HARD);
        if self.streak == 1 {
            self.mean_ns = gap;
            self.deviation_ns = gap / 4;
            return;
        }
        // Learnt like round-trip times (RFC 6298), with gains of 1/8 and 1/4.
        let off = gap.abs_diff(self.mean_ns);
        self.deviation_ns = (3 * self.deviation_ns + off) / 4;
        self.mean_ns = (7 * self.mean_ns + gap) / 8;
    }

    /// What to do now.
    pub(crate) fn plan(&self, now_ns: u64) -> Plan {
        let Some(last) = self.last_ns.filter(|_| self.is_quick()) else {
            return Plan::Sleep;
        };
        let until =
            (2 * self.mean_ns + 4 * self.deviation_ns + MARGIN_NS).min(self.longest_ns) + last;
        if now_ns >= until {
            return Plan::Sleep;
        }
        let early = self.mean_ns.saturating_sub(2 * self.deviation_ns + LEAD_NS) + last;
        let from = if early >= now_ns + SHORTEST_NAP_NS {
            early
        } else {
            now_ns
        };
        Plan::Look { from, until }
    }

    /// To be called when a look has caught a ring.
    pub(crate) fn caught(&mut self) {
        self.needed = (self.needed - 1).max(EASY);
    }

    /// To be called when the waiter has looked to the end of the plan and caught no ring.
    pub(crate) fn in_vain(&mut self) {
        self.streak /= 2;
        self.needed = (self.needed * 2).min(HARD);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// A rhythm after `rings` rings at the distance `gap`, and the time of the last ring.
    fn after(rings: u64, gap: u64) -> (Rhythm, u64) {
        let mut rhythm = Rhythm::new(2 * MS);
        let mut now = 0;
        for _ in 0..rings {
            now += gap;
            rhythm.rung(now);
        }
        (rhythm, now)
    }

    #[test]
    fn a_newcomer_and_a_quiet_unit_sleep() {
        assert_eq!(Rhythm::new(2 * MS).plan(0), Plan::Sleep);
        let (rhythm, now) = after(1000, 5 * MS);
        assert_eq!(rhythm.plan(now), Plan::Sleep);
    }

    #[test]
    fn close_rings_are_looked_for_until_a_little_after_they_are_due() {
        let (rhythm, now) = after(100, 100_000);
        let Plan::Look { from, until } = rhythm.plan(now) else {
            panic!("it looks")
        };
        assert_eq!(from, now, "too short for a nap");
        assert!((now + 200_000..now + 500_000).contains(&until));
    }

    #[test]
    fn rings_a_millisecond_apart_leave_time_for_a_nap() {
        let (rhythm, now) = after(100, MS);
        let Plan::Look { from, until } = rhythm.plan(now) else {
            panic!("it looks")
        };
        assert!((now + MS / 2..now + MS).contains(&from));
        assert_eq!(until, now + 2 * MS);
        // But not when the ring is nearly due.
        let late = from - 1000;
        assert_eq!(rhythm.plan(late), Plan::Look { from: late, until });
    }

    #[test]
    fn it_never_looks_longer_than_allowed_after_a_ring() {
        let (mut rhythm, mut now) = after(20, MS);
        for gap in [MS / 10, 2 * MS, MS / 10, 2 * MS] {
            now += gap;
            rhythm.rung(now);
            if let Plan::Look { until, .. } = rhythm.plan(now) {
                assert!(until <= now + 2 * MS);
            }
        }
        assert_eq!(rhythm.plan(now + 2 * MS), Plan::Sleep);
    }

    #[test]
    fn a_ring_that_is_overdue_is_slept_for() {
        let (rhythm, now) = after(100, 100_000);
        assert_eq!(rhythm.plan(now + MS), Plan::Sleep);
    }

    #[test]
    fn looking_in_vain_makes_it_harder_each_time() {
        let (mut rhythm, mut now) = after(5, 100_000);
        let mut heard_until_it_looks = Vec::new();
        for _ in 0..12 {
            rhythm.in_vain();
            let mut heard = 0;
            while rhythm.plan(now) == Plan::Sleep {
                now += 100_000;
                rhythm.rung(now);
                heard += 1;
            }
            heard_until_it_looks.push(heard);
        }
        assert_eq!(&heard_until_it_looks[..4], [6, 12, 24, 48]);
        assert_eq!(heard_until_it_looks.last(), Some(&128));
        // And each catch makes it easier again.
        for _ in 0..2000 {
            rhythm.caught();
        }
        assert_eq!(rhythm.needed, EASY);
    }

    #[test]
    fn a_late_ring_among_many_is_forgiven() {
        let (mut rhythm, now) = after(1000, 100_000);
        rhythm.in_vain();
        assert_ne!(rhythm.plan(now), Plan::Sleep);
    }

    #[test]
    fn long_distances_end_the_streak() {
        let (mut rhythm, mut now) = after(9, 100_000);
        now += 3 * MS;
        rhythm.rung(now);
        assert_ne!(rhythm.plan(now), Plan::Sleep, "one is forgiven");
        now += 3 * MS;
        rhythm.rung(now);
        assert_eq!(rhythm.plan(now), Plan::Sleep);
    }

    #[test]
    fn pairs_of_rings_at_long_distances_are_slept_for() {
        let mut rhythm = Rhythm::new(2 * MS);
        for round in 0..1000 {
            rhythm.rung(round * 5 * MS);
            assert_eq!(rhythm.plan(round * 5 * MS), Plan::Sleep);
            rhythm.rung(round * 5 * MS + 50_000);
            assert_eq!(rhythm.plan(round * 5 * MS + 50_000), Plan::Sleep);
        }
    }

    #[test]
    fn a_bound_of_zero_never_looks() {
        let mut rhythm = Rhythm::new(0);
        for now in 0..100 {
            rhythm.rung(now);
            assert_eq!(rhythm.plan(now), Plan::Sleep);
        }
    }
}
