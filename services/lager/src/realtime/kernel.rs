//! Cores and memory as asked of the kernel, and what it answers when asked what is allowed.
//!
//! It is apart because it has this crate's only `unsafe`, and because everything here acts on the
//! calling thread or process at once. It chooses nothing and explains nothing.

#![allow(
    unsafe_code,
    reason = "the allocator has no safe binding, and trying a lock takes a mapping"
)]

use std::io;
use std::ptr;

use rustix::mm::{MapFlags, MlockAllFlags, MlockFlags, ProtFlags};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use rustix::thread::{CapabilitySet, CpuSet, sched_getaffinity, sched_setaffinity};

use super::CoreSet;

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
