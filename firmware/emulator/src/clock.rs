//! The chips' time in a shared page, for all processes on this machine.
//!
//! Leases and time-outs of the robot's services count the body's time. A simulated body follows the
//! services' clock. An emulated body cannot promise a speed, so the services follow its clock. The
//! page holds eight 64-bit words in the machine's byte order:
//!
//! ```text
//! byte  0  the letters "LAGERCLK"
//!       8  version of this layout, 1
//!      16  sequence: odd while the words below change; read it before and after them
//!      24  chip time in ns; never goes back, not even over restarts
//!      32  CLOCK_MONOTONIC in ns at that chip time
//!      40  chip ns in a million real ns, over the last tenth of a second; 0 = not yet known
//!      48  process id of the emulator; 0 after a clean end
//!      56  how often an emulator has started on this page
//! ```
//!
//! Updates come about every 0.5 ms. Between them a reader may extrapolate at the rate, but by no
//! more than 1 ms: after that the emulator is late, and the reader's time stands still too. `flock`
//! lets only one emulator write a page, so a killed emulator and its successor cannot turn time
//! back.
#![allow(unsafe_code)] // Mapping a file is; every block says why it is sound.

use core::sync::atomic::{AtomicU64, Ordering, fence};
use core::time::Duration;
use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Instant;

use rustix::fs::{FlockOperation, flock};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use rustix::time::{ClockId, clock_gettime};
use thiserror::Error;

const MAGIC: u64 = u64::from_ne_bytes(*b"LAGERCLK");
const VERSION: u64 = 1;
const WORDS: usize = 8;
const BYTES: usize = WORDS * 8;
/// How long to wait until the emulator before this one has released the page.
const PATIENCE: Duration = Duration::from_secs(2);
/// The rate is measured over this time.
const RATE_SPAN: Duration = Duration::from_millis(100);

/// Why a clock page cannot be used.
#[derive(Debug, Error)]
pub enum ClockError {
    /// The file cannot be opened or sized.
    #[error("cannot open the clock page {path}: {source}; does its folder exist?")]
    Open {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The file has other content.
    #[error("{0} is not a clock page; choose another file")]
    Foreign(PathBuf),
    /// Another emulator writes it.
    #[error("another emulator publishes its time in {0}; end it, or choose another file")]
    Taken(PathBuf),
}

/// The emulator's side of the page.
#[derive(Debug)]
pub struct ClockPage {
    words: *mut AtomicU64,
    /// Holds the lock that keeps others from writing.
    _file: File,
    /// Chip time of the emulators before this one.
    base: u64,
    mark: (u64, u64),
}

impl ClockPage {
    /// Opens the page at `path`, or makes it. An existing page continues from its time, as soon as
    /// the emulator that wrote it has ended.
    ///
    /// # Errors
    /// The file cannot be opened, is not a clock page, or belongs to a running emulator.
    pub fn open(path: &Path) -> Result<Self, ClockError> {
        let failed = |source| ClockError::Open {
            path: path.to_owned(),
            source,
        };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(failed)?;
        let patience = Instant::now();
        while flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
            if patience.elapsed() > PATIENCE {
                return Err(ClockError::Taken(path.to_owned()));
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        let mut content = Vec::new();
        file.read_to_end(&mut content).map_err(failed)?;
        // Check whose file it is before writing to it.
        let base = kept_time(&content).ok_or_else(|| ClockError::Foreign(path.to_owned()))?;
        file.set_len(BYTES as u64).map_err(failed)?;
        // SAFETY: a new mapping of a file of this length; here and in readers it is accessed only
        // by atomics.
        let words = unsafe {
            mmap(
                core::ptr::null_mut(),
                BYTES,
                ProtFlags::READ | ProtFlags::WRITE,
                MapFlags::SHARED,
                &file,
                0,
            )
        };
        let mut page = Self {
            words: words.map_err(|errno| failed(errno.into()))?.cast(),
            _file: file,
            base,
            mark: (0, 0),
        };
        page.start();
        Ok(page)
    }

    /// Publishes that the chips have run for `time` since power came on.
    pub fn publish(&mut self, time: Duration) {
        let (chip, real) = (self.base + time.as_nanos() as u64, monotonic_ns());
        let (marked_chip, marked_real) = self.mark;
        let span = real.saturating_sub(marked_real);
        let mut rate = self.word(5).load(Ordering::Relaxed);
        if span >= RATE_SPAN.as_nanos() as u64 {
            let ran = chip.saturating_sub(marked_chip);
            rate = (u128::from(ran) * 1_000_000 / u128::from(span)) as u64;
            self.mark = (chip, real);
        }
        self.write([(3, chip), (4, real), (5, rate)]);
    }

    fn start(&mut self) {
        let starts = self.word(7).load(Ordering::Relaxed) + 1;
        let real = monotonic_ns();
        self.mark = (self.base, real);
        let id = rustix::process::getpid().as_raw_nonzero().get();
        self.write([
            (3, self.base),
            (4, real),
            (5, 0),
            (6, u64::from(id.unsigned_abs())),
            (7, starts),
        ]);
        self.word(1).store(VERSION, Ordering::Relaxed);
        self.word(0).store(MAGIC, Ordering::Release);
    }

    /// Changes words so that no reader gets a mixture of old and new ones.
    fn write<const COUNT: usize>(&self, words: [(usize, u64); COUNT]) {
        let sequence = self.word(2).load(Ordering::Relaxed);
        // A killed emulator may have left the sequence odd.
        let odd = sequence | 1;
        self.word(2).store(odd, Ordering::Relaxed);
        fence(Ordering::Release);
        for (index, value) in words {
            self.word(index).store(value, Ordering::Relaxed);
        }
        self.word(2).store(odd + 1, Ordering::Release);
    }

    fn word(&self, index: usize) -> &AtomicU64 {
        assert!(index < WORDS, "the page has eight words");
        // SAFETY: inside the mapping, which is page-aligned and stays until the drop.
        unsafe { &*self.words.add(index) }
    }
}

impl Drop for ClockPage {
    fn drop(&mut self) {
        self.write([(6, 0)]);
        // SAFETY: the mapping has this length, and nobody holds a reference into it.
        let _ = unsafe { munmap(self.words.cast(), BYTES) };
    }
}

/// The time in an existing page; 0 if the file is empty or was never finished, `None` if it has
/// other content.
fn kept_time(content: &[u8]) -> Option<u64> {
    let word = |index: usize| {
        let bytes = content.get(8 * index..8 * index + 8)?;
        Some(u64::from_ne_bytes(bytes.try_into().ok()?))
    };
    if content.iter().all(|byte| *byte == 0) {
        return Some(0);
    }
    let is_page = content.len() == BYTES && word(0)? == MAGIC && word(1)? == VERSION;
    is_page.then(|| word(3)).flatten()
}

/// `CLOCK_MONOTONIC` in ns.
pub(crate) fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(path: &Path) -> Vec<u64> {
        let bytes = std::fs::read(path).unwrap();
        bytes
            .chunks_exact(8)
            .map(|word| u64::from_ne_bytes(word.try_into().unwrap()))
            .collect()
    }

    #[test]
    fn time_goes_on_over_a_restart_and_never_back() {
        let path = std::env::temp_dir().join(format!("lager-clock-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let before = monotonic_ns();
        let mut page = ClockPage::open(&path).unwrap();
        page.publish(Duration::from_millis(5));
        let seen = words(&path);
        assert_eq!(&seen[..2], [MAGIC, VERSION]);
        assert_eq!((seen[2] % 2, seen[3], seen[7]), (0, 5_000_000, 1));
        assert!(seen[4] >= before && seen[6] == u64::from(std::process::id()));
        drop(page);
        assert_eq!(words(&path)[6], 0);

        let mut page = ClockPage::open(&path).unwrap();
        assert_eq!(words(&path)[3], 5_000_000);
        page.publish(Duration::from_millis(1));
        assert_eq!((words(&path)[3], words(&path)[7]), (6_000_000, 2));
        drop(page);
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_page_has_one_writer() {
        let path = std::env::temp_dir().join(format!("lager-twoclocks-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let page = ClockPage::open(&path).unwrap();
        assert!(matches!(ClockPage::open(&path), Err(ClockError::Taken(_))));
        drop(page);
        drop(ClockPage::open(&path).unwrap());
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_file_that_is_something_else_is_left_alone() {
        let path = std::env::temp_dir().join(format!("lager-noclock-{}", std::process::id()));
        std::fs::write(&path, [b'x'; BYTES]).unwrap();
        assert!(matches!(
            ClockPage::open(&path),
            Err(ClockError::Foreign(_))
        ));
        assert_eq!(std::fs::read(&path).unwrap(), [b'x'; BYTES]);
        std::fs::remove_file(&path).unwrap();
    }
}
