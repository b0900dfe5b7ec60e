//! The one clock of a process.
//!
//! Robot time is `CLOCK_MONOTONIC` times the speed of the body, so leases, time-outs and a
//! simulated body agree at any speed and in all processes. An emulated body cannot promise a speed:
//! it publishes its time, and the clock follows it ([`page`]). Stamps are in real nanoseconds.

mod page;

use core::cell::Cell;
use core::time::Duration;
use std::path::Path;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use rustix::time::{ClockId, clock_gettime};

use crate::error::OpenError;
use page::Page;

/// The shortest wait for a followed clock in real time: it moves in steps of about that size.
const STEP: Duration = Duration::from_micros(500);

/// What a process's clocks go by.
#[derive(Clone, Debug)]
pub(crate) enum Source {
    /// Real time.
    Real,
    /// So many times real time.
    Hurried(f64),
    /// An emulated body's page; it runs at most this many times as fast as real time.
    Followed(Arc<Page>, f64),
}

impl Source {
    /// The page at `page`, or real time times `speed`, which is positive and finite.
    ///
    /// # Errors
    /// The page cannot be had.
    pub(crate) fn new(speed: f64, page: Option<&Path>) -> Result<Self, OpenError> {
        Ok(match page {
            Some(path) => Self::Followed(Arc::new(Page::open(path)?), speed),
            None if speed == 1.0 => Self::Real,
            None => Self::Hurried(speed),
        })
    }
}

/// Robot time. Each state machine has a clock of its own: to each, time only goes forwards.
///
/// A followed clock stands still as long as the emulator is late, stopped or dead, and goes on
/// with its successor.
#[derive(Clone, Debug)]
pub struct Clock {
    source: Source,
    /// The latest moment asked for, in ns of `CLOCK_MONOTONIC`, and what the answer was; of a
    /// followed clock only.
    told: Cell<(u64, Duration)>,
}

impl Clock {
    pub(crate) const fn new(source: Source) -> Self {
        Self {
            source,
            told: Cell::new((0, Duration::ZERO)),
        }
    }

    /// Robot time since the clock's origin, which all processes of a robot share.
    pub fn now(&self) -> Duration {
        self.at(Self::monotonic_ns())
    }

    /// Robot time at a moment of real time, in ns of `CLOCK_MONOTONIC`, that is not in the future.
    ///
    /// What a followed clock says of a moment past is an estimate from its present rate, but never
    /// before what it has said of an earlier moment nor after what it has said of a later one.
    pub fn at(&self, monotonic_ns: u64) -> Duration {
        let real = Duration::from_nanos(monotonic_ns);
        match &self.source {
            Source::Real => real,
            Source::Hurried(speed) => real.mul_f64(*speed),
            Source::Followed(page, speed) => self.follow(page, *speed, monotonic_ns),
        }
    }

    /// How long to wait in real time for a span of robot time to pass.
    ///
    /// A followed clock may run slower, or stand still, so the span may not be over then: who
    /// waits looks at the clock again. It is the span's time at full speed, which is never too
    /// long, and at least one step of the clock, so that looking again costs little.
    pub fn real(&self, robot: Duration) -> Duration {
        match &self.source {
            Source::Real => robot,
            Source::Hurried(speed) => robot.div_f64(*speed),
            Source::Followed(..) if robot.is_zero() => robot,
            Source::Followed(_, speed) => robot.div_f64(*speed).max(STEP),
        }
    }

    /// `CLOCK_MONOTONIC` in ns: real time, as in every stamp.
    pub fn monotonic_ns() -> u64 {
        let now = clock_gettime(ClockId::Monotonic);
        // The kernel's monotonic clock starts at 0 with the machine and is never negative.
        now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
    }

    /// What is added to a time of `CLOCK_MONOTONIC` to get ns since 1970, now. Whoever shows dates
    /// for a while takes it once, so that a calendar that is set meanwhile does not bend them.
    ///
    /// The calendar of a machine may say any year. What a signed number of ns cannot hold, from 2262
    /// on, is its largest, and what was before 1970 is 0.
    pub fn unix_offset_ns() -> i64 {
        let read = || {
            let before = Self::monotonic_ns();
            let unix = SystemTime::now().duration_since(UNIX_EPOCH);
            let after = Self::monotonic_ns();
            let unix = unix.map_or(0, |since| {
                i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
            });
            (
                after - before,
                unix.saturating_sub_unsigned(before.midpoint(after)),
            )
        };
        // Between two readings this thread may lose its core; the closest ones say it best.
        let closest = [(); 3].map(|()| read()).into_iter().min();
        closest.expect("three readings").1
    }

    fn follow(&self, page: &Page, speed: f64, monotonic_ns: u64) -> Duration {
        let page = page.read();
        // No chip time is known to have passed since the last update.
        let ago = page.real_ns.saturating_sub(monotonic_ns);
        let rate = match page.rate {
            0 => speed,
            rate => rate as f64 / 1e6,
        };
        let estimate = page.chip_ns.saturating_sub((ago as f64 * rate) as u64);
        let estimate = Duration::from_nanos(estimate);
        let (asked, answer) = self.told.get();
        if monotonic_ns < asked {
            return estimate.min(answer);
        }
        let estimate = estimate.max(answer);
        self.told.set((monotonic_ns, estimate));
        estimate
    }
}

#[cfg(test)]
mod tests {
    use super::page::tests::Writer;
    use super::*;

    const MILLISECOND: u64 = 1_000_000;

    fn hurried(speed: f64) -> Clock {
        Clock::new(Source::new(speed, None).unwrap())
    }

    fn following(writer: &Writer, speed: f64) -> Clock {
        Clock::new(Source::new(speed, Some(&writer.path)).unwrap())
    }

    #[test]
    fn robot_time_runs_at_its_speed() {
        let clock = hurried(8.0);
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
        let clock = hurried(1.0);
        let mut last = clock.now();
        for _ in 0..1000 {
            let now = clock.now();
            assert!(now >= last);
            last = now;
        }
    }

    #[test]
    fn a_followed_clock_shows_the_chips_time_and_stands_still_with_them() {
        let writer = Writer::new();
        writer.publish(5 * MILLISECOND, Clock::monotonic_ns(), 1_000_000);
        let (clock, other) = (following(&writer, 1.0), following(&writer, 1.0));
        // However long ago the update was: the emulator is late, or stopped, or dead.
        for later in [0, 1, 1_000] {
            let moment = Clock::monotonic_ns() + later * MILLISECOND;
            assert_eq!(clock.at(moment), Duration::from_millis(5));
        }
        // Its successor goes on, at first without a rate.
        let real = Clock::monotonic_ns() + 2_000 * MILLISECOND;
        writer.publish(7 * MILLISECOND, real, 0);
        assert_eq!(clock.at(real), Duration::from_millis(7));
        assert_eq!(other.at(real), Duration::from_millis(7));
    }

    #[test]
    fn a_moment_past_is_dated_back_at_the_present_rate() {
        let writer = Writer::new();
        let real = Clock::monotonic_ns();
        writer.publish(100 * MILLISECOND, real, 500_000);
        let clock = following(&writer, 4.0);
        let at = |ago: u64| clock.at(real - ago * MILLISECOND);
        assert_eq!(at(0), Duration::from_millis(100));
        assert_eq!(at(20), Duration::from_millis(90));
        // An unknown rate counts as full speed, so a lease may end early but never late.
        writer.set(5, 0);
        assert_eq!(at(20), Duration::from_millis(20));
        assert_eq!(at(1_000), Duration::ZERO);
    }

    #[test]
    fn an_estimate_contradicts_nothing_that_was_said_before() {
        let writer = Writer::new();
        let real = Clock::monotonic_ns();
        writer.publish(100 * MILLISECOND, real, 1_000_000);
        let clock = following(&writer, 1.0);
        assert_eq!(clock.at(real), Duration::from_millis(100));
        // The chips stood still for 50 ms, which the rate does not tell.
        let next = real + 50 * MILLISECOND;
        writer.publish(101 * MILLISECOND, next, 1_000_000);
        let soon = real + 2 * MILLISECOND;
        assert_eq!(clock.at(soon), Duration::from_millis(100));
        assert_eq!(clock.at(next), Duration::from_millis(101));
        writer.set(5, 1);
        assert!(clock.at(real) <= Duration::from_millis(101));
    }

    #[test]
    fn a_wait_is_never_too_long_and_never_a_busy_loop() {
        let writer = Writer::new();
        for rate in [0, 1, 1_000_000, 9_000_000] {
            writer.publish(MILLISECOND, Clock::monotonic_ns(), rate);
            let clock = following(&writer, 2.0);
            let real = |us| clock.real(Duration::from_micros(us));
            assert_eq!(real(40_000), Duration::from_millis(20));
            assert_eq!(real(1), STEP);
            assert_eq!(real(0), Duration::ZERO);
        }
    }
}
