//! [`Clock`]: the unit's time, by which all processes of the unit go.
//!
//! The unit's time is `CLOCK_MONOTONIC` times the speed of the robot. So leases, time-outs and a
//! simulated robot agree at any speed and in all processes. An emulated robot cannot promise a
//! speed: it publishes its time, which the clock follows ([`page`]). Stamps are in real ns.

mod page;

use core::cell::Cell;
use core::time::Duration;
use std::path::Path;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use rustix::time::{ClockId, clock_gettime};

pub use page::ClockError;
use page::Page;

/// The shortest wait in real time for a followed clock, which moves in steps of about that size.
const STEP: Duration = Duration::from_micros(500);

/// The source of time for all clocks of a process.
#[derive(Clone, Debug)]
pub struct ClockSource(Source);

#[derive(Clone, Debug)]
enum Source {
    /// Real time.
    Real,
    /// This many times as fast as real time.
    Hurried(f64),
    /// The page of an emulated robot, which runs at most this many times as fast as real time.
    Followed(Arc<Page>, f64),
}

impl ClockSource {
    /// The page at `page`, or real time times `speed`, which must be positive and finite.
    ///
    /// # Errors
    /// The page cannot be opened or is not a clock page.
    pub fn new(speed: f64, page: Option<&Path>) -> Result<Self, ClockError> {
        Ok(Self(match page {
            Some(path) => Source::Followed(Arc::new(Page::open(path)?), speed),
            None if speed == 1.0 => Source::Real,
            None => Source::Hurried(speed),
        }))
    }
}

/// Shows the unit's time. Each state machine has a clock of its own, and no clock ever goes back.
///
/// A clock that follows an emulator stands still while the emulator is late, stopped or dead, and
/// goes on when the next emulator runs.
#[derive(Clone, Debug)]
pub struct Clock {
    source: Source,
    /// The latest moment that was asked for, in ns of `CLOCK_MONOTONIC`, and the answer. Used only
    /// if the clock follows an emulator.
    told: Cell<(u64, Duration)>,
}

impl Clock {
    /// A clock that takes its time from `source`.
    pub fn new(source: &ClockSource) -> Self {
        Self {
            source: source.0.clone(),
            told: Cell::new((0, Duration::ZERO)),
        }
    }

    /// The unit's time since an origin that all processes of the unit share.
    #[inline]
    pub fn now(&self) -> Duration {
        self.at(Self::monotonic_ns())
    }

    /// The unit's time at a moment of real time, in ns of `CLOCK_MONOTONIC`, but not in the future.
    ///
    /// For a past moment, a followed clock estimates from its present rate. The answer is never
    /// earlier than its answer for an earlier moment, nor later than its answer for a later one.
    #[inline]
    pub fn at(&self, monotonic_ns: u64) -> Duration {
        let real = Duration::from_nanos(monotonic_ns);
        match &self.source {
            Source::Real => real,
            Source::Hurried(speed) => real.mul_f64(*speed),
            Source::Followed(page, speed) => self.follow(page, *speed, monotonic_ns),
        }
    }

    /// How long to wait in real time for a span of the unit's time to pass.
    ///
    /// A followed clock may run slower or stand still, so the span may not be over then, and the
    /// caller must look at the clock again. The wait is the span at full speed, which is never too
    /// long, and at least one step of the clock, so that looking again costs little.
    pub fn real(&self, span: Duration) -> Duration {
        match &self.source {
            Source::Real => span,
            Source::Hurried(speed) => span.div_f64(*speed),
            Source::Followed(..) if span.is_zero() => span,
            Source::Followed(_, speed) => span.div_f64(*speed).max(STEP),
        }
    }

    /// `CLOCK_MONOTONIC` in ns. This is real time, and the time of every stamp.
    #[inline]
    pub fn monotonic_ns() -> u64 {
        let now = clock_gettime(ClockId::Monotonic);
        // `CLOCK_MONOTONIC` starts at 0 with the machine and is never negative.
        now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
    }

    /// The number to add to a time of `CLOCK_MONOTONIC` to get ns since 1970. A program that shows
    /// dates for a while calls this once, so that no change of the calendar shifts its dates.
    ///
    /// The machine's calendar may show any year. A number of ns that is too large for `i64` (from
    /// 2262 on) becomes the largest `i64`, and a time before 1970 becomes 0.
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
        // This thread may lose its core between two readings, so the closest pair is the best.
        let closest = [(); 3].map(|()| read()).into_iter().min();
        closest.expect("three readings").1
    }

    fn follow(&self, page: &Page, speed: f64, monotonic_ns: u64) -> Duration {
        let page = page.read();
        // It is not known whether time has passed on the chips since the last update.
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
    use std::fs::{File, OpenOptions};
    use std::os::unix::fs::FileExt;
    use std::path::PathBuf;
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::page::{MAGIC, VERSION};
    use super::*;

    /// The emulator's side of a page, in a file of the test's own.
    pub(super) struct Writer {
        pub(super) file: File,
        pub(super) path: PathBuf,
    }

    impl Writer {
        pub(super) fn new() -> Self {
            static COUNT: AtomicU32 = AtomicU32::new(0);
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let name = format!("lager-page-{}-{number}", std::process::id());
            let path = std::env::temp_dir().join(name);
            let file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(true)
                .open(&path)
                .unwrap();
            let writer = Self { file, path };
            for (word, value) in [(0, MAGIC), (1, VERSION), (7, 1)] {
                writer.set(word, value);
            }
            writer
        }

        pub(super) fn set(&self, word: u64, value: u64) {
            self.file
                .write_all_at(&value.to_ne_bytes(), word * 8)
                .unwrap();
        }

        pub(super) fn publish(&self, chip_ns: u64, real_ns: u64, rate: u64) {
            for (word, value) in [(3, chip_ns), (4, real_ns), (5, rate)] {
                self.set(word, value);
            }
        }
    }

    impl Drop for Writer {
        fn drop(&mut self) {
            let _ = std::fs::remove_file(&self.path);
        }
    }

    const MILLISECOND: u64 = 1_000_000;

    fn hurried(speed: f64) -> Clock {
        Clock::new(&ClockSource::new(speed, None).unwrap())
    }

    fn following(writer: &Writer, speed: f64) -> Clock {
        Clock::new(&ClockSource::new(speed, Some(&writer.path)).unwrap())
    }

    #[test]
    fn time_runs_at_its_speed() {
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
        // However long ago the update was, because the emulator is late, stopped or dead.
        for later in [0, 1, 1_000] {
            let moment = Clock::monotonic_ns() + later * MILLISECOND;
            assert_eq!(clock.at(moment), Duration::from_millis(5));
        }
        // The next emulator goes on, at first without a rate.
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
        // The chips stood still for 50 ms, which the rate does not show.
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
