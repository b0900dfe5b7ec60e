//! The page in which an emulated body publishes its time, as its readers see it.
//!
//! The emulator writes it about every half millisecond. It is a program of its own licence and
//! shares no code with this crate, so the layout stands both here and in
//! `firmware/emulator/src/clock.rs`; `tests/chip.rs` runs both ends. A reader pays two reads and a
//! comparison more than for the system's clock, and no system call.
//!
//! ```text
//! byte  0  the letters "LAGERCLK"
//!       8  version of this layout, 1
//!      16  sequence: odd while the words below change
//!      24  chip time in ns; never goes back, over restarts neither
//!      32  CLOCK_MONOTONIC in ns when that was the time
//!      40  chip ns in a million real ns, over the last tenth of a second; 0 = not yet known
//!      48  process id of the emulator; 0 after a clean end
//!      56  how often an emulator has started on this page
//! ```

#![allow(unsafe_code, reason = "a mapping is shared memory")]

use core::fmt;
use core::hint::spin_loop;
use core::ptr::NonNull;
use core::sync::atomic::{AtomicU64, Ordering, fence};
use std::fs::File;
use std::path::Path;

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use crate::error::OpenError;

const MAGIC: u64 = u64::from_ne_bytes(*b"LAGERCLK");
const VERSION: u64 = 1;
const WORDS: usize = 8;
const BYTES: usize = WORDS * 8;

/// How often a page that is being written is looked at again, some microseconds in all.
const LOOKS: u32 = 1_000;

/// What the page told at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Told {
    /// Chip time in ns.
    pub(super) chip_ns: u64,
    /// `CLOCK_MONOTONIC` in ns when that was the time.
    pub(super) real_ns: u64,
    /// Chip ns in a million real ns, 0 = not known.
    pub(super) rate: u64,
}

/// The page, mapped for reading.
pub(crate) struct Page {
    words: NonNull<[AtomicU64; WORDS]>,
}

// SAFETY: the mapping belongs to the process, not to a thread, and holds only atomics.
unsafe impl Send for Page {}
// SAFETY: as above; nothing is written through it.
unsafe impl Sync for Page {}

impl Page {
    /// Maps the page at `path`, which an emulator has made.
    pub(super) fn open(path: &Path) -> Result<Self, OpenError> {
        let failed = |detail: String| OpenError::NoClock {
            path: path.to_owned(),
            detail,
        };
        let foreign = || OpenError::ForeignClock(path.to_owned());
        let file = File::open(path).map_err(|error| failed(error.to_string()))?;
        let metadata = file.metadata().map_err(|error| failed(error.to_string()))?;
        if !metadata.is_file() || metadata.len() != BYTES as u64 {
            return Err(foreign());
        }
        // SAFETY: a new mapping of a file that has this length. An emulator never shortens it, and
        // it is only read, word by word, through atomics.
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
        // The magic is written last.
        if magic.load(Ordering::Acquire) != MAGIC || version.load(Ordering::Relaxed) != VERSION {
            return Err(foreign());
        }
        Ok(page)
    }

    /// What the page tells now.
    pub(super) fn read(&self) -> Told {
        let [_, _, sequence, chip, real, rate, ..] = self.words();
        whole(sequence, || Told {
            chip_ns: chip.load(Ordering::Relaxed),
            real_ns: real.load(Ordering::Relaxed),
            rate: rate.load(Ordering::Relaxed),
        })
    }

    fn words(&self) -> &[AtomicU64; WORDS] {
        // SAFETY: the mapping has this length, is aligned as a page is, and is unmapped only when
        // this is dropped.
        unsafe { self.words.as_ref() }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // SAFETY: the mapping was made with this length and nobody has a reference into it.
        let _ = unsafe { munmap(self.words.as_ptr().cast(), BYTES) };
    }
}

impl fmt::Debug for Page {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Page").field(&self.read()).finish()
    }
}

/// Reads until no writer has written meanwhile.
///
/// A writer that is killed in the middle leaves the sequence odd until its successor starts. At
/// worst the result then has the time of one update and the moment of the next.
fn whole(sequence: &AtomicU64, mut read: impl FnMut() -> Told) -> Told {
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
pub(super) mod tests {
    use std::fs::OpenOptions;
    use std::os::unix::fs::FileExt;
    use std::path::PathBuf;
    use std::sync::atomic::AtomicU32;

    use super::*;

    /// An emulator's end of a page, in a file of the test's own.
    pub(in crate::clock) struct Writer {
        file: File,
        pub(in crate::clock) path: PathBuf,
    }

    impl Writer {
        pub(in crate::clock) fn new() -> Self {
            static COUNT: AtomicU32 = AtomicU32::new(0);
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let name = format!("lager-page-{}-{number}", std::process::id());
            let path = std::env::temp_dir().join(name);
            let file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(true)
                .open(&path)
                .unwrap();
            let writer = Self { file, path };
            for (word, value) in [(0, MAGIC), (1, VERSION), (7, 1)] {
                writer.set(word, value);
            }
            writer
        }

        pub(in crate::clock) fn set(&self, word: u64, value: u64) {
            self.file
                .write_all_at(&value.to_ne_bytes(), word * 8)
                .unwrap();
        }

        pub(in crate::clock) fn publish(&self, chip_ns: u64, real_ns: u64, rate: u64) {
            for (word, value) in [(3, chip_ns), (4, real_ns), (5, rate)] {
                self.set(word, value);
            }
        }
    }

    impl Drop for Writer {
        fn drop(&mut self) {
            let _ = std::fs::remove_file(&self.path);
        }
    }

    #[test]
    fn a_reader_sees_what_is_published_last() {
        let writer = Writer::new();
        let page = Page::open(&writer.path).unwrap();
        for chip_ns in [5, 6] {
            writer.publish(chip_ns, 100, 999_000);
            let told = Told {
                chip_ns,
                real_ns: 100,
                rate: 999_000,
            };
            assert_eq!(page.read(), told);
        }
    }

    const TORN: Told = Told {
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
            Told { real_ns: 2, ..TORN }
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
