//! [`Page`]: the stop word's page in memory, for the bridge's main loop and the watching thread.
//!
//! The mapping stays at one address for the page's life. If the file is replaced, the watching
//! thread maps the new file over the old one. The kernel does this in one step, so a reader sees
//! either the old or the new file.
//!
//! If a file is cut short while it is mapped, the next process that reads it ends (SIGBUS). That is
//! safe: the steering board halts by itself, and the next bridge finds a damaged file.

#![allow(unsafe_code, reason = "a mapping is shared memory")]

use core::ffi::c_void;
use core::ptr::NonNull;
use core::sync::atomic::{AtomicU64, Ordering};
use std::fs::File;
use std::io::Error;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use lager_home::Clock;
use lager_topics::{Role, StopCause};
use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use super::{LAYOUT, SIZE, Stop, at, is_whole, open};

/// The mapped page.
#[derive(Debug)]
pub(crate) struct Page {
    path: PathBuf,
    /// The file that was mapped first.
    pub(crate) opened: Identity,
    words: NonNull<[AtomicU64; at::END]>,
}

// SAFETY: the page consists of atomics and stays mapped at its address until the drop.
unsafe impl Send for Page {}
// SAFETY: as above.
unsafe impl Sync for Page {}

impl Page {
    /// Opens the file, or makes it. If it makes the file and `new` is a cause, it stops the robot.
    pub(crate) fn open(path: &Path, new: Option<StopCause>) -> Result<Self, Error> {
        let file = prepared(path, new)?;
        Ok(Self {
            path: path.to_owned(),
            opened: Identity::of(&file)?,
            words: NonNull::new(map(&file, None)?.cast()).ok_or(Errno::NOMEM)?,
        })
    }

    /// Makes sure that the path leads to the mapped file and that the file is whole. Otherwise
    /// mends the file or makes it anew, maps it, and stops the robot. `known` is the file that is
    /// mapped.
    ///
    /// Returns the file that is mapped now.
    pub(crate) fn verify(&self, known: Identity) -> Result<Identity, Error> {
        let file = prepared(&self.path, Some(StopCause::WordRemoved))?;
        let identity = Identity::of(&file)?;
        if identity != known {
            stop_in(&file, StopCause::WordRemoved)?;
            let _ = map(&file, Some(self.words))?;
            self.put(at::PROCESS, u64::from(std::process::id()));
        }
        Ok(identity)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Sets a stop of the bridge's own, unless one is set that only a resume ends. The stop of a
    /// fresh start gives way, because a press of reset ends it.
    pub(crate) fn stop(&self, cause: StopCause) {
        set_unless_set(self.word(), cause);
    }

    pub(crate) fn word(&self) -> &AtomicU64 {
        &self.words()[at::WORD]
    }

    #[inline]
    pub(crate) fn put(&self, place: usize, value: u64) {
        self.words()[place].store(value, Ordering::Release);
    }

    #[inline]
    fn words(&self) -> &[AtomicU64; at::END] {
        // SAFETY: mapped with at least this length and page-aligned until the drop. Every bit
        // pattern is valid, and all writers write whole words.
        unsafe { self.words.as_ref() }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // SAFETY: mapped with this length, and nobody can refer to it any more.
        let _ = unsafe { munmap(self.words.as_ptr().cast(), SIZE as usize) };
    }
}

/// Identifies a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Identity {
    device: u64,
    inode: u64,
}

impl Identity {
    pub(crate) fn of(file: &File) -> Result<Self, Error> {
        let found = file.metadata()?;
        Ok(Self {
            device: found.dev(),
            inode: found.ino(),
        })
    }
}

/// Opens the file, or makes it, and mends it. A file that was not whole is damaged and stops the
/// robot. A file that was missing stops the robot if `new` is a cause.
fn prepared(path: &Path, new: Option<StopCause>) -> Result<File, Error> {
    let (file, made) = open(path)?;
    if made || !is_whole(&file)? {
        // Gets the memory now, so that a full file system is an error here and not a crash later.
        match fallocate(&file, FallocateFlags::empty(), 0, SIZE) {
            Err(Errno::OPNOTSUPP) => file.set_len(SIZE)?,
            done => done?,
        }
        if let Some(cause) = if made {
            new
        } else {
            Some(StopCause::WordDamaged)
        } {
            stop_in(&file, cause)?;
        }
        super::put(&file, at::LAYOUT, LAYOUT)?;
    }
    Ok(file)
}

/// Sets a stop in a file unless one is set, so that no earlier stop is lost.
fn stop_in(file: &File, cause: StopCause) -> Result<(), Error> {
    let place = map(file, None)?;
    // SAFETY: mapped with the length of a page until it is unmapped below, so it is aligned and
    // long enough for one word.
    let word: &AtomicU64 = unsafe { &*place.cast::<AtomicU64>().add(at::WORD) };
    set_unless_set(word, cause);
    // SAFETY: mapped above with this length, and `word` is not used any more.
    Ok(unsafe { munmap(place, SIZE as usize) }?)
}

fn set_unless_set(word: &AtomicU64, cause: StopCause) {
    let stop = Stop::new(Role::Bridge, cause, Clock::monotonic_ns());
    let _ = word.fetch_update(Ordering::AcqRel, Ordering::Acquire, |set| {
        let gives_way = Stop::of_word(set).is_none_or(Stop::is_of_fresh_start);
        gives_way.then_some(stop.word())
    });
}

/// Maps the file, at an address of the kernel's choice or over the mapping at `over`.
fn map(file: &File, over: Option<NonNull<[AtomicU64; at::END]>>) -> Result<*mut c_void, Error> {
    let (place, fixed) = match over {
        Some(words) => (words.as_ptr().cast(), MapFlags::FIXED),
        None => (core::ptr::null_mut(), MapFlags::empty()),
    };
    // SAFETY: either the kernel chooses a free address, or the new mapping replaces one of the same
    // length that this module made, and it is only read and written as atomics.
    let place = unsafe {
        mmap(
            place,
            SIZE as usize,
            ProtFlags::READ | ProtFlags::WRITE,
            MapFlags::SHARED | MapFlags::POPULATE | fixed,
            file,
            0,
        )
    };
    Ok(place?)
}
