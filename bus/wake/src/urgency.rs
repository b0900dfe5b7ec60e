//! How soon the kernel gives a thread a core when several threads want one.
//!
//! Each function acts on the calling thread and on all threads that this thread starts afterwards.
//!
//! **The later stage of the path goes first**: on a core that several threads of the path share,
//! the bridge's main loop goes before logic, and logic before the bridge's readers ([`step_back`]).
//! So a ring takes the core from the thread that rang, which then only has to serve observers and
//! to wait. With bridge and logic on one core under `SCHED_FIFO`, alone and beside 63 observers,
//! the path's p50 was 15 and 14 us instead of 27 and 32, and p99 was 53 and 58 us instead of 72 and
//! 94. Under the normal scheduler p50 was 21 and 20 us instead of 29 and 33 (blocks of 16 s, one or
//! two of each, 2026-11-26).
//!
//! **Short slices**: under the normal scheduler, a thread with short time slices gets a core sooner
//! when it wakes, before threads with longer slices, and these get no less time in all
//! ([`shorten_slices`]). In runs that stopped and continued 64 observers every few seconds, on two
//! cores, the path's p99 beside them was 99 us instead of 140. On a noisier day it was 1.31 times
//! its value without observers instead of 1.52 times (2026-11-25).
//!
//! **Late timers**: an observer's thread need not wake to the microsecond ([`wake_with_others`]).
//! In a virtual machine, a frame took 60 us and more instead of 20 if a timer went off while it was
//! on its way. With 63 observers on two cores, 1 300 timers a second went off on the path's core.
//! When all observers but the recorder could wait for each other's timers, 780 went off, and
//! without observers 510 (one trace of 8 s each, 2026-11-26).

#![allow(unsafe_code, reason = "the scheduler has no safe binding")]

use core::num::NonZeroU64;
use core::time::Duration;
use std::io;

use rustix::thread::set_current_timer_slack;

use crate::policy::Policy;

/// The shortest time slice that Linux gives. The default was 1.4 ms where this was measured.
const SLICE: Duration = Duration::from_micros(100);

/// The time slice of a thread that may wait; about Linux's default.
const LONG_SLICE: Duration = Duration::from_millis(3);

/// Puts the calling thread under `SCHED_FIFO`, where it goes before all threads of a lower priority
/// and of the normal scheduler. Priorities are 1 to 99.
///
/// # Errors
/// The user may not do this, or the control group has no time for it.
pub fn set_fifo(priority: u8) -> io::Result<()> {
    let parameter = libc::sched_param {
        sched_priority: i32::from(priority),
    };
    // SAFETY: the pointer is to a live local that the kernel only reads during the call; 0 names
    // the calling thread. This is the bare system call because `sched_setscheduler` differs in
    // glibc and musl (musl refuses).
    let answer = unsafe {
        libc::syscall(
            libc::SYS_sched_setscheduler,
            0,
            libc::SCHED_FIFO,
            &raw const parameter,
        )
    };
    if answer == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// Gives the calling thread slices of 100 us under the normal scheduler. Any user may do this.
/// Kernels before 6.12 report success and change nothing.
///
/// # Errors
/// The kernel refuses, for example in a sandbox.
pub fn shorten_slices() -> io::Result<()> {
    // Nice value and policy stay as they are.
    let mut how = scheduled()?;
    how.sched_runtime = SLICE.as_nanos() as u64;
    set(&how)
}

/// Lets threads that are `steps` later on the path go before the calling thread. Its priority
/// becomes lower by so many steps, to 1 at least, or its time slices twice as long for each step.
/// Any user may do this. `waiting` is how the calling thread waits.
///
/// A thread that does not sleep while it waits is left unchanged, because the threads behind it
/// would never get their core.
pub fn step_back(steps: u8, waiting: Policy) {
    if waiting != Policy::Block {
        return;
    }
    // A sandbox may forbid the call. The threads of the path then all have one priority.
    if let Err(error) = lower(steps) {
        tracing::debug!("not {steps} steps behind others: {error}");
    }
}

fn lower(steps: u8) -> io::Result<()> {
    let mut how = scheduled()?;
    if how.sched_policy == libc::SCHED_FIFO as u32 {
        how.sched_priority = how.sched_priority.saturating_sub(steps.into()).max(1);
    } else {
        how.sched_runtime <<= steps;
    }
    set(&how)
}

/// Puts the calling thread under the normal scheduler with slices of 3 ms, behind all threads of the
/// path, whatever it has inherited.
pub(crate) fn stand_back() {
    // A sandbox may forbid the call. The thread then stays as it was.
    let done = scheduled().and_then(|mut how| {
        how.sched_policy = libc::SCHED_OTHER as u32;
        how.sched_priority = 0;
        how.sched_runtime = LONG_SLICE.as_nanos() as u64;
        set(&how)
    });
    if let Err(error) = done {
        tracing::debug!("not behind the path: {error}");
    }
}

/// Lets the kernel end the calling thread's waits later, by at most this time, together with those
/// of other threads. Threads under `SCHED_FIFO` still wake on time.
pub fn wake_with_others(late_at_most: Duration) {
    let late_at_most = u64::try_from(late_at_most.as_nanos()).unwrap_or(u64::MAX);
    // A sandbox may forbid the call; the thread then wakes on time.
    let _ = set_current_timer_slack(NonZeroU64::new(late_at_most));
}

/// Whether the calling thread goes before all threads of the normal scheduler; false if unknown.
pub(crate) fn is_real_time() -> bool {
    let real_time = [libc::SCHED_FIFO, libc::SCHED_RR, libc::SCHED_DEADLINE];
    scheduled().is_ok_and(|how| real_time.iter().any(|one| *one as u32 == how.sched_policy))
}

/// The calling thread's present scheduling.
fn scheduled() -> io::Result<libc::sched_attr> {
    // SAFETY: all of its fields are numbers.
    let mut how: libc::sched_attr = unsafe { core::mem::zeroed() };
    let size = size_of_val(&how);
    // SAFETY: the pointer is to a live local of size `size`, which the kernel fills during the
    // call; the first 0 names the calling thread.
    match unsafe { libc::syscall(libc::SYS_sched_getattr, 0, &raw mut how, size, 0) } {
        0 => Ok(how),
        _ => Err(io::Error::last_os_error()),
    }
}

fn set(how: &libc::sched_attr) -> io::Result<()> {
    // SAFETY: the pointer is to a living value that contains its own size, and the kernel only
    // reads it during the call; the first 0 names the calling thread.
    match unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const *how, 0) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_knows_whether_it_has_real_time() {
        std::thread::spawn(|| {
            assert!(!is_real_time());
            let may = set_fifo(1).is_ok();
            assert_eq!(is_real_time(), may);
            stand_back();
            assert!(!is_real_time());
        })
        .join()
        .expect("it knows");
    }

    #[test]
    fn a_slice_is_kept_or_unknown_to_the_kernel_and_changes_nothing_else() {
        let before = scheduled().expect("the kernel says");
        shorten_slices().expect("it needs no right");
        let after = scheduled().expect("the kernel says");
        assert!([0, 100_000].contains(&after.sched_runtime), "{after:?}");
        let others = |how: &libc::sched_attr| (how.sched_policy, how.sched_nice, how.sched_flags);
        assert_eq!(others(&after), others(&before));
        step_back(2, Policy::Spin);
        let same = scheduled().expect("the kernel says");
        assert_eq!(same.sched_runtime, after.sched_runtime);
        step_back(2, Policy::Block);
        let back = scheduled().expect("the kernel says");
        assert_eq!(back.sched_runtime, 4 * after.sched_runtime);
        assert_eq!(others(&back), others(&before));
    }
}
