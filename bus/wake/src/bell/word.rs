//! The word on which a waiter sleeps, and how it is rung: the protocol, independent of any machine.
//!
//! ```text
//!      31                                1   0
//!     ┌──────────────────────────────────┬───┐   ring:   reason[why] = 1
//!     │ rings so far, wrapping           │ S │           old = word += 2
//!     └──────────────────────────────────┴───┘           if old has S: wake one sleeper
//!                                   sleeping     sleep:  word: seen -> seen|S, or it has rung
//!     ┌──────────────────────────────────────┐           wait while word == seen|S
//!     │ reasons, a byte each                 │           clear S; seen = word
//!     └──────────────────────────────────────┘   look:   for each why of interest:
//!                                                          reason[why] 1 -> 0: there is something
//! ```
//!
//! There is one waiter and any number of ringers. A ring and the decision to sleep are
//! read-modify-writes of the same word, so one of them comes first: either the waiter finds the
//! ring and does not sleep, or the ringer finds `S` and wakes the waiter. Only the waiter clears
//! `S`. So if a ringer is killed between its addition and its wake, `S` stays set, and the next
//! ringer wakes the waiter.
//!
//! The reasons say which topics to look at. A waiter that takes a reason sees everything that was
//! written before the reason was set. A reason is a byte, so setting it is a plain store into the
//! cache line that the addition needs anyway. If a ringer is killed before its addition, the waiter
//! finds the reason at its next wake.
//!
//! The code is generic over the atomics, so that `interleaving_tests.rs` can run this very source:
//! one waiter and at most two ringers, under every interleaving with at most three preemptions.
//!
//! **Invariant:** only the one waiter of the word sets `S`, and only while it is in
//! [`Sleeper::sleep`]. A waiter that does not look for 2^31 rings may miss them all.

use core::cell::Cell;
use core::sync::atomic::Ordering;
use core::time::Duration;

/// The word's lowest bit: the waiter sleeps, or is about to.
pub(crate) const SLEEPING: u32 = 1;

/// What one ring adds.
pub(crate) const ONE: u32 = 2;

/// Why a sleep ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ended {
    /// It was woken, a signal interrupted it, or it never slept because the word had changed.
    Awake,
    /// The time-out came first.
    TimedOut,
}

/// What a protocol needs of the machine: an atomic word, and sleeping on it as on a futex.
pub(crate) trait Word {
    fn load(&self, order: Ordering) -> u32;
    /// Sets the word to `new` if it is `current`; returns whether it did.
    fn exchange(&self, current: u32, new: u32, success: Ordering, failure: Ordering) -> bool;
    /// Sleeps if the word is still `value`; comparing and going to sleep are one step.
    fn sleep_while(&self, value: u32, timeout: Duration) -> Ended;
    /// Wakes the sleeper, or all of them if there may be several; returns how many it has woken.
    fn wake(&self) -> u32;
}

/// What a seat's word has besides.
pub(crate) trait Rung: Word {
    fn fetch_add(&self, value: u32, order: Ordering) -> u32;
    fn fetch_and(&self, mask: u32, order: Ordering) -> u32;
    fn set_reason(&self, reason: usize, order: Ordering);
    /// Clears the reason; returns whether it was set.
    fn take_reason(&self, reason: usize, order: Ordering) -> bool;
}

/// Rings for `reason`. A waiter that has noticed the ring, or has taken the reason, sees everything
/// that was written before.
pub(crate) fn ring(word: &impl Rung, reason: usize) {
    if count(word, reason) {
        word.wake();
    }
}

/// The first half of a ring; returns whether the second half (the wake) is needed.
pub(crate) fn count(word: &impl Rung, reason: usize) -> bool {
    // The reason has release ordering of its own: a waiter that another ring has woken may take the
    // reason before this ring's addition, and look because of it.
    leave(word, reason);
    word.fetch_add(ONE, Ordering::Release) & SLEEPING != 0
}

/// Leaves `reason` without ringing. The waiter finds it when it next wakes.
pub(crate) fn leave(word: &impl Rung, reason: usize) {
    word.set_reason(reason, Ordering::Release);
}

/// Whether there was a ring for `reason`, or the reason was left, since the last call.
pub(crate) fn rung_for(word: &impl Rung, reason: usize) -> bool {
    word.take_reason(reason, Ordering::Acquire)
}

/// The waiter's side of a word.
pub(crate) struct Sleeper {
    /// The word without [`SLEEPING`] at the last look.
    seen: Cell<u32>,
}

impl Sleeper {
    /// Begins to wait on a word on which nobody else waits. Earlier rings do not count.
    pub(crate) fn new(word: &impl Rung) -> Self {
        // A waiter that was killed while it slept has left `S` set.
        let old = word.fetch_and(!SLEEPING, Ordering::Acquire);
        Self {
            seen: Cell::new(old & !SLEEPING),
        }
    }

    /// Whether it has been rung since the last call. Neither writes nor waits.
    #[inline]
    pub(crate) fn rung(&self, word: &impl Rung) -> bool {
        let now = word.load(Ordering::Acquire);
        now != self.seen.replace(now)
    }

    /// Sleeps until a ring, at most `timeout`; true if a ring or a signal ended the sleep. A ringer
    /// whose wake comes late, after its ring was noticed, may end a sleep too.
    pub(crate) fn sleep(&self, word: &impl Rung, timeout: Duration) -> bool {
        let seen = self.seen.get();
        let asleep = seen | SLEEPING;
        if !word.exchange(seen, asleep, Ordering::Relaxed, Ordering::Relaxed) {
            return self.rung(word);
        }
        let ended = word.sleep_while(asleep, timeout);
        let now = word.fetch_and(!SLEEPING, Ordering::Acquire) & !SLEEPING;
        let rung = now != self.seen.replace(now);
        rung || ended == Ended::Awake
    }
}
