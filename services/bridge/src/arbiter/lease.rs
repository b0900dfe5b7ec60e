//! How long an order counts: its lease, which begins again with each renewal by its origin.
//!
//! This file stands apart because orders and permissions both use it. It knows nothing of either.

use core::time::Duration;

use lager_orders::lease::SETPOINT;

/// How long an order in force still holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lease {
    /// Until this moment.
    Until(Duration),
    /// Taken over from an earlier bridge: nothing is written for it until its origin renews it, and
    /// it lapses at this moment. For a one-shot, which is only looked for in the board's reports,
    /// the time counts from the first `advance`.
    Unclaimed(Option<Duration>),
}

impl Lease {
    pub(super) fn is_over(self, now: Duration) -> bool {
        self.end().is_some_and(|end| end <= now)
    }

    pub(super) fn end(self) -> Option<Duration> {
        match self {
            Self::Until(end) => Some(end),
            Self::Unclaimed(end) => end,
        }
    }

    pub(super) fn renew(&mut self, received: Duration) {
        let end = received + SETPOINT;
        *self = match *self {
            Self::Until(earlier) => Self::Until(earlier.max(end)),
            Self::Unclaimed(_) => Self::Until(end),
        };
    }

    /// Gives a lease that was taken over its end, counted from the first moment that the arbiter
    /// knows.
    pub(super) fn start(&mut self, now: Duration) {
        if *self == Self::Unclaimed(None) {
            *self = Self::Unclaimed(Some(now + SETPOINT));
        }
    }
}
