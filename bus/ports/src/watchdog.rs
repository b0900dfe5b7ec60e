//! A watch over calls into the bus, which may never return.
//!
//! The transport waits without a time-out for a shared-memory segment to get its size. A process
//! that is killed or frozen in between leaves a segment that never does, and a process that opens
//! it hangs. Services have a supervisor for that; a tool has this watchdog. Its own thread touches
//! nothing of the bus, counts how long a call takes and says when it has taken too long. Time that
//! the calling thread has waited for a core is not counted. It also makes one wish to stop enough,
//! whatever the tool's other threads are doing. A service's calls are its sign of life, too.
//!
//! ```text
//!            enter                        limit is over
//!  resting ---------> in a call ------------------------------> given up (hung)
//!     ^                 |   |
//!     +----- leave -----+   +-- shutdown wished, grace over --> given up (interrupted)
//!     +----------------------- shutdown wished, grace over ---> given up (interrupted)
//! ```
//! The last line is not there for a tool that ends in order ([`Watchdog::start_in_order`]).

use core::fmt;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::chance::Chance;
use crate::life::Life;
use crate::shutdown::Shutdown;
use crate::urgency;

/// How often the watch looks while something may hang.
const TICK: Duration = Duration::from_millis(50);
/// How often it looks otherwise: seldom, because sixty tools may look on beside a robot.
const QUIET_TICK: Duration = Duration::from_millis(250);
/// A longer pause between two looks counts only as this long: the whole process did not run
/// meanwhile, because it was frozen or kept from its core, and so the watched call did not run
/// either.
const LONGEST_TICK: Duration = Duration::from_millis(100);
/// How long an orderly end may take after it was wished for.
const GRACE: Duration = Duration::from_millis(500);

/// Why the watch gives the process up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GivenUp {
    /// A call into the bus has not returned within the limit.
    Hung {
        /// What the process was doing, as it was told to [`Watchdog::enter`].
        what: &'static str,
    },
    /// The end that was wished for does not come by itself.
    Interrupted,
}

/// A watch over calls into the bus; clones share it.
#[derive(Clone, Default)]
pub struct Watchdog {
    now: Arc<Mutex<Now>>,
    life: Option<Arc<Life>>,
}

/// What the watched threads are doing.
#[derive(Clone, Copy, Debug, Default)]
struct Now {
    /// How many calls there have been.
    calls: u64,
    /// What the last of them is for; `None` once it has returned.
    what: Option<&'static str>,
    /// The thread that makes it, as the system counts threads.
    thread: u32,
}

thread_local! {
    /// This thread's number, asked for once.
    static THREAD: u32 = rustix::thread::gettid().as_raw_nonzero().get().unsigned_abs();
}

impl Watchdog {
    /// Watches from now on. `give_up` runs once, in the watch's thread, and must end the process,
    /// because a call that hangs cannot be cancelled.
    ///
    /// # Errors
    /// The system has no thread for it.
    pub fn start(
        limit: Duration,
        shutdown: &Shutdown,
        give_up: impl FnOnce(GivenUp) + Send + 'static,
    ) -> io::Result<Self> {
        Self::watching(Watch::new(limit), shutdown, give_up)
    }

    /// The same, but between two calls the end that was wished for may take as long as it likes.
    ///
    /// # Errors
    /// The system has no thread for it.
    pub fn start_in_order(
        limit: Duration,
        shutdown: &Shutdown,
        give_up: impl FnOnce(GivenUp) + Send + 'static,
    ) -> io::Result<Self> {
        let watch = Watch {
            only_calls: true,
            ..Watch::new(limit)
        };
        Self::watching(watch, shutdown, give_up)
    }

    fn watching(
        watch: Watch,
        shutdown: &Shutdown,
        give_up: impl FnOnce(GivenUp) + Send + 'static,
    ) -> io::Result<Self> {
        let watchdog = Self::default();
        let (watching, shutdown) = (watchdog.clone(), shutdown.clone());
        std::thread::Builder::new()
            .name("watchdog".to_owned())
            .spawn(move || give_up(watching.watch(watch, &shutdown)))?;
        Ok(watchdog)
    }

    /// The same watch, each of whose calls is a sign that the service goes on.
    #[must_use]
    pub fn showing(self, life: Life) -> Self {
        Self {
            life: Some(Arc::new(life)),
            ..self
        }
    }

    /// A call into the bus begins, and the one before is over; `what` says what it is for.
    pub fn enter(&self, what: &'static str) {
        if let Some(life) = &self.life {
            life.goes_on();
        }
        let mut now = self.now();
        now.calls += 1;
        now.what = Some(what);
        now.thread = THREAD.with(|thread| *thread);
    }

    /// No call into the bus is under way: what follows may take as long as it likes.
    pub fn leave(&self) {
        self.now().what = None;
    }

    /// Makes one call under the watch.
    pub fn over<T>(&self, what: &'static str, call: impl FnOnce() -> T) -> T {
        self.enter(what);
        let result = call();
        self.leave();
        result
    }

    fn now(&self) -> MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks until there is a reason to give up.
    fn watch(&self, mut watch: Watch, shutdown: &Shutdown) -> GivenUp {
        urgency::wake_with_others(TICK);
        let mut looked = Instant::now();
        // The thread that makes the calls, and what it could have run.
        let mut caller = (0, Chance::of_own_thread(0));
        loop {
            std::thread::sleep(watch.tick());
            let mut tick = looked.elapsed();
            looked = Instant::now();
            let now = *self.now();
            if caller.0 != now.thread {
                caller = (now.thread, Chance::of_own_thread(now.thread));
            }
            if watch.is_under_way(now) {
                tick = caller.1.of(tick);
            }
            if let Some(why) = watch.look(tick, now, shutdown.is_requested()) {
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

/// What the watch has counted so far.
struct Watch {
    limit: Duration,
    /// Whether the wish to end cuts nothing short but a call.
    only_calls: bool,
    call: u64,
    /// How long the call has lasted that was under way at the last look.
    lasted: Duration,
    wished_for: Duration,
}

impl Watch {
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

    /// Whether that is the call which the last look saw.
    fn is_under_way(&self, now: Now) -> bool {
        now.what.is_some() && now.calls == self.call
    }

    /// One look, `tick` after the one before; whether to give up.
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
        let mut watch = Watch::new(LIMIT);
        for _ in 0..LIMIT.as_millis() / TICK.as_millis() {
            assert_eq!(watch.look(TICK, call(1), false), None);
        }
        let what = "opening a topic";
        assert_eq!(
            watch.look(TICK, call(1), false),
            Some(GivenUp::Hung { what })
        );
    }

    #[test]
    fn it_looks_seldom_until_a_call_lasts_or_the_end_is_wished_for() {
        let mut watch = Watch::new(LIMIT);
        let resting = resting(2);
        for now in [call(1), call(2), resting, resting] {
            watch.look(QUIET_TICK, now, false);
            assert_eq!(watch.tick(), QUIET_TICK);
        }
        watch.look(QUIET_TICK, call(3), false);
        watch.look(QUIET_TICK, call(3), false);
        assert_eq!(watch.tick(), TICK);
        watch.look(TICK, resting, false);
        assert_eq!(watch.tick(), QUIET_TICK);
        watch.look(QUIET_TICK, resting, true);
        assert_eq!(watch.tick(), TICK);
    }

    #[test]
    fn calls_that_return_may_follow_each_other_for_ever() {
        let mut watch = Watch::new(LIMIT);
        for number in 0..1_000 {
            assert_eq!(watch.look(LONGEST_TICK, call(number / 2), false), None);
        }
        let resting = resting(1_000);
        for _ in 0..1_000 {
            assert_eq!(watch.look(LONGEST_TICK, resting, false), None);
        }
    }

    #[test]
    fn time_in_which_the_process_did_not_run_is_no_hanging() {
        let mut watch = Watch::new(LIMIT);
        watch.look(TICK, call(1), false);
        let frozen = Duration::from_secs(3600);
        assert_eq!(watch.look(frozen, call(1), false), None);
    }

    #[test]
    fn one_wish_to_stop_is_enough_within_a_call_and_between_two() {
        for now in [call(1), Now::default()] {
            let mut watch = Watch::new(LIMIT);
            let mut looks = 0;
            while watch.look(TICK, now, true).is_none() {
                looks += 1;
            }
            assert!(TICK * looks < GRACE, "{looks} looks");
        }
    }

    #[test]
    fn an_end_in_order_is_cut_short_within_a_call_only() {
        let mut watch = Watch {
            only_calls: true,
            ..Watch::new(LIMIT)
        };
        for calls in 0..1_000 {
            assert_eq!(watch.look(LONGEST_TICK, call(calls), true), None);
            assert_eq!(watch.look(LONGEST_TICK, resting(calls), true), None);
        }
        let mut looks = 0;
        while watch.look(TICK, call(1_000), true).is_none() {
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
