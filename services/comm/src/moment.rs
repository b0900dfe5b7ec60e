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

impl Moment {
    /// Real time in ms, as the robot's signs tell it.
    pub(crate) const fn clock_ms(self) -> u64 {
        self.ns / 1_000_000
    }

    /// When something was given that comes so late, in ns of real time.
    pub(crate) fn given_ns(self, late: Duration) -> u64 {
        let late_ns = u64::try_from(late.as_nanos()).unwrap_or(u64::MAX);
        // 0 stands for no time at all.
        self.ns.saturating_sub(late_ns).max(1)
    }
}
