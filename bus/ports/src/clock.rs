//! The one clock of a process.
//!
//! Robot time is `CLOCK_MONOTONIC` times the speed of the body, so that leases, time-outs and a
//! simulated body agree at any speed and between processes. Stamps stay in real nanoseconds.

use core::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Robot time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    speed: f64,
}

impl Clock {
    /// A clock that runs `speed` times as fast as the wall's; the speed is positive and finite.
    pub(crate) const fn new(speed: f64) -> Self {
        Self { speed }
    }

    /// Robot time since the clock's origin, which all processes of a machine share.
    pub fn now(&self) -> Duration {
        self.at(Self::monotonic_ns())
    }

    /// Robot time at a moment of real time, in ns of `CLOCK_MONOTONIC`.
    pub fn at(&self, monotonic_ns: u64) -> Duration {
        let real = Duration::from_nanos(monotonic_ns);
        if self.speed == 1.0 {
            real
        } else {
            real.mul_f64(self.speed)
        }
    }

    /// How long a span of robot time lasts in real time.
    pub fn real(&self, robot: Duration) -> Duration {
        if self.speed == 1.0 {
            robot
        } else {
            robot.div_f64(self.speed)
        }
    }

    /// How many times faster than real time the robot lives.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// `CLOCK_MONOTONIC` in ns: real time, as in every stamp.
    pub fn monotonic_ns() -> u64 {
        let now = clock_gettime(ClockId::Monotonic);
        // The kernel's monotonic clock starts at 0 with the machine and is never negative.
        now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robot_time_runs_at_its_speed() {
        let clock = Clock::new(8.0);
        let before = Duration::from_nanos(Clock::monotonic_ns());
        let now = clock.now();
        let after = Duration::from_nanos(Clock::monotonic_ns());
        assert!(now >= before * 8 && now <= after * 8 + Duration::from_micros(1));
        assert_eq!(clock.at(1_000), Duration::from_micros(8));
        assert_eq!(
            clock.real(Duration::from_millis(40)),
            Duration::from_millis(5)
        );
    }

    #[test]
    fn time_does_not_go_back() {
        let clock = Clock::new(1.0);
        let mut last = clock.now();
        for _ in 0..1000 {
            let now = clock.now();
            assert!(now >= last);
            last = now;
        }
    }
}
