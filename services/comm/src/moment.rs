//! Time as the conversation takes it.

use core::time::Duration;

/// A moment on both clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moment {
    /// The robot's time: leases count in it.
    pub robot: Duration,
    /// Real time, in ns of `CLOCK_MONOTONIC`: links live in it.
    pub ns: u64,
}
