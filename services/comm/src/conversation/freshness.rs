//! Finds out how old a line of the station may be.
//!
//! ```text
//!   robot    lager 1 r1 81250 ──┐                       do 17 ... is at most now - 81250 ms old
//!                               │                                   ▲
//!   station                     └─> lager 1 station 81250, do 17 ───┘
//! ```
//!
//! Lines arrive in the order in which they were sent. So a line that comes after the answer to a
//! sign was sent after that sign. The difference contains all delays of the link, the sockets and
//! both processes. It is an upper limit and not a measurement: it also includes the time since the
//! sign.
//!
//! If a peer does not repeat the clock, only its silence tells something. A peer that speaks the
//! extension answers each sign, so a line that ends a longer silence may have been under way for as
//! long.

use core::time::Duration;

use lager_orders::Moment;

use super::SILENT_MOVING;

/// What is known on one connection.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Freshness {
    /// The last clock of the robot that the station has repeated, in ms.
    echoed_ms: Option<u64>,
    /// The silence before the present lines, if it was longer than the time between two signs.
    silent: Duration,
}

impl Freshness {
    /// A line comes after this silence.
    pub(super) fn after_silence(&mut self, silent: Duration, is_extended: bool) {
        let is_long = is_extended && silent >= Duration::from_nanos(SILENT_MOVING);
        self.silent = if is_long { silent } else { Duration::ZERO };
    }

    /// The station answers a sign. A clock that this robot has not sent yet does not count.
    pub(super) fn echoed(&mut self, now: Moment, clock_ms: Option<u64>) {
        let shown = clock_ms.filter(|clock_ms| *clock_ms <= now.clock_ms());
        self.echoed_ms = self.echoed_ms.max(shown);
    }

    /// Whether this station's lines have a known age.
    pub(super) const fn is_told(&self) -> bool {
        self.echoed_ms.is_some()
    }

    /// How long ago a line that is read now was sent, at most.
    pub(super) fn late(&self, now: Moment) -> Duration {
        let since = |echoed_ms| Duration::from_millis(now.clock_ms().saturating_sub(echoed_ms));
        self.echoed_ms.map_or(self.silent, since)
    }
}
