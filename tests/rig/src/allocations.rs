//! An allocator that counts its calls, for programs that check that some code allocates nothing.
//!
//! ```ignore
//! #[global_allocator]
//! static COUNTING: Counting = Counting;
//! ```
#![allow(unsafe_code, reason = "an allocator cannot be had otherwise")]

use core::cell::Cell;
use core::sync::atomic::{AtomicU64, Ordering};
use std::alloc::{GlobalAlloc, Layout, System};

/// The system's allocator, which also counts the allocations.
#[derive(Clone, Copy, Debug)]
pub struct Counting;

static OF_ALL: AtomicU64 = AtomicU64::new(0);

thread_local! {
    static OF_THIS_THREAD: Cell<u64> = const { Cell::new(0) };
    static IS_EXEMPT: Cell<bool> = const { Cell::new(false) };
}

/// The number of allocations so far by all threads that are not exempt.
pub fn of_all_threads() -> u64 {
    OF_ALL.load(Ordering::Relaxed)
}

/// The number of allocations that the calling thread makes while `work` runs.
pub fn of(work: impl FnOnce()) -> u64 {
    let before = OF_THIS_THREAD.get();
    work();
    OF_THIS_THREAD.get() - before
}

/// From now on [`of_all_threads`] does not count the calling thread, because that thread belongs to
/// the test and not to the tested program.
pub fn exempt_this_thread() {
    IS_EXEMPT.set(true);
}

fn count() {
    // A thread that is ending has already lost its counter. Such a thread is not under test.
    let _ = OF_THIS_THREAD.try_with(|count| count.set(count.get() + 1));
    if !IS_EXEMPT.try_with(Cell::get).unwrap_or(true) {
        OF_ALL.fetch_add(1, Ordering::Relaxed);
    }
}

// SAFETY: every call is handed to the system's allocator unchanged; counting touches only atomics
// and thread-locals without a destructor, and neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps `alloc`'s contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps `alloc_zeroed`'s contract, which is the same.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: `pointer` came from `System` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: `pointer` came from `System` with this layout.
        unsafe { System.realloc(pointer, layout, size) }
    }
}
