//! Decides when a service that has ended starts again, and when that is hopeless. Pure: times are
//! real time since some moment.
//!
//! ```text
//!   it has ended           the next start
//!   after 1 s or more      at once
//!   sooner                 after 50, 100, 200 .. 5000 ms
//! ```
//! If a service ends by itself five times in a row, each time in less than 1 s, another start is
//! hopeless. A service that somebody has killed is always started again.

use std::time::Duration;

/// A child that lived this long was healthy: it starts again at once.
const HEALTHY: Duration = Duration::from_secs(1);
/// The first wait after a child that ended at once; each further wait is twice as long.
const FIRST_WAIT: Duration = Duration::from_millis(50);
/// The longest wait between two starts.
const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// A child that lived this long started well.
const SETTLED: Duration = Duration::from_secs(30);
/// How often in a row a child may end by itself sooner than that.
const MOST_FAILURES: u32 = 5;

/// The starts of one service.
#[derive(Debug, Default)]
pub(crate) struct Backoff {
    wait: Duration,
    /// How often in a row it has ended by itself sooner than that.
    failures: u32,
    start_at: Duration,
}

impl Backoff {
    /// It ended at `now` after this life; sets the next start.
    pub(crate) fn ended(&mut self, now: Duration, lived: Duration, by_itself: bool) {
        self.wait = if lived >= HEALTHY {
            Duration::ZERO
        } else {
            (self.wait * 2).clamp(FIRST_WAIT, LONGEST_WAIT)
        };
        self.failures = match by_itself && lived < SETTLED {
            true => self.failures + 1,
            false => 0,
        };
        self.start_at = now + self.wait;
    }

    /// How long to wait until the next start.
    pub(crate) fn left(&self, now: Duration) -> Duration {
        self.start_at.saturating_sub(now)
    }

    /// Whether it ends by itself at every start.
    pub(crate) fn is_hopeless(&self) -> bool {
        self.failures >= MOST_FAILURES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_healthy_child_is_started_at_once_and_others_later_and_later() {
        let mut backoff = Backoff::default();
        let now = Duration::from_secs(100);
        let mut waits = Vec::new();
        for _ in 0..9 {
            backoff.ended(now, 5 * MS, false);
            waits.push(backoff.left(now).as_millis());
        }
        assert_eq!(waits, [50, 100, 200, 400, 800, 1_600, 3_200, 5_000, 5_000]);
        assert_eq!(backoff.left(now + LONGEST_WAIT), Duration::ZERO);
        backoff.ended(now, HEALTHY, false);
        assert_eq!(backoff.left(now), Duration::ZERO);
        backoff.ended(now, 5 * MS, false);
        assert_eq!(backoff.left(now), FIRST_WAIT, "it begins anew");
    }

    #[test]
    fn only_who_ends_by_itself_at_every_start_is_hopeless() {
        let ended = |ends: &[(Duration, bool)]| {
            let mut backoff = Backoff::default();
            for (lived, by_itself) in ends {
                backoff.ended(Duration::ZERO, *lived, *by_itself);
            }
            backoff.is_hopeless()
        };
        let at_once = (5 * MS, true);
        assert!(!ended(&[at_once; 4]));
        assert!(ended(&[at_once; 5]));
        assert!(ended(&[(SETTLED - MS, true); 5]));
        assert!(!ended(&[(SETTLED, true); 99]));
        assert!(!ended(&[(5 * MS, false); 99]), "it was killed");
        let mut once_killed = [at_once; 9];
        once_killed[4] = (5 * MS, false);
        assert!(!ended(&once_killed));
    }
}
