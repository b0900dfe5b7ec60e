//! The page of shared memory in which an emulated robot publishes its time, as readers see it.
//!
//! The emulator writes it about every half millisecond. It is a workspace of its own,
//! without the crates of the bus, so the layout stands both here and in
//! `firmware/emulator/src/clock.rs`; `tests/chip.rs` runs both sides. A reader makes two reads and
//! a comparison more than for the system's clock, and no system call.
//!
//! ```text
//! byte  0  the letters "LAGERCLK"
//!       8  version of this layout, 1
//!      16  sequence: odd while the words below change
//!       24  chip time in ns; never goes back, not even over restarts
//!       32  CLOCK_MONOTONIC in ns at that time
//!       40  chip ns per million real ns, over the last tenth of a second; 0 = not yet known
//!       48  process id of the emulator; 0 after it has ended in order
//!      56  how often an emulator has started on this page
//! ```

#![allow(unsafe_code, reason = "a mapping is shared memory")]

use core::fmt;
use core::hint::spin_loop;
use core::ptr::NonNull;
use core::sync::atomic::{AtomicU64, Ordering, fence};
use std::fs::File;
use std::path::{Path, PathBuf};

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

pub(super) const MAGIC: u64 = u64::from_ne_bytes(*b"LAGERCLK");
pub(super) const VERSION: u64 = 1;
const WORDS: usize = 8;
const BYTES: usize = WORDS * 8;

/// How often a reader looks again at a page that is being written: some microseconds in all.
const LOOKS: u32 = 1_000;

/// Why a clock page cannot be followed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClockError {
    /// The emulated robot's clock page cannot be read.
    #[error(
        "the clock page {path} cannot be read ({detail}); an emulated body publishes it: is one up?"
    )]
    Missing {
        /// The page's file.
        path: PathBuf,
        /// The system's reason.
        detail: String,
    },
    /// The file is something else than a clock page.
    #[error(
        "{0} is no clock page, or one of another build; name the file into which the emulated body writes its time"
    )]
    Foreign(PathBuf),
}

/// The contents of the page at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reading {
    /// Chip time in ns.
    pub(super) chip_ns: u64,
    /// `CLOCK_MONOTONIC` in ns at that time.
    pub(super) real_ns: u64,
    /// Chip ns per million real ns; 0 = not known.
    pub(super) rate: u64,
}

/// The page, mapped for reading.
pub(crate) struct Page {
    words: NonNull<[AtomicU64; WORDS]>,
}

// SAFETY: the mapping belongs to the process, not to a thread, and holds only atomics.
unsafe impl Send for Page {}
// SAFETY: as above; and this process only reads the mapping.
unsafe impl Sync for Page {}

impl Page {
    /// Maps the page at `path`, which an emulator has made.
    pub(super) fn open(path: &Path) -> Result<Self, ClockError> {
        let failed = |detail: String| ClockError::Missing {
            path: path.to_owned(),
            detail,
        };
        let foreign = || ClockError::Foreign(path.to_owned());
        let file = File::open(path).map_err(|error| failed(error.to_string()))?;
        let metadata = file.metadata().map_err(|error| failed(error.to_string()))?;
        if !metadata.is_file() || metadata.len() != BYTES as u64 {
            return Err(foreign());
        }
        // SAFETY: a new mapping of a file that has this length. An emulator never shortens the
        // file, and this process only reads it, word by word, through atomics.
        let start = unsafe {
            mmap(
                core::ptr::null_mut(),
                BYTES,
                ProtFlags::READ,
                MapFlags::SHARED,
                &file,
                0,
            )
        };
        let start = start.map_err(|errno| failed(errno.to_string()))?;
        let words = NonNull::new(start.cast()).ok_or_else(|| failed("no memory".to_owned()))?;
        let page = Self { words };
        let [magic, version, ..] = page.words();
        // The emulator writes the magic number last.
        if magic.load(Ordering::Acquire) != MAGIC || version.load(Ordering::Relaxed) != VERSION {
            return Err(foreign());
        }
        Ok(page)
    }

    /// The page's present contents.
    pub(super) fn read(&self) -> Reading {
        let [_, _, sequence, chip, real, rate, ..] = self.words();
        whole(sequence, || Reading {
            chip_ns: chip.load(Ordering::Relaxed),
            real_ns: real.load(Ordering::Relaxed),
            rate: rate.load(Ordering::Relaxed),
        })
    }

    fn words(&self) -> &[AtomicU64; WORDS] {
        // SAFETY: the mapping has this length, is page-aligned, and stays until `self` is dropped.
        unsafe { self.words.as_ref() }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // SAFETY: the mapping was made with this length, and nobody has a reference into it.
        let _ = unsafe { munmap(self.words.as_ptr().cast(), BYTES) };
    }
}

impl fmt::Debug for Page {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Page").field(&self.read()).finish()
    }
}

/// Reads again until no writer has written during the reading.
///
/// A writer that is killed while it writes leaves the sequence odd until its successor starts. At
/// worst the result then has the time of one update and the moment of the next.
fn whole(sequence: &AtomicU64, mut read: impl FnMut() -> Reading) -> Reading {
    for _ in 0..LOOKS {
        let before = sequence.load(Ordering::Acquire);
        if before.is_multiple_of(2) {
            let told = read();
            fence(Ordering::Acquire);
            if sequence.load(Ordering::Relaxed) == before {
                return told;
            }
        }
        spin_loop();
    }
    read()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::tests::Writer;

    #[test]
    fn a_reader_sees_what_is_published_last() {
        let writer = Writer::new();
        let page = Page::open(&writer.path).unwrap();
        for chip_ns in [5, 6] {
            writer.publish(chip_ns, 100, 999_000);
            let told = Reading {
                chip_ns,
                real_ns: 100,
                rate: 999_000,
            };
            assert_eq!(page.read(), told);
        }
    }

    const TORN: Reading = Reading {
        chip_ns: 2,
        real_ns: 1,
        rate: 0,
    };

    #[test]
    fn what_was_torn_by_an_update_is_read_again() {
        let sequence = AtomicU64::new(4);
        let mut reads = 0;
        let told = whole(&sequence, || {
            reads += 1;
            if reads == 1 {
                sequence.store(6, Ordering::Release);
                return TORN;
            }
            Reading { real_ns: 2, ..TORN }
        });
        assert_eq!((reads, told.real_ns), (2, 2));
    }

    #[test]
    fn nothing_is_read_while_it_is_written() {
        let writer = Writer::new();
        let page = Page::open(&writer.path).unwrap();
        writer.set(2, 3);
        let [_, _, sequence, ..] = page.words();
        let mut reads = 0;
        // Nor does a writer that was killed there stop its readers for ever.
        let told = whole(sequence, || {
            reads += 1;
            TORN
        });
        assert_eq!((reads, told), (1, TORN));
    }

    #[test]
    fn what_is_no_page_is_refused_with_a_sentence() {
        let writer = Writer::new();
        let refused = |path: &Path| Page::open(path).unwrap_err().to_string();
        let missing = refused(Path::new("/nonexistent/clock"));
        assert!(
            missing.contains("/nonexistent/clock") && missing.contains("up"),
            "{missing}"
        );
        assert!(refused(Path::new("/tmp")).contains("no clock page"));
        writer.set(1, 2);
        assert!(refused(&writer.path).contains("no clock page"));
        writer.set(1, VERSION);
        writer.set(8, 0);
        assert!(refused(&writer.path).contains("no clock page"));
        writer.file.set_len(0).unwrap();
        assert!(refused(&writer.path).contains("no clock page"));
    }
}
