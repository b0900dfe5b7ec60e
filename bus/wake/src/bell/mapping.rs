//! [`Mapping`]: a board in this process's memory.
//!
//! It is apart from the file because the crier's thread has the board too, and may end a moment
//! after the last port.

#![allow(unsafe_code, reason = "a mapping is shared memory")]

use core::ops::Deref;
use core::ptr::NonNull;
use std::fs::File;
use std::io::Error;
use std::sync::Arc;

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use super::board::Board;

/// A board in this process's memory; clones share it.
#[derive(Clone)]
pub(crate) struct Mapping {
    board: NonNull<Board>,
    _mapped: Arc<Mapped>,
}

/// Unmaps the board when it is dropped.
struct Mapped(NonNull<Board>);

// SAFETY: a board consists of atomics and stays mapped until the last drop, in any thread.
unsafe impl Send for Mapping {}
// SAFETY: as above.
unsafe impl Sync for Mapping {}
// SAFETY: as above.
unsafe impl Send for Mapped {}
// SAFETY: as above.
unsafe impl Sync for Mapped {}

impl Mapping {
    pub(crate) fn of(file: &File) -> Result<Self, Error> {
        // SAFETY: a fresh mapping at an address of the kernel's choice. The file has the board's
        // size, and nobody ever makes it smaller.
        let place = unsafe {
            mmap(
                core::ptr::null_mut(),
                size_of::<Board>(),
                ProtFlags::READ | ProtFlags::WRITE,
                MapFlags::SHARED | MapFlags::POPULATE,
                file,
                0,
            )?
        };
        let board = NonNull::new(place.cast()).expect("the kernel maps nothing at 0 unasked");
        Ok(Self {
            board,
            _mapped: Arc::new(Mapped(board)),
        })
    }
}

impl Deref for Mapping {
    type Target = Board;

    #[inline]
    fn deref(&self) -> &Board {
        // SAFETY: mapped with the size of a `Board` until the last drop, page-aligned, and valid for
        // every bit pattern. All references to it are shared, and writes go through atomics.
        unsafe { self.board.as_ref() }
    }
}

impl Drop for Mapped {
    fn drop(&mut self) {
        // SAFETY: `of` mapped it with this size, and nobody can refer to it any more.
        let _ = unsafe { munmap(self.0.as_ptr().cast(), size_of::<Board>()) };
    }
}
