//! How a writer and its readers take turns, in `ring-64` and `publish`: words in shared memory say
//! which sample the readers are ready for, and which one the writer has published.

use core::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use lager_rig::Shareable;

use crate::baseline::{Fault, LIMIT};

/// What writer and readers share.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Turns {
    ready: Word,
    published: Word,
}

// SAFETY: atomics only, and zeros are valid.
#[allow(unsafe_code)]
unsafe impl Shareable for Turns {}

/// The number of a sample, in a cache line of its own.
#[derive(Debug)]
#[repr(C, align(64))]
struct Word(AtomicU64);

impl Turns {
    /// The readers have all that came before sample `number`, and wait for it.
    pub(crate) fn are_ready_for(&self, number: u64) {
        self.ready.0.store(number, Ordering::Release);
    }

    /// The writer waits until its readers are ready for sample `number`.
    pub(crate) fn await_readers(&self, number: u64) -> Result<(), Fault> {
        self.ready.becomes(number)
    }

    /// The writer has published sample `number`.
    pub(crate) fn has_published(&self, number: u64) {
        self.published.0.store(number, Ordering::Release);
    }

    /// The readers wait for sample `number` without looking into their queues.
    pub(crate) fn await_writer(&self, number: u64) -> Result<(), Fault> {
        self.published.becomes(number)
    }
}

impl Word {
    fn becomes(&self, number: u64) -> Result<(), Fault> {
        // Looking at the clock costs more than looking at a word.
        const LOOKS: u32 = 1_000;
        let start = Instant::now();
        while start.elapsed() < LIMIT {
            for _ in 0..LOOKS {
                if self.0.load(Ordering::Acquire) == number {
                    return Ok(());
                }
                // The other process may be on this core.
                rustix::thread::sched_yield();
            }
        }
        Err(Fault::Silent)
    }
}
