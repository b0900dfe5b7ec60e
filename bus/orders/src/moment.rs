//! [`Moment`]: the time that the pure state machines take as an argument.

use core::time::Duration;

/// A moment on both clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moment {
    /// The robot's time, in which leases and deadlines count.
    pub robot: Duration,
    /// Real time in ns of `CLOCK_MONOTONIC`, in which links, and the stamps of samples, count.
    pub ns: u64,
}

impl Moment {
    /// Real time in ms, as in the robot's samples.
    pub const fn clock_ms(self) -> u64 {
        self.ns / 1_000_000
    }

    /// When an order was given that comes so `late`, in ns of real time.
    pub fn given_ns(self, late: Duration) -> u64 {
        let late_ns = u64::try_from(late.as_nanos()).unwrap_or(u64::MAX);
        // 0 means that the time is not known.
        self.ns.saturating_sub(late_ns).max(1)
    }
}
