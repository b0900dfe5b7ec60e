//! Asks the kernel for cores and memory, and what it allows.
//!
//! This file stands apart because it has this crate's only `unsafe` of real time, and because
//! everything here acts on the calling thread or process at once. It chooses nothing and explains
//! nothing.

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

/// Lets the calling thread, and all threads that it starts later, run only on `cores`. Returns the
/// cores that the kernel granted: it silently leaves out those that a control group forbids.
pub fn pin(cores: &CoreSet) -> io::Result<CoreSet> {
    let mut wanted = CpuSet::new();
    for core in cores.iter().filter(|core| *core < CpuSet::MAX_CPU) {
        wanted.set(core);
    }
    sched_setaffinity(None, &wanted)?;
    granted()
}

/// The cores on which the calling thread may run now.
pub fn granted() -> io::Result<CoreSet> {
    let granted = sched_getaffinity(None)?;
    Ok((0..CpuSet::MAX_CPU)
        .filter(|core| granted.is_set(*core))
        .collect())
}

/// Keeps all memory of this process in RAM, also memory that it maps later.
///
/// What is mapped now is the program and its libraries, which would have to come from the disk, so
/// the kernel reads all of it. Later mappings are stacks, the heap and segments of the bus, most of
/// which nobody ever touches: each page is locked from its first use on, which takes no disk. 5 s
/// after its start a robot on a mission meets no page for the first time any more (2026-11-28,
/// x86-64). To fill all of them took 35 MiB more for bridge and logic together.
///
/// The C library's allocator would reserve 64 MiB of addresses for each thread. All of them would
/// count as locked although they are never filled, so all threads share the first thread's reserve.
pub fn lock_memory() -> io::Result<()> {
    #[cfg(target_env = "gnu")]
    // SAFETY: two numbers are passed, and no other thread exists yet that could be allocating.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 1);
    }
    rustix::mm::mlockall(MlockAllFlags::CURRENT)?;
    Ok(rustix::mm::mlockall(
        MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT,
    )?)
}

/// Whether the kernel would let this process lock `bytes` more. This reserves them, never fills
/// them, and gives them back.
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
/// `None` is no limit. A soft limit is only a default, and a user who asks for real time wants all
/// that the rights allow.
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
