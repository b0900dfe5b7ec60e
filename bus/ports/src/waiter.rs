//! How a service that acts on topics waits for them.
//!
//! A wake is a hint. It says which topics were rung for, and the service drains those. At every
//! sixteenth wake and at every time-out it drains all its topics. The services' time-outs are at
//! most 20 ms, so in silence all topics are drained at least every 20 ms.
//!
//! A waiter that looks without pause yields its core every 4 us. The ring may depend on a thread
//! that waits for that core, such as the kernel thread that delivers a serial port's bytes; without
//! the yield that thread waited 2 ms and more, every look was in vain, and waiters stopped looking.
//! Whoever else is ready to run on that core gets it as well, even a process of `SCHED_IDLE`, and
//! keeps it until the kernel's next tick, 4 ms at 250 Hz: keep such processes off a core that is to
//! look. Under a real-time scheduler the yield reaches only threads of the same priority, so others
//! wait until the look ends.
//!
//! Where that kernel thread runs decides what looking gains. Called from another core, it starts
//! after an interrupt of that core, which took 8 to 18 us in a virtual machine, twice for each
//! frame of the path. With the kernel's workers bound to the bridge's core (`lager doctor` says
//! how) the path took 0.39 to 0.41 of what it takes when all sleep, and 0.77 to 0.82 with workers
//! on any core. The runs took turns and took 36 % of a core both ways (two cores, 2026-11-27).

use core::cell::{Cell, RefCell};
use core::fmt;
use core::marker::PhantomData;
use core::num::NonZeroU64;
use core::time::Duration;

use lager_topics::{BridgeRequest, Request, Role, TOPICS, Topic};
use rustix::thread::set_current_timer_slack;

use crate::bus::Bus;
use crate::clock::Clock;
use crate::doorbell::{self, Bell, Pace, Plan, SeatRinger};
use crate::error::PortError;
use crate::policy::Policy;
use crate::untyped::republish_states;
use crate::urgency;

/// Why a wait ended. In both cases drain the topics for which [`Waiter::has`] is true: one ring may
/// stand for many samples, and a sample may have come without one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wake {
    /// Somebody rang.
    Rung,
    /// The time-out came first.
    TimedOut,
}

/// Looks at the word between two readings of the clock, which costs as much as several looks.
const LOOKS: u32 = 64;

/// How long to look before yielding the core, in ns. The head of this file says why.
const GIVE_WAY_NS: u64 = 4_000;

/// One wake in so many drains everything: samples may come without a ring, from writers that know
/// of none.
const WAKES: u32 = 16;

/// Waits for all topics that a service acts on. It stays in the thread that made it, as its ports
/// do:
///
/// ```compile_fail,E0277
/// fn sent_elsewhere(waiter: lager_ports::Waiter) -> impl Send {
///     waiter
/// }
/// ```
pub struct Waiter {
    stays: PhantomData<*const ()>,
    bell: Bell,
    policy: Policy,
    role: Role,
    adaptive: RefCell<Adaptive>,
    sleeps: Cell<u64>,
    /// Everything is to be drained after the last wait.
    everything: Cell<bool>,
    wakes: Cell<u32>,
}

/// What `Policy::Adaptive` keeps.
struct Adaptive {
    pace: Pace,
    /// How many of a board may look without pause.
    limit: usize,
    /// This one is among them.
    spinning: bool,
    /// It had rung before anybody looked at the clock.
    untimed: bool,
    /// When a look caught the last ring, which the pace has not learnt yet: a waiter that was rung
    /// has more urgent things to do.
    caught_ns: Option<u64>,
}

impl Waiter {
    pub(crate) fn new(bus: &Bus, policy: Policy) -> Result<Self, PortError> {
        let role = bus.role();
        if !is_actor(role) {
            return Err(PortError::NotAnActor { role });
        }
        let longest_spin = match policy {
            Policy::Adaptive { longest_spin } => {
                // By default the kernel may end a thread's sleeps 50 us late, which is too late for
                // a nap that must end before the next ring is due. If the slack cannot be set, a
                // ring ends more of the naps.
                let _ = set_current_timer_slack(NonZeroU64::new(1));
                longest_spin
            }
            Policy::Block | Policy::Spin => Duration::ZERO,
        };
        Ok(Self {
            stays: PhantomData,
            bell: Bell::hang(bus.board(), role)?,
            policy,
            role,
            adaptive: RefCell::new(Adaptive {
                pace: Pace::new(nanoseconds(longest_spin)),
                limit: who_may_look(),
                spinning: false,
                untimed: false,
                caught_ns: None,
            }),
            sleeps: Cell::new(0),
            everything: Cell::new(true),
            wakes: Cell::new(0),
        })
    }

    /// Waits until rung, at most `timeout` of real time (see [`crate::Clock::real`]). At a
    /// time-out, and now and then after a ring, readers that have come late get the states that
    /// this thread publishes.
    pub fn wait(&self, timeout: Duration) -> Wake {
        let rung = self.wait_while_not(timeout, || self.bell.rung());
        let wakes = self.wakes.get().wrapping_add(1);
        self.wakes.set(wakes);
        let everything = !rung || wakes.is_multiple_of(WAKES);
        self.everything.set(everything);
        if everything {
            republish_states();
        }
        if rung { Wake::Rung } else { Wake::TimedOut }
    }

    /// Whether the topic has to be drained after a [`Waiter::wait`]: it was rung since this was
    /// last asked, or everything is to be drained, as after a time-out and now and then after a
    /// ring.
    #[inline]
    pub fn has<T: Topic>(&self) -> bool {
        self.rung_for(doorbell::reason(T::ID))
    }

    /// The same for a request.
    #[inline]
    pub fn has_request<R: Request>(&self) -> bool {
        self.rung_for(doorbell::reason(R::ID))
    }

    /// The same for the rings of this process's own threads.
    #[inline]
    pub fn has_inside(&self) -> bool {
        self.rung_for(doorbell::INSIDE)
    }

    fn rung_for(&self, reason: usize) -> bool {
        // Clear the reason in any case: what is drained now needs no second look.
        self.bell.rung_for(reason) || self.everything.get()
    }

    /// How many times it has gone to sleep: each costs one system call here, and one for the
    /// process that wakes it.
    pub fn sleeps(&self) -> u64 {
        self.sleeps.get()
    }

    /// A [`Ringer`] that wakes this waiter from other threads of the process.
    ///
    /// # Errors
    /// None at present.
    pub fn ringer(&self) -> Result<Ringer, PortError> {
        Ok(Ringer {
            seat: self.bell.seat_ringer(),
        })
    }

    /// Waits until `done` or a ring.
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
            this.pace.caught();
            this.pace.rung(at);
        }
        if this.spinning && this.pace.is_quick() && look(done) {
            this.untimed = true;
            return true;
        }
        let now = Clock::monotonic_ns();
        let deadline = now.saturating_add(nanoseconds(timeout));
        if core::mem::take(&mut this.untimed) {
            this.pace.touched(now);
        }
        if let Plan::Look { from, until } = this.pace.plan(now)
            && self.may_spin(this)
        {
            let from = from.min(deadline);
            if from > now && self.sleep(Duration::from_nanos(from - now)) {
                this.pace.rung(Clock::monotonic_ns());
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
            this.pace.in_vain();
        }
        self.stop_spinning(this);
        let left = deadline.saturating_sub(Clock::monotonic_ns());
        let rung = left > 0 && self.sleep(Duration::from_nanos(left));
        if rung {
            this.pace.rung(Clock::monotonic_ns());
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

/// Looks some times, without the clock.
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

/// Looks until there is something, at most `timeout`.
#[inline]
fn look_for(timeout: Duration, mut done: impl FnMut() -> bool) -> bool {
    let mut end = None;
    loop {
        if look(&mut done) {
            return true;
        }
        // The clock is first read when it has taken a while, so a quick ring costs no reading.
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
            .field("role", &self.role)
            .field("policy", &self.policy)
            .finish_non_exhaustive()
    }
}

/// Wakes a [`Waiter`] of this process from any thread; clones ring the same one.
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

fn is_actor(role: Role) -> bool {
    // A guest's topics are in no table of ours.
    role == Role::Guest
        || BridgeRequest::ACTOR == role
        || TOPICS.iter().any(|topic| topic.qos.actors.contains(&role))
}

/// How many waiters may look at a time. Whoever looks gives way to who wants its core, so there may
/// be as many as cores; with one less, of bridge and logic on two cores one always slept. Under a
/// real-time scheduler nobody of a lower priority is given way to, so one core is left to the
/// others. On a single core a look would only pass the core to and fro.
fn who_may_look() -> usize {
    match cores() {
        1 => 0,
        cores if urgency::is_real_time() => cores - 1,
        cores => cores,
    }
}

/// The machine's cores that run, whichever of them this thread may use.
#[allow(unsafe_code)]
fn cores() -> usize {
    // SAFETY: it takes a number and returns one.
    let cores = unsafe { libc::sysconf(libc::_SC_NPROCESSORS_ONLN) };
    usize::try_from(cores).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_acts_is_an_actor_and_who_looks_is_not() {
        assert!(is_actor(Role::Logic) && is_actor(Role::Bridge) && is_actor(Role::Guest));
        assert!(!is_actor(Role::Observer) && !is_actor(Role::Recorder));
    }
}
