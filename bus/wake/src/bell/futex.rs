//! A seat's word as a futex: an atomic in shared memory on which a process can sleep.
//!
//! It is apart from the protocol, which does not know the kernel. The futex is a shared one: the
//! kernel finds it by its page in memory, so ringer and waiter need only share the mapping.

use core::sync::atomic::Ordering;
use core::time::Duration;

use rustix::io::Errno;
use rustix::thread::futex;
use rustix::time::Timespec;

use super::board::{REASONS, Seat};
use super::word::{Ended, Word};

impl Word for Seat {
    #[inline]
    fn load(&self, order: Ordering) -> u32 {
        self.word.load(order)
    }

    #[inline]
    fn fetch_add(&self, value: u32, order: Ordering) -> u32 {
        self.word.fetch_add(value, order)
    }

    #[inline]
    fn fetch_and(&self, mask: u32, order: Ordering) -> u32 {
        self.word.fetch_and(mask, order)
    }

    #[inline]
    fn exchange(&self, current: u32, new: u32, success: Ordering, failure: Ordering) -> bool {
        self.word
            .compare_exchange(current, new, success, failure)
            .is_ok()
    }

    fn sleep_while(&self, value: u32, timeout: Duration) -> Ended {
        // A time-out beyond the type's range counts as no time-out. No caller passes one.
        let timeout = Timespec::try_from(timeout).unwrap_or(Timespec {
            tv_sec: 3600,
            tv_nsec: 0,
        });
        match futex::wait(&self.word, futex::Flags::empty(), value, Some(&timeout)) {
            Err(Errno::TIMEDOUT) => Ended::TimedOut,
            // Woken, changed before it slept, or a signal: the waiter looks again in each case.
            _ => Ended::Awake,
        }
    }

    fn wake(&self) {
        // It fails only for an invalid address.
        let _ = futex::wake(&self.word, futex::Flags::empty(), 1);
    }

    #[inline]
    fn set_reason(&self, reason: usize, order: Ordering) {
        self.reasons[reason % REASONS].store(1, order);
    }

    #[inline]
    fn take_reason(&self, reason: usize, order: Ordering) -> bool {
        let byte = &self.reasons[reason % REASONS];
        // Most reasons are not set, and a swap costs as much as several looks.
        byte.load(Ordering::Relaxed) != 0 && byte.swap(0, order) != 0
    }
}
