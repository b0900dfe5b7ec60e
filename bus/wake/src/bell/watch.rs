//! The word on which the watchers of one topic sleep, and how they are woken: the protocol,
//! independent of any machine.
//!
//! A watcher is an observer that has asked to be woken. Any number of watchers sleep on one word:
//!
//! ```text
//!      31                                1   0
//!     ┌──────────────────────────────────┬───┐   writer:  publishes; if word has S: rings its crier
//!     │ cries so far, wrapping           │ S │   crier:   word: n|S -> n+1; wakes all who sleep
//!     └──────────────────────────────────┴───┘   watcher: word: n -> n|S; looks into its queue;
//!               somebody sleeps, or is about to           sleeps while word == n|S
//! ```
//!
//! The writer only reads the word, and goes on. If `S` is set, it wakes one thread, the crier of
//! its own process, however many watchers there are. The crier wakes all of them with one system
//! call. So no watcher ever has to wake another one, and a watcher that is stopped or killed at any
//! moment holds nobody up. It leaves at most `S` set, for which the next sample makes one cry more.
//!
//! A watcher sets `S` and then looks into its queue. A writer fills the queue and then reads `S`.
//! Between both steps each of them has a sequentially consistent fence. So one of them sees what
//! the other did: the watcher finds the sample and does not sleep, or the writer finds `S`. A cry
//! changes the word, so a watcher that is about to sleep looks again.
//!
//! If a writer is killed before its crier has cried, its last sample waits for the next sample of
//! the topic, or for the time after which every watcher looks anyway.
//!
//! The code is generic over the atomics, so that `watch_interleaving_tests.rs` can run this very
//! source.
//!
//! **Invariant:** a watcher never changes the count, and only a cry clears `S`.

use core::sync::atomic::Ordering;
use core::time::Duration;

use super::word::{Ended, ONE, SLEEPING, Word};

/// What a watched word has besides.
pub(crate) trait Watched: Word {
    /// A sequentially consistent fence.
    fn fence(&self);
}

/// Whether somebody sleeps on the word, or is about to. A writer asks this after it has published.
#[inline(always)]
pub(crate) fn is_awaited(word: &impl Watched) -> bool {
    word.fence();
    word.load(Ordering::Relaxed) & SLEEPING != 0
}

/// Wakes all who sleep on the word; returns how many the machine has woken.
pub(crate) fn cry(word: &impl Watched) -> u32 {
    loop {
        let now = word.load(Ordering::Relaxed);
        if now & SLEEPING == 0 {
            return 0;
        }
        let next = now.wrapping_add(ONE) & !SLEEPING;
        if word.exchange(now, next, Ordering::Release, Ordering::Relaxed) {
            return word.wake();
        }
    }
}

/// Announces a sleep; returns the word to sleep on. The watcher looks into its queue after this and
/// sleeps only if nothing is there.
pub(crate) fn announce(word: &impl Watched) -> u32 {
    loop {
        let now = word.load(Ordering::Relaxed);
        let asleep = now | SLEEPING;
        if now == asleep || word.exchange(now, asleep, Ordering::Relaxed, Ordering::Relaxed) {
            word.fence();
            return asleep;
        }
    }
}

/// Sleeps until a cry, at most `timeout`. Does not sleep if there was one since the announcement.
pub(crate) fn sleep(word: &impl Watched, announced: u32, timeout: Duration) -> Ended {
    match word.sleep_while(announced, timeout) {
        Ended::TimedOut if word.load(Ordering::Acquire) == announced => Ended::TimedOut,
        _ => Ended::Awake,
    }
}
