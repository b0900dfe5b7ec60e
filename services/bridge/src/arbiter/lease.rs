//! How long an order counts: the lease, from the last renewal by its origin.
//!
//! It is apart from the arbiter because orders and grants both use it; it knows nothing of either.

use core::time::Duration;

/// How long an order holds after its origin's last renewal, in robot time.
pub const LEASE: Duration = Duration::from_millis(120);

/// How long an order in force still holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lease {
    /// Until this moment.
    Until(Duration),
    /// Taken up from an earlier life of the bridge: nothing is written for it until its origin
    /// renews it, and it lapses at this moment. That of what is only looked for in the board's
    /// reports is counted from the first `advance`.
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
        let end = received + LEASE;
        *self = match *self {
            Self::Until(earlier) => Self::Until(earlier.max(end)),
            Self::Unclaimed(_) => Self::Until(end),
        };
    }

    /// Gives an unclaimed lease its end, counted from the first moment the arbiter is told.
    pub(super) fn start(&mut self, now: Duration) {
        if *self == Self::Unclaimed(None) {
            *self = Self::Unclaimed(Some(now + LEASE));
        }
    }
}
