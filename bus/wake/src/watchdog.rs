//! [`Watchdog`]: watches calls into the bus, which may never return.
//!
//! The transport waits without a time-out for a shared-memory segment to get its size. A process
//! that is killed or frozen before it sets the size leaves a segment without one, and a process
//! that opens that segment hangs. A service has a supervisor for this case; a tool has this
//! watchdog. Its own thread uses nothing of the bus. It counts how long a call takes and says when
//! the call has taken too long. It does not count time in which the calling thread waited for a
//! core. It also makes sure that one request to stop is enough, whatever the tool's other threads
//! do. A service's calls are its sign of life, too.
//!
//! ```text
//!            enter                        limit is over
//!  resting ---------> in a call ----------------------------------> given up (hung)
//!     ^                 |   |
//!     +----- leave -----+   +-- stop requested, grace over -------> given up (interrupted)
//!     +----------------------- stop requested, grace over --------> given up (interrupted)
//! ```
//! A tool that ends in order ([`Watchdog::start_in_order`]) does not have the last line.

use core::fmt;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use lager_home::{Chance, Life};

use crate::shutdown::Shutdown;
use crate::urgency;

/// How often the watch looks while a call may hang.
const TICK: Duration = Duration::from_millis(50);
/// How often it looks otherwise. This is seldom, because sixty tools may run at a time.
const QUIET_TICK: Duration = Duration::from_millis(250);
/// A longer pause between two looks counts only as this long: the whole process was frozen or kept
/// from its core meanwhile, so the watched call did not run either.
const LONGEST_TICK: Duration = Duration::from_millis(100);
/// How long the process may take to end in order after a stop was requested.
const GRACE: Duration = Duration::from_millis(500);

/// Why the watchdog gives the process up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GivenUp {
    /// A call into the bus has not returned within the limit.
    Hung {
        /// The process's activity, as it was passed to [`Watchdog::enter`].
        what: &'static str,
    },
    /// A stop was requested, and the process does not end by itself.
    Interrupted,
}

/// A watch over calls into the bus; clones share it.
#[derive(Clone, Default)]
pub struct Watchdog {
    now: Arc<Mutex<Now>>,
    life: Option<Arc<Life>>,
}

/// The present activity of the watched threads.
#[derive(Clone, Copy, Debug, Default)]
struct Now {
    /// How many calls there have been.
    calls: u64,
    /// The purpose of the last call; `None` once it has returned.
    what: Option<&'static str>,
    /// The system's number of the thread that makes the call.
    thread: u32,
}

thread_local! {
    /// This thread's number, read once.
    static THREAD: u32 = rustix::thread::gettid().as_raw_nonzero().get().unsigned_abs();
}

impl Watchdog {
    /// Starts to watch. `give_up` runs once, in the watchdog's thread, and must end the process,
    /// because a call that hangs cannot be cancelled.
    ///
    /// # Errors
    /// The system cannot start the thread.
    pub fn start(
        limit: Duration,
        shutdown: &Shutdown,
        give_up: impl FnOnce(GivenUp) + Send + 'static,
    ) -> io::Result<Self> {
        Self::watching(Counts::new(limit), shutdown, give_up)
    }

    /// The same, but after a requested stop the process may take any time between two calls.
    ///
    /// # Errors
    /// The system cannot start the thread.
    pub fn start_in_order(
        limit: Duration,
        shutdown: &Shutdown,
        give_up: impl FnOnce(GivenUp) + Send + 'static,
    ) -> io::Result<Self> {
        let counts = Counts {
            only_calls: true,
            ..Counts::new(limit)
        };
        Self::watching(counts, shutdown, give_up)
    }

    fn watching(
        counts: Counts,
        shutdown: &Shutdown,
        give_up: impl FnOnce(GivenUp) + Send + 'static,
    ) -> io::Result<Self> {
        let watchdog = Self::default();
        let (watching, shutdown) = (watchdog.clone(), shutdown.clone());
        std::thread::Builder::new()
            .name("watchdog".to_owned())
            .spawn(move || give_up(watching.watch(counts, &shutdown)))?;
        Ok(watchdog)
    }

    /// The same watchdog, but each call is also a sign that the service goes on.
    #[must_use]
    pub fn showing(self, life: Life) -> Self {
        Self {
            life: Some(Arc::new(life)),
            ..self
        }
    }

    /// A call into the bus begins, and the one before is over. `what` is the call's purpose.
    pub fn enter(&self, what: &'static str) {
        if let Some(life) = &self.life {
            life.goes_on();
        }
        let mut now = self.now();
        now.calls += 1;
        now.what = Some(what);
        now.thread = THREAD.with(|thread| *thread);
    }

    /// No call into the bus is under way. What follows may take any time.
    pub fn leave(&self) {
        self.now().what = None;
    }

    /// Makes one call and watches it.
    pub fn over<T>(&self, what: &'static str, call: impl FnOnce() -> T) -> T {
        self.enter(what);
        let result = call();
        self.leave();
        result
    }

    fn now(&self) -> MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks again and again until there is a reason to give up.
    fn watch(&self, mut counts: Counts, shutdown: &Shutdown) -> GivenUp {
        urgency::wake_with_others(TICK);
        let mut looked = Instant::now();
        // The thread that makes the calls, and how long it could have run.
        let mut caller = (0, Chance::of_own_thread(0));
        loop {
            std::thread::sleep(counts.tick());
            let mut tick = looked.elapsed();
            looked = Instant::now();
            let now = *self.now();
            if caller.0 != now.thread {
                caller = (now.thread, Chance::of_own_thread(now.thread));
            }
            if counts.is_under_way(now) {
                tick = caller.1.of(tick);
            }
            if let Some(why) = counts.look(tick, now, shutdown.is_requested()) {
                return why;
            }
        }
    }
}

impl fmt::Debug for Watchdog {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_tuple("Watchdog")
            .field(&*self.now())
            .finish()
    }
}

/// The counts of the watching thread.
struct Counts {
    limit: Duration,
    /// Whether a requested stop interrupts nothing but a call.
    only_calls: bool,
    call: u64,
    /// How long the call has lasted that was under way at the last look.
    lasted: Duration,
    wished_for: Duration,
}

impl Counts {
    fn new(limit: Duration) -> Self {
        Self {
            limit,
            only_calls: false,
            call: 0,
            lasted: Duration::ZERO,
            wished_for: Duration::ZERO,
        }
    }

    /// How long to wait until the next look.
    fn tick(&self) -> Duration {
        let is_quiet = self.lasted.is_zero() && self.wished_for.is_zero();
        if is_quiet { QUIET_TICK } else { TICK }
    }

    /// Whether `now` is in the call that the last look saw.
    fn is_under_way(&self, now: Now) -> bool {
        now.what.is_some() && now.calls == self.call
    }

    /// One look, `tick` after the one before. Returns the reason to give up, if there is one.
    fn look(&mut self, tick: Duration, now: Now, shutdown: bool) -> Option<GivenUp> {
        let tick = tick.min(LONGEST_TICK);
        if shutdown && self.only_calls && (now.what.is_none() || now.calls != self.call) {
            self.wished_for = Duration::ZERO;
        } else if shutdown {
            self.wished_for += tick;
            if self.wished_for >= GRACE {
                return Some(GivenUp::Interrupted);
            }
        }
        let Some(what) = now.what.filter(|_| self.is_under_way(now)) else {
            self.call = now.calls;
            self.lasted = Duration::ZERO;
            return None;
        };
        self.lasted += tick;
        (self.lasted >= self.limit).then_some(GivenUp::Hung { what })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    const LIMIT: Duration = Duration::from_secs(3);

    fn call(calls: u64) -> Now {
        let what = Some("opening a topic");
        Now {
            what,
            ..resting(calls)
        }
    }

    fn resting(calls: u64) -> Now {
        Now {
            calls,
            ..Now::default()
        }
    }

    #[test]
    fn a_call_that_does_not_return_is_named_when_the_limit_is_over() {
        let mut counts = Counts::new(LIMIT);
        for _ in 0..LIMIT.as_millis() / TICK.as_millis() {
            assert_eq!(counts.look(TICK, call(1), false), None);
        }
        let what = "opening a topic";
        assert_eq!(
            counts.look(TICK, call(1), false),
            Some(GivenUp::Hung { what })
        );
    }

    #[test]
    fn it_looks_seldom_until_a_call_lasts_or_the_end_is_wished_for() {
        let mut counts = Counts::new(LIMIT);
        let resting = resting(2);
        for now in [call(1), call(2), resting, resting] {
            counts.look(QUIET_TICK, now, false);
            assert_eq!(counts.tick(), QUIET_TICK);
        }
        counts.look(QUIET_TICK, call(3), false);
        counts.look(QUIET_TICK, call(3), false);
        assert_eq!(counts.tick(), TICK);
        counts.look(TICK, resting, false);
        assert_eq!(counts.tick(), QUIET_TICK);
        counts.look(QUIET_TICK, resting, true);
        assert_eq!(counts.tick(), TICK);
    }

    #[test]
    fn calls_that_return_may_follow_each_other_for_ever() {
        let mut counts = Counts::new(LIMIT);
        for number in 0..1_000 {
            assert_eq!(counts.look(LONGEST_TICK, call(number / 2), false), None);
        }
        let resting = resting(1_000);
        for _ in 0..1_000 {
            assert_eq!(counts.look(LONGEST_TICK, resting, false), None);
        }
    }

    #[test]
    fn time_in_which_the_process_did_not_run_is_no_hanging() {
        let mut counts = Counts::new(LIMIT);
        counts.look(TICK, call(1), false);
        let frozen = Duration::from_secs(3600);
        assert_eq!(counts.look(frozen, call(1), false), None);
    }

    #[test]
    fn one_wish_to_stop_is_enough_within_a_call_and_between_two() {
        for now in [call(1), Now::default()] {
            let mut counts = Counts::new(LIMIT);
            let mut looks = 0;
            while counts.look(TICK, now, true).is_none() {
                looks += 1;
            }
            assert!(TICK * looks < GRACE, "{looks} looks");
        }
    }

    #[test]
    fn an_end_in_order_is_cut_short_within_a_call_only() {
        let mut counts = Counts {
            only_calls: true,
            ..Counts::new(LIMIT)
        };
        for calls in 0..1_000 {
            assert_eq!(counts.look(LONGEST_TICK, call(calls), true), None);
            assert_eq!(counts.look(LONGEST_TICK, resting(calls), true), None);
        }
        let mut looks = 0;
        while counts.look(TICK, call(1_000), true).is_none() {
            looks += 1;
        }
        assert!(TICK * looks <= GRACE, "{looks} looks");
    }

    #[test]
    fn the_thread_gives_up_a_call_that_hangs() {
        let (send, given_up) = mpsc::channel();
        let limit = Duration::from_millis(50);
        let watchdog = Watchdog::start(limit, &Shutdown::new(), move |why| {
            let _ = send.send(why);
        })
        .expect("a thread");
        watchdog.over("opening a topic", || {
            let what = "opening a topic";
            assert_eq!(given_up.recv(), Ok(GivenUp::Hung { what }));
        });
    }
}
