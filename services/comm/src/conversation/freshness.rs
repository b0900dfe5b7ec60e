//! How old a line may be that the station has said.
//!
//! ```text
//!   robot    lager 1 r1 81250 ──┐                       do 17 ... is at most now - 81250 ms old
//!                               │                                   ▲
//!   station                     └─> lager 1 station 81250, do 17 ───┘
//! ```
//!
//! Lines arrive in the order in which they were said. So what comes behind the answer to a sign was
//! said after that sign, and how long link, sockets and both processes took is in the difference.
//! It is a bound and no measurement: it includes the time since the sign.
//!
//! A peer that does not repeat the clock leaves its silence: while it speaks the extension it
//! answers each sign, and what ends a silence that is longer may have been under way for as long.

use core::time::Duration;

use super::SILENT_MOVING;
use crate::moment::Moment;

/// What is known of it on one connection.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Freshness {
    /// The robot's clock in ms that the station has repeated last.
    echoed_ms: Option<u64>,
    /// How long it was silent before what comes now, if that was longer than between two signs.
    silent: Duration,
}

impl Freshness {
    /// Something comes after so long a silence.
    pub(super) fn after_silence(&mut self, silent: Duration, is_extended: bool) {
        let is_long = is_extended && silent >= Duration::from_nanos(SILENT_MOVING);
        self.silent = if is_long { silent } else { Duration::ZERO };
    }

    /// The station answers a sign. A clock that this robot has not shown yet is none of its signs.
    pub(super) fn echoed(&mut self, now: Moment, clock_ms: Option<u64>) {
        let shown = clock_ms.filter(|clock_ms| *clock_ms <= now.clock_ms());
        self.echoed_ms = self.echoed_ms.max(shown);
    }

    /// Whether this station tells how old its lines may be.
    pub(super) const fn is_told(&self) -> bool {
        self.echoed_ms.is_some()
    }

    /// How long ago what is read now was said, at most.
    pub(super) fn late(&self, now: Moment) -> Duration {
        let since = |echoed_ms| Duration::from_millis(now.clock_ms().saturating_sub(echoed_ms));
        self.echoed_ms.map_or(self.silent, since)
    }
}
