//! The offset between the stamps' clock and the calendar.

use std::time::{SystemTime, UNIX_EPOCH};

use lager_ports::Clock;

/// What is added to a time of CLOCK_MONOTONIC to get ns since 1970, now. A recording takes it once,
/// so that a calendar that is set meanwhile does not bend it.
pub(crate) fn unix_offset_ns() -> i64 {
    let unix = SystemTime::now().duration_since(UNIX_EPOCH);
    let unix = unix.map_or(0, |since| since.as_nanos() as i64);
    unix - Clock::monotonic_ns() as i64
}

/// A stamp's time in ns since 1970.
pub(crate) fn to_unix(monotonic_ns: u64, offset_ns: i64) -> u64 {
    monotonic_ns.saturating_add_signed(offset_ns)
}
