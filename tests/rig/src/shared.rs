//! Memory and descriptors without a name that processes share. Nothing is left when the processes
//! end, however they end.
//!
//! A parent makes them, and its children inherit them by number. The bus does not use them.

use core::fmt;
use core::marker::PhantomData;
use core::ptr::NonNull;
use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use core::time::Duration;
use std::ops::Deref;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::time::Instant;

use rustix::fs::{MemfdFlags, ftruncate, memfd_create};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use crate::Refused;

/// A type that may lie in memory shared with other processes.
///
/// # Safety
/// All zeros are a valid value. Every field is an atomic or an array of atomics, because another
/// process may change it at any time. There is no pointer inside.
#[allow(unsafe_code)]
pub unsafe trait Shareable: Sync {}

/// A `T` in memory shared between processes, all zeros at first.
pub struct Shared<T: Shareable> {
    memory: NonNull<T>,
    file: OwnedFd,
    owns: PhantomData<T>,
}

impl<T: Shareable> Shared<T> {
    /// Makes the shared memory.
    ///
    /// # Errors
    /// The kernel gives no memory or no descriptor.
    pub fn new() -> Result<Self, Refused> {
        // Without CLOEXEC: children inherit it.
        let file = memfd_create("lager-rig", MemfdFlags::empty()).map_err(no_memory)?;
        ftruncate(&file, size_of::<T>() as u64).map_err(no_memory)?;
        Self::map(file)
    }

    /// Maps the memory that the parent has made; `number` is the parent's descriptor.
    ///
    /// # Errors
    /// The kernel cannot map it.
    pub fn inherited(number: RawFd) -> Result<Self, Refused> {
        Self::map(inherit(number))
    }

    /// The descriptor's number, by which a child maps the memory.
    #[must_use]
    pub fn number(&self) -> RawFd {
        self.file.as_raw_fd()
    }

    #[allow(unsafe_code)]
    fn map(file: OwnedFd) -> Result<Self, Refused> {
        // SAFETY: a new mapping at an address of the kernel's choice touches no other memory.
        let memory = unsafe {
            mmap(
                core::ptr::null_mut(),
                size_of::<T>(),
                ProtFlags::READ | ProtFlags::WRITE,
                MapFlags::SHARED | MapFlags::POPULATE,
                &file,
                0,
            )
        }
        .map_err(no_memory)?;
        Ok(Self {
            memory: NonNull::new(memory.cast()).expect("the kernel maps nothing at 0 unasked"),
            file,
            owns: PhantomData,
        })
    }
}

impl<T: Shareable> Deref for Shared<T> {
    type Target = T;

    #[allow(unsafe_code)]
    fn deref(&self) -> &T {
        // SAFETY: the mapping is page-aligned, as large as `T`, initialised with zeros, lives as
        // long as `self`, and `Shareable` allows others to change it meanwhile.
        unsafe { self.memory.as_ref() }
    }
}

impl<T: Shareable> Drop for Shared<T> {
    #[allow(unsafe_code)]
    fn drop(&mut self) {
        // SAFETY: it was mapped with this size, and references to it ended before `self`.
        let _ = unsafe { munmap(self.memory.as_ptr().cast(), size_of::<T>()) };
    }
}

impl<T: Shareable> fmt::Debug for Shared<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_tuple("Shared")
            .field(&self.number())
            .finish()
    }
}

/// The descriptor that the parent has made, by its number. Call this at most once for a number.
#[must_use]
#[allow(unsafe_code)]
pub fn inherit(number: RawFd) -> OwnedFd {
    // SAFETY: the parent made the descriptor without CLOEXEC for this process and told the number
    // to nobody else, and each number is taken over once.
    unsafe { OwnedFd::from_raw_fd(number) }
}

fn no_memory(error: rustix::io::Errno) -> Refused {
    Refused::to_make("memory shared between the processes")(error)
}

/// A barrier at which processes wait for each other before they start measuring.
#[derive(Debug)]
#[repr(C, align(64))]
pub struct Barrier {
    arrived: AtomicU32,
}

impl Barrier {
    /// Waits until all processes, `all` in number, have reached their barrier number `round`,
    /// counted from 1. Looks without sleeping, so that all go on at the same time. Returns false if
    /// one process has not come within `limit`.
    pub fn pass(&self, all: u32, round: u32, limit: Duration) -> bool {
        let start = Instant::now();
        self.arrived.fetch_add(1, Ordering::AcqRel);
        while self.arrived.load(Ordering::Acquire) < all * round {
            if start.elapsed() > limit {
                return false;
            }
            // The other processes may need this core.
            rustix::thread::sched_yield();
        }
        true
    }
}

/// A number that one process sets and another waits for, in a cache line of its own.
#[derive(Debug)]
#[repr(C, align(64))]
pub struct Counter(AtomicU64);

impl Counter {
    /// Sets the number. A process that sees it also sees everything that was written before.
    pub fn set(&self, number: u64) {
        self.0.store(number, Ordering::Release);
    }

    /// Waits without sleeping until the value is `number`; false if `limit` has passed.
    pub fn becomes(&self, number: u64, limit: Duration) -> bool {
        // Reading the clock costs more than reading a word.
        const LOOKS: u32 = 1_000;
        let start = Instant::now();
        while start.elapsed() < limit {
            for _ in 0..LOOKS {
                if self.0.load(Ordering::Acquire) == number {
                    return true;
                }
                // The other process may need this core.
                rustix::thread::sched_yield();
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[repr(C)]
    struct Words {
        barrier: Barrier,
        counter: Counter,
        word: AtomicU32,
    }

    // SAFETY: atomics only.
    #[allow(unsafe_code)]
    unsafe impl Shareable for Words {}

    #[test]
    fn what_one_mapping_writes_another_reads() {
        let one = Shared::<Words>::new().unwrap();
        assert_eq!(one.word.load(Ordering::Relaxed), 0);
        let number = rustix::io::dup(&one.file).unwrap();
        let other = Shared::<Words>::map(number).unwrap();
        one.word.store(7, Ordering::Release);
        assert_eq!(other.word.load(Ordering::Acquire), 7);
    }

    #[test]
    fn nobody_passes_the_barrier_alone() {
        let memory = Shared::<Words>::new().unwrap();
        assert!(!memory.barrier.pass(2, 1, Duration::from_millis(5)));
        assert!(memory.barrier.pass(2, 1, Duration::from_secs(60)));
    }

    #[test]
    fn a_counter_is_waited_for() {
        let memory = Shared::<Words>::new().unwrap();
        let limit = Duration::from_millis(5);
        assert!(!memory.counter.becomes(7, limit));
        memory.counter.set(7);
        assert!(memory.counter.becomes(7, Duration::from_secs(60)));
    }
}
