//! What is asked of the kernel for real time, and what it answers when asked what is allowed.
//!
//! It is apart because it has this crate's only `unsafe`, and because everything here acts on the
//! calling thread or process at once. It chooses nothing and explains nothing.

#![allow(
    unsafe_code,
    reason = "the scheduler and the allocator have no safe binding, and trying a lock takes a mapping"
)]

use std::io;
use std::ptr;
use std::time::Duration;

use rustix::mm::{MapFlags, MlockAllFlags, MlockFlags, ProtFlags};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use rustix::thread::{CapabilitySet, CpuSet, sched_getaffinity, sched_setaffinity};

use super::CoreSet;

/// Puts the calling thread, and all threads it starts from now on, under `SCHED_FIFO`.
pub fn set_fifo(priority: u8) -> io::Result<()> {
    let parameter = libc::sched_param {
        sched_priority: i32::from(priority),
    };
    // SAFETY: the pointer is to a live local that the kernel only reads during the call; 0 names
    // the calling thread. glibc and musl differ in what `sched_setscheduler` does (musl refuses),
    // so the system call itself is made.
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

/// Has the normal scheduler deal out time to the calling thread, and to all threads it starts from
/// now on, in slices so long. It needs no right. Kernels before 6.12 answer yes and change nothing.
pub fn set_slice(slice: Duration) -> io::Result<()> {
    // Nice value and policy stay as they are.
    let mut how = scheduled()?;
    how.sched_runtime = slice.as_nanos() as u64;
    set(&how)
}

/// Lets others go before the calling thread, and before all threads it starts from now on: its
/// priority is lower by so many steps, 1 at the least, or its time slices are twice as long for
/// each. It needs no right.
pub fn step_back(steps: u8) -> io::Result<()> {
    let mut how = scheduled()?;
    if how.sched_policy == libc::SCHED_FIFO as u32 {
        how.sched_priority = how.sched_priority.saturating_sub(steps.into()).max(1);
    } else {
        how.sched_runtime <<= steps;
    }
    set(&how)
}

/// How the calling thread is scheduled.
fn scheduled() -> io::Result<libc::sched_attr> {
    // SAFETY: all of its fields are numbers.
    let mut how: libc::sched_attr = unsafe { core::mem::zeroed() };
    let size = size_of_val(&how);
    // SAFETY: the pointer is to a live local of the size that is told, which the kernel fills during
    // the call; the first 0 names the calling thread.
    match unsafe { libc::syscall(libc::SYS_sched_getattr, 0, &raw mut how, size, 0) } {
        0 => Ok(how),
        _ => Err(io::Error::last_os_error()),
    }
}

fn set(how: &libc::sched_attr) -> io::Result<()> {
    // SAFETY: the pointer is to a living value, which tells its own size and which the kernel only
    // reads during the call; the first 0 names the calling thread.
    match unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const *how, 0) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Lets the calling thread, and all threads it starts from now on, run on `cores` alone. Returns
/// what was granted: the kernel leaves out without a word what a control group does not allow.
pub fn pin(cores: &CoreSet) -> io::Result<CoreSet> {
    let mut wanted = CpuSet::new();
    for core in cores.iter().filter(|core| *core < CpuSet::MAX_CPU) {
        wanted.set(core);
    }
    sched_setaffinity(None, &wanted)?;
    granted()
}

/// The cores the calling thread may run on now.
pub fn granted() -> io::Result<CoreSet> {
    let granted = sched_getaffinity(None)?;
    Ok((0..CpuSet::MAX_CPU)
        .filter(|core| granted.is_set(*core))
        .collect())
}

/// Keeps in memory what this process has mapped and whatever it maps from now on.
///
/// The C library's allocator would reserve 64 MiB of addresses for each thread, all of which count
/// as locked although they are never filled; so all threads share the first thread's reserve.
pub fn lock_memory() -> io::Result<()> {
    #[cfg(target_env = "gnu")]
    // SAFETY: two numbers are passed, and no other thread exists yet that could be allocating.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 1);
    }
    Ok(rustix::mm::mlockall(
        MlockAllFlags::CURRENT | MlockAllFlags::FUTURE,
    )?)
}

/// Whether the kernel would let this process lock `bytes` more. They are reserved and given back
/// without ever being filled.
pub fn try_lock(bytes: usize) -> io::Result<()> {
    // SAFETY: a new private mapping at an address of the kernel's choice touches no memory of
    // this process; it is not accessed, and it is unmapped once, with its own length.
    unsafe {
        let region = rustix::mm::mmap_anonymous(
            ptr::null_mut(),
            bytes,
            ProtFlags::READ | ProtFlags::WRITE,
            MapFlags::PRIVATE | MapFlags::NORESERVE,
        )?;
        let locked = rustix::mm::mlock_with(region, bytes, MlockFlags::ONFAULT);
        rustix::mm::munmap(region, bytes)?;
        Ok(locked?)
    }
}

/// Raises the soft limit of `resource` to the hard one, which needs no right, and returns it;
/// `None` is no limit. A soft limit is only a default: who asks for real time wants all he may
/// have.
pub fn whole_limit(resource: Resource) -> Option<u64> {
    let limit = getrlimit(resource);
    if limit.current != limit.maximum {
        let whole = Rlimit {
            current: limit.maximum,
            maximum: limit.maximum,
        };
        if setrlimit(resource, whole).is_err() {
            return limit.current;
        }
    }
    limit.maximum
}

/// Whether this process has the capability `CAP_SYS_NICE`, which frees it from the limit on
/// priorities.
pub fn may_exceed_priority_limit() -> bool {
    rustix::thread::capabilities(None)
        .is_ok_and(|sets| sets.effective.contains(CapabilitySet::SYS_NICE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slice_is_kept_or_unknown_to_the_kernel_and_changes_nothing_else() {
        let before = scheduled().expect("the kernel says");
        set_slice(Duration::from_micros(300)).expect("it needs no right");
        let after = scheduled().expect("the kernel says");
        assert!([0, 300_000].contains(&after.sched_runtime), "{after:?}");
        let others = |how: &libc::sched_attr| (how.sched_policy, how.sched_nice, how.sched_flags);
        assert_eq!(others(&after), others(&before));
        step_back(2).expect("it needs no right");
        let back = scheduled().expect("the kernel says");
        assert_eq!(back.sched_runtime, 4 * after.sched_runtime);
        assert_eq!(others(&back), others(&before));
    }
}
