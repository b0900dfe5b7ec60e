//! [`Waiter`]: how a thread waits for the topics on which it acts.
//!
//! A wake is a hint. It says for which topics a writer rang, and the thread reads those. At every
//! sixteenth wake and at every time-out the thread reads all its topics. So a sample that came
//! without a ring waits for one time-out at most.
//!
//! A waiter that looks without pause yields its core every 4 us. Another thread may need that core
//! before it can ring, such as the kernel thread that delivers a serial port's bytes. Before
//! waiters yielded, that thread waited for 2 ms and more, so no look ever caught a ring. The yield
//! gives the core to any thread that is ready to run there, even to one of `SCHED_IDLE`, which then
//! keeps it until the kernel's next tick: 4 ms at 250 Hz. Keep such processes off a core on which a
//! waiter looks. Under a real-time scheduler, a yield helps only threads of the same priority.
//!
//! Looking gains more if that kernel thread runs on the core of the waiter that it serves. If
//! another core calls it, it starts after an interrupt, which took 8 to 18 us in a virtual machine,
//! twice for each frame of the robot's path. With the kernel's workers bound to the core of the
//! bridge, the path took 0.39 to 0.41 of its time with sleeping waiters, and 0.77 to 0.82 with
//! workers on any core. The runs took turns, and both took 36 % of a core (two cores, 2026-11-27).

use core::cell::{Cell, RefCell};
use core::fmt;
use core::marker::PhantomData;
use core::num::NonZeroU64;
use core::time::Duration;

use lager_home::Clock;
use lager_sample::{Part, Request, Topic};
use rustix::thread::set_current_timer_slack;

use crate::bell::{self, Bell, Board, BoardFault, Plan, Rhythm, SeatRinger};
use crate::policy::Policy;
use crate::urgency;

/// Why a wait ended. In both cases drain the topics for which [`Waiter::has`] is true: one ring may
/// announce many samples, and a sample may have come without one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wake {
    /// Another thread rang.
    Rung,
    /// The time-out came first.
    TimedOut,
}

/// Looks at the word between two readings of the clock, which costs as much as several looks.
const LOOKS: u32 = 64;

/// How long to look before yielding the core, in ns. See the head of this file.
const GIVE_WAY_NS: u64 = 4_000;

/// After this many wakes, one wake drains everything, because writers that know no bells do not
/// ring.
const WAKES: u32 = 16;

/// Waits for all topics on which a service acts. Like ports, it stays in the thread that made it:
///
/// ```compile_fail,E0277
/// fn sent_elsewhere(waiter: lager_wake::Waiter) -> impl Send {
///     waiter
/// }
/// ```
pub struct Waiter {
    stays: PhantomData<*const ()>,
    bell: Bell,
    policy: Policy,
    part: Part,
    adaptive: RefCell<Adaptive>,
    sleeps: Cell<u64>,
    /// After the last wait, all topics are to be drained.
    everything: Cell<bool>,
    wakes: Cell<u32>,
    quiet: fn(),
}

/// The state of `Policy::Adaptive`.
struct Adaptive {
    rhythm: Rhythm,
    /// How many waiters of a board may look without pause.
    limit: usize,
    /// Whether this waiter is one of them.
    spinning: bool,
    /// The last ring was noticed without reading the clock.
    untimed: bool,
    /// When a look caught the last ring. The rhythm learns it later, because a ring is more urgent.
    caught_ns: Option<u64>,
}

impl Waiter {
    /// Makes a waiter for a process that plays `part`. Observers have none, because nobody wakes
    /// them. The waiter calls `quiet` at each time-out and now and then after a ring.
    ///
    /// # Errors
    /// The board cannot be used, or it has no free seat for the part.
    pub fn new(board: &Board, part: Part, policy: Policy, quiet: fn()) -> Result<Self, BoardFault> {
        let longest_spin = match policy {
            Policy::Adaptive { longest_spin } => {
                // By default the kernel may end a thread's sleep 50 us late. That is too late for a
                // short sleep that must end before the next ring is due. If the slack cannot be
                // set, a ring ends more of them.
                let _ = set_current_timer_slack(NonZeroU64::new(1));
                longest_spin
            }
            Policy::Block | Policy::Spin => Duration::ZERO,
        };
        Ok(Self {
            stays: PhantomData,
            bell: Bell::hang(board, part)?,
            policy,
            part,
            adaptive: RefCell::new(Adaptive {
                rhythm: Rhythm::new(nanoseconds(longest_spin)),
                limit: who_may_look(),
                spinning: false,
                untimed: false,
                caught_ns: None,
            }),
            sleeps: Cell::new(0),
            everything: Cell::new(true),
            wakes: Cell::new(0),
            quiet,
        })
    }

    /// Waits until rung, at most `timeout` of real time (see [`Clock::real`]). At a time-out, and
    /// now and then after a ring, it calls the function `quiet` that it was made with. On a bus,
    /// that function sends late readers the states that this thread publishes.
    pub fn wait(&self, timeout: Duration) -> Wake {
        let rung = self.wait_while_not(timeout, || self.bell.rung());
        let wakes = self.wakes.get().wrapping_add(1);
        self.wakes.set(wakes);
        let everything = !rung || wakes.is_multiple_of(WAKES);
        self.everything.set(everything);
        if everything {
            (self.quiet)();
        }
        if rung { Wake::Rung } else { Wake::TimedOut }
    }

    /// Whether the topic must be drained after a [`Waiter::wait`]: a writer rang for it since the
    /// last call of `has`, or all topics must be drained, as after a time-out and now and then
    /// after a ring.
    #[inline]
    pub fn has<T: Topic>(&self) -> bool {
        self.rung_for(bell::reason(T::ID))
    }

    /// The same as [`Waiter::has`] for a request.
    #[inline]
    pub fn has_request<R: Request>(&self) -> bool {
        self.rung_for(bell::reason(R::ID))
    }

    /// The same as [`Waiter::has`] for the rings of this process's own threads.
    #[inline]
    pub fn has_inside(&self) -> bool {
        self.rung_for(bell::INSIDE)
    }

    fn rung_for(&self, reason: usize) -> bool {
        // Clears the reason in any case: what is drained now needs no second look.
        self.bell.rung_for(reason) || self.everything.get()
    }

    /// How many times this waiter went to sleep. Each sleep costs one system call here, and one for
    /// the process that wakes it.
    pub fn sleeps(&self) -> u64 {
        self.sleeps.get()
    }

    /// A [`Ringer`] that wakes this waiter from other threads of the process.
    pub fn ringer(&self) -> Ringer {
        Ringer {
            seat: self.bell.seat_ringer(),
        }
    }

    /// Waits until `done` is true or a ring comes.
    #[inline]
    fn wait_while_not(&self, timeout: Duration, mut done: impl FnMut() -> bool) -> bool {
        if done() {
            if let Policy::Adaptive { .. } = self.policy {
                self.adaptive.borrow_mut().untimed = true;
            }
            return true;
        }
        if timeout.is_zero() {
            return false;
        }
        match self.policy {
            Policy::Block => self.sleep(timeout),
            Policy::Spin => look_for(timeout, done),
            Policy::Adaptive { .. } => {
                self.adapt(&mut self.adaptive.borrow_mut(), timeout, &mut done)
            }
        }
    }

    fn adapt(
        &self,
        this: &mut Adaptive,
        timeout: Duration,
        done: &mut impl FnMut() -> bool,
    ) -> bool {
        if let Some(at) = this.caught_ns.take() {
            this.rhythm.caught();
            this.rhythm.rung(at);
        }
        if this.spinning && this.rhythm.is_quick() && look(done) {
            this.untimed = true;
            return true;
        }
        let now = Clock::monotonic_ns();
        let deadline = now.saturating_add(nanoseconds(timeout));
        if core::mem::take(&mut this.untimed) {
            this.rhythm.touched(now);
        }
        if let Plan::Look { from, until } = this.rhythm.plan(now)
            && self.may_spin(this)
        {
            let from = from.min(deadline);
            if from > now && self.sleep(Duration::from_nanos(from - now)) {
                this.rhythm.rung(Clock::monotonic_ns());
                return true;
            }
            let end = until.min(deadline);
            let mut now = Clock::monotonic_ns();
            let mut gave_way = now;
            loop {
                if look(done) {
                    this.caught_ns = Some(now);
                    return true;
                }
                now = Clock::monotonic_ns();
                if now >= end {
                    break;
                }
                if now - gave_way >= GIVE_WAY_NS {
                    std::thread::yield_now();
                    now = Clock::monotonic_ns();
                    gave_way = now;
                }
            }
            if deadline <= end {
                return false;
            }
            this.rhythm.in_vain();
        }
        self.stop_spinning(this);
        let left = deadline.saturating_sub(Clock::monotonic_ns());
        let rung = left > 0 && self.sleep(Duration::from_nanos(left));
        if rung {
            this.rhythm.rung(Clock::monotonic_ns());
        }
        rung
    }

    fn may_spin(&self, this: &mut Adaptive) -> bool {
        if !this.spinning {
            this.spinning = self.bell.may_spin(this.limit);
        }
        this.spinning
    }

    fn stop_spinning(&self, this: &mut Adaptive) {
        if core::mem::take(&mut this.spinning) {
            self.bell.stop_spinning();
        }
    }

    fn sleep(&self, timeout: Duration) -> bool {
        self.sleeps.set(self.sleeps.get() + 1);
        self.bell.sleep(timeout)
    }
}

/// Looks `LOOKS` times, without reading the clock.
#[inline]
fn look(done: &mut impl FnMut() -> bool) -> bool {
    for _ in 0..LOOKS {
        if done() {
            return true;
        }
        core::hint::spin_loop();
    }
    false
}

/// Looks until `done` is true, at most `timeout`.
#[inline]
fn look_for(timeout: Duration, mut done: impl FnMut() -> bool) -> bool {
    let mut end = None;
    loop {
        if look(&mut done) {
            return true;
        }
        // Reads the clock only after the first looks, so a quick ring costs no reading.
        let now = Clock::monotonic_ns();
        let end = *end.get_or_insert_with(|| now.saturating_add(nanoseconds(timeout)));
        if now >= end {
            return false;
        }
    }
}

fn nanoseconds(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}

impl fmt::Debug for Waiter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Waiter")
            .field("part", &self.part)
            .field("policy", &self.policy)
            .finish_non_exhaustive()
    }
}

/// Wakes a [`Waiter`] of this process from any thread; clones ring the same waiter.
#[derive(Clone)]
pub struct Ringer {
    seat: SeatRinger,
}

impl Ringer {
    /// Rings.
    pub fn ring(&self) {
        self.seat.ring();
    }
}

impl fmt::Debug for Ringer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Ringer").finish_non_exhaustive()
    }
}

/// How many waiters of a unit may look at the same time.
///
/// A waiter that looks yields its core to any thread that wants it, so every core may have one.
/// With one waiter fewer, one of two waiters on two cores always slept. Under a real-time scheduler
/// a thread does not yield to threads of lower priority, so one core stays free for those. On a
/// single core two threads would only hand the core to each other.
fn who_may_look() -> usize {
    match cores() {
        1 => 0,
        cores if urgency::is_real_time() => cores - 1,
        cores => cores,
    }
}

/// The number of running cores of the machine, including those that this thread may not use.
#[allow(unsafe_code)]
fn cores() -> usize {
    // SAFETY: the call takes a number and returns one.
    let cores = unsafe { libc::sysconf(libc::_SC_NPROCESSORS_ONLN) };
    usize::try_from(cores).unwrap_or(1)
}
