//! The words as futexes: atomics in shared memory on which processes can sleep.
//!
//! They are apart from the protocols, which do not know the kernel. The futexes are shared ones: the
//! kernel finds them by their page in memory, so both sides need only share the mapping.

use core::sync::atomic::{AtomicU32, Ordering, fence};
use core::time::Duration;

use rustix::io::Errno;
use rustix::thread::futex::{self, Wait, WaitFlags, WaitPtr, WaitvFlags};
use rustix::time::{ClockId, Timespec, clock_gettime};

use super::board::{REASONS, Seat, WatchWord};
use super::watch::Watched;
use super::word::{Ended, Rung, Word};

impl Word for Seat {
    #[inline]
    fn load(&self, order: Ordering) -> u32 {
        self.word.load(order)
    }

    #[inline]
    fn exchange(&self, current: u32, new: u32, success: Ordering, failure: Ordering) -> bool {
        self.word
            .compare_exchange(current, new, success, failure)
            .is_ok()
    }

    fn sleep_while(&self, value: u32, timeout: Duration) -> Ended {
        sleep_while(&self.word, value, timeout)
    }

    fn wake(&self) -> u32 {
        wake(&self.word, 1)
    }
}

impl Rung for Seat {
    #[inline]
    fn fetch_add(&self, value: u32, order: Ordering) -> u32 {
        self.word.fetch_add(value, order)
    }

    #[inline]
    fn fetch_and(&self, mask: u32, order: Ordering) -> u32 {
        self.word.fetch_and(mask, order)
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

impl Word for WatchWord {
    #[inline]
    fn load(&self, order: Ordering) -> u32 {
        self.0.load(order)
    }

    fn exchange(&self, current: u32, new: u32, success: Ordering, failure: Ordering) -> bool {
        self.0
            .compare_exchange(current, new, success, failure)
            .is_ok()
    }

    fn sleep_while(&self, value: u32, timeout: Duration) -> Ended {
        sleep_while(&self.0, value, timeout)
    }

    fn wake(&self) -> u32 {
        wake(&self.0, i32::MAX as u32)
    }
}

impl Watched for WatchWord {
    #[inline]
    fn fence(&self) {
        fence(Ordering::SeqCst);
    }
}

fn sleep_while(word: &AtomicU32, value: u32, timeout: Duration) -> Ended {
    // A time-out beyond the type's range counts as no time-out. No caller passes one.
    let timeout = Timespec::try_from(timeout).unwrap_or(Timespec {
        tv_sec: 3600,
        tv_nsec: 0,
    });
    match futex::wait(word, futex::Flags::empty(), value, Some(&timeout)) {
        Err(Errno::TIMEDOUT) => Ended::TimedOut,
        // Woken, changed before it slept, or a signal: the waiter looks again in each case.
        _ => Ended::Awake,
    }
}

fn wake(word: &AtomicU32, most: u32) -> u32 {
    // It fails only for an invalid address.
    let woken = futex::wake(word, futex::Flags::empty(), most).unwrap_or_default();
    u32::try_from(woken).unwrap_or(u32::MAX)
}

/// The most words on which the kernel lets a thread sleep at a time (`FUTEX_WAITV_MAX`).
const MOST: usize = 128;

/// How long a thread sleeps on some of its words if it cannot sleep on all of them.
const ON_SOME: Duration = Duration::from_millis(5);

/// Sleeps while each word has the value beside it, at most `timeout`. The memory of `waits` is used
/// again at each call.
///
/// Kernels before 5.16 cannot sleep on several words. There, and with more words than [`MOST`], the
/// sleep is short.
pub(super) fn sleep_while_all<'a>(
    words: impl Iterator<Item = (&'a WatchWord, u32)> + Clone,
    waits: &mut Vec<Wait>,
    timeout: Duration,
) -> Ended {
    waits.clear();
    waits.extend(words.clone().take(MOST).map(|(word, value)| {
        let mut wait = Wait::new();
        wait.val = value.into();
        wait.uaddr = WaitPtr::new(word.0.as_ptr().cast());
        wait.flags = WaitFlags::SIZE_U32;
        wait
    }));
    let timeout = match words.clone().nth(MOST) {
        Some(_) => timeout.min(ON_SOME),
        None => timeout,
    };
    let deadline = Timespec::try_from(timeout)
        .ok()
        .and_then(|timeout| clock_gettime(ClockId::Monotonic).checked_add(timeout));
    let none = WaitvFlags::empty();
    match futex::waitv(waits, none, deadline.as_ref(), ClockId::Monotonic) {
        Err(Errno::TIMEDOUT) => Ended::TimedOut,
        Err(Errno::NOSYS | Errno::PERM) => match { words }.next() {
            Some((word, value)) => word.sleep_while(value, timeout.min(ON_SOME)),
            None => Ended::TimedOut,
        },
        _ => Ended::Awake,
    }
}
