//! The file behind a bell board: the first process that needs it makes it, the last one removes it.
//!
//! ```text
//!     lock on byte   holder
//!     0  door        exclusively, for the moment of joining, leaving or taking a seat
//!     1  presence    shared, by every process that has the board open
//!     2+n  seat n    exclusively, by the bus whose waiter has the seat
//! ```
//!
//! The kernel releases these locks when a process dies. So a lock that can be taken shows what a
//! killed process has left: a sweep, or a process that needs a seat, clears the killed process's
//! seats and removes a board without presence. The door prevents joining and leaving at the same
//! time. Of two processes that leave at once, the second knows that it is the last, and no process
//! joins a board that is being removed.
//!
//! The file is `bells` in the unit's folder ([`Home`](lager_home::Home)).

use core::ops::Deref;
use core::time::Duration;
use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use lager_sample::Part;
use rustix::fs::{FallocateFlags, fallocate};
use rustix::thread::{MembarrierCommand, membarrier};

use super::board::{Board, Layout, SEATS, SEATS_PER_PART};
use super::crier::Crier;
use super::locks::{Kind, is_held, try_lock, unlock};
use super::mapping::Mapping;
use super::watch;

const DOOR: u64 = 0;
const PRESENCE: u64 = 1;
const FIRST_SEAT: u64 = 2;

/// Longer than any running process holds the door, which is microseconds. A stopped process may
/// hold it longer.
const PATIENCE: Duration = Duration::from_secs(2);

/// Why a board cannot be used.
#[derive(Debug)]
pub enum BoardFault {
    /// Running processes of another build have a board of another layout.
    OtherLayout,
    /// The door stays locked.
    Busy,
    /// The part has no free seat left.
    NoSeat,
    /// The board's file cannot be used.
    File(Error),
}

impl From<Error> for BoardFault {
    fn from(error: Error) -> Self {
        Self::File(error)
    }
}

/// An open board. Dropping the last one removes the file.
pub(crate) struct Segment {
    file: File,
    path: PathBuf,
    board: Mapping,
    /// The seats whose locks this process holds, as bits. The kernel would grant these locks again,
    /// because the same open file already has them.
    own: Mutex<u64>,
    /// Wakes watchers for the writers of this process, once one is needed. `None`: it could not start.
    crier: OnceLock<Option<Crier>>,
}

impl Deref for Segment {
    type Target = Board;

    #[inline]
    fn deref(&self) -> &Board {
        &self.board
    }
}

impl Segment {
    /// Opens the board, or makes it.
    pub(crate) fn join(path: &Path) -> Result<Self, BoardFault> {
        loop {
            if let Some(segment) = Self::attempt(path, true)? {
                return Ok(segment);
            }
        }
    }

    /// Opens the board if there is one.
    pub(crate) fn existing(path: &Path) -> Result<Option<Self>, BoardFault> {
        match Self::attempt(path, false) {
            Err(BoardFault::File(error)) if error.kind() == ErrorKind::NotFound => Ok(None),
            other => other,
        }
    }

    /// `None` if another process removed the board meanwhile.
    fn attempt(path: &Path, create: bool) -> Result<Option<Self>, BoardFault> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(create)
            .mode(0o600)
            .open(path)?;
        let door = Door::lock(&file)?;
        let state = file.metadata()?;
        if state.nlink() == 0 {
            return Ok(None);
        }
        let size = size_of::<Board>() as u64;
        if state.len() == 0 {
            // Gets the memory now, so that a full /dev/shm is an error here and not a crash later.
            if let Err(error) = fallocate(&file, FallocateFlags::empty(), 0, size) {
                // No process uses a file without contents.
                let _ = std::fs::remove_file(path);
                return Err(BoardFault::File(error.into()));
            }
        } else if state.len() != size {
            return Self::replace_foreign(&file, path);
        }
        let board = Mapping::of(&file)?;
        match board.layout() {
            // The process that makes the board signs it before it opens the door.
            Layout::Blank => board.sign(),
            Layout::Ours => (),
            Layout::Other => return Self::replace_foreign(&file, path),
        }
        if !try_lock(&file, PRESENCE, Kind::Shared)? {
            // Only a leaving process takes this lock exclusively, and it holds the door meanwhile.
            return Err(BoardFault::Busy);
        }
        drop(door);
        // So that `take_seat` can make this process's ringers see a new seat at once.
        let _ = membarrier(MembarrierCommand::RegisterGlobalExpedited);
        Ok(Some(Self {
            file,
            path: path.to_owned(),
            board,
            own: Mutex::new(0),
            crier: OnceLock::new(),
        }))
    }

    /// Replaces the board of another build if nobody uses it any more.
    fn replace_foreign(file: &File, path: &Path) -> Result<Option<Self>, BoardFault> {
        if !try_lock(file, PRESENCE, Kind::Exclusive)? {
            return Err(BoardFault::OtherLayout);
        }
        let removed = std::fs::remove_file(path);
        unlock(file, PRESENCE);
        removed?;
        Ok(None)
    }

    /// Takes a seat for a waiter of `part`.
    pub(crate) fn take_seat(&self, part: Part) -> Result<usize, BoardFault> {
        // The door makes counting and taking one step.
        let _door = Door::lock(&self.file)?;
        let mut own = self.own();
        self.sweep_but(*own)?;
        self.sit(&mut own, part)
    }

    fn sit(&self, own: &mut u64, part: Part) -> Result<usize, BoardFault> {
        if self.seats_of(part).count_ones() as usize >= SEATS_PER_PART {
            return Err(BoardFault::NoSeat);
        }
        for seat in 0..SEATS {
            if *own & (1 << seat) == 0 && try_lock(&self.file, byte(seat), Kind::Exclusive)? {
                *own |= 1 << seat;
                // Its owner may have been killed since the sweep.
                self.clear(seat);
                self.take(seat, part, std::process::id());
                // A ringer that has just found no seat to ring has already sent its sample. After
                // this call, a waiter that looks sees that sample. On older kernels the sample
                // waits for the time-out.
                let _ = membarrier(MembarrierCommand::GlobalExpedited);
                return Ok(seat);
            }
        }
        Err(BoardFault::NoSeat)
    }

    /// Gives a seat of this segment back.
    pub(crate) fn leave_seat(&self, seat: usize) {
        let mut own = self.own();
        self.clear(seat);
        *own &= !(1 << seat);
        unlock(&self.file, byte(seat));
    }

    /// Clears the seats of killed processes.
    pub(crate) fn sweep(&self) -> Result<(), BoardFault> {
        self.sweep_but(*self.own())
    }

    fn sweep_but(&self, own: u64) -> Result<(), BoardFault> {
        let taken = self.taken() & !own;
        for seat in (0..SEATS).filter(|seat| taken & (1 << seat) != 0) {
            if try_lock(&self.file, byte(seat), Kind::Exclusive)? {
                self.clear(seat);
                unlock(&self.file, byte(seat));
            }
        }
        Ok(())
    }

    /// The living processes with a waiter for `part`.
    pub(crate) fn woken(&self, part: Part) -> Vec<u32> {
        let own = *self.own();
        let seats = self.seats_of(part);
        (0..SEATS)
            .filter(|seat| seats & (1 << seat) != 0)
            .filter(|seat| {
                own & (1 << seat) != 0 || is_held(&self.file, byte(*seat)).unwrap_or(false)
            })
            .map(|seat| self.pid(seat))
            .collect()
    }

    /// Lets the crier wake all who sleep on a word for watchers, if anybody does.
    #[inline]
    pub(crate) fn ring_watchers(&self, word: usize) {
        if watch::is_awaited(self.watched(word)) {
            self.call_crier(word);
        }
    }

    #[cold]
    #[inline(never)]
    fn call_crier(&self, word: usize) {
        let start = || match Crier::start(self.board.clone()) {
            Ok(crier) => Some(crier),
            Err(error) => {
                tracing::warn!("watchers are not woken and only look now and then: {error}");
                None
            }
        };
        if let Some(crier) = self.crier.get_or_init(start) {
            crier.ring(word);
        }
    }

    fn own(&self) -> MutexGuard<'_, u64> {
        // The mutex guards one number, which is valid at every moment.
        self.own.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Segment {
    fn drop(&mut self) {
        // If the door cannot be locked, or this process is killed here, the next sweep removes the
        // file.
        if let Ok(door) = Door::lock(&self.file) {
            if try_lock(&self.file, PRESENCE, Kind::Exclusive).unwrap_or(false)
                && self.file.metadata().is_ok_and(|file| file.nlink() > 0)
            {
                let _ = std::fs::remove_file(&self.path);
            }
            unlock(&self.file, PRESENCE);
            drop(door);
        }
        unlock(&self.file, PRESENCE);
    }
}

fn byte(seat: usize) -> u64 {
    FIRST_SEAT + seat as u64
}

/// The lock that makes joining, leaving and taking a seat one step each.
struct Door<'file> {
    file: &'file File,
}

impl<'file> Door<'file> {
    fn lock(file: &'file File) -> Result<Self, BoardFault> {
        let start = Instant::now();
        while !try_lock(file, DOOR, Kind::Exclusive)? {
            if start.elapsed() > PATIENCE {
                return Err(BoardFault::Busy);
            }
            std::thread::sleep(Duration::from_micros(100));
        }
        Ok(Self { file })
    }
}

impl Drop for Door<'_> {
    fn drop(&mut self) {
        unlock(self.file, DOOR);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOGIC: Part = Part::new(1, "logic");
    const BRIDGE: Part = Part::new(0, "bridge");

    #[test]
    fn who_takes_the_seat_of_a_waiter_killed_since_the_sweep_is_not_rung_for_it() {
        let path = PathBuf::from(format!("/dev/shm/lpseat{}", std::process::id()));
        let segment = Segment::join(&path).unwrap();
        // A waiter leaves this if it held its seat's lock during the sweep and died after it.
        segment.take(0, BRIDGE, 4711);
        assert!(segment.may_spin(0, 1));
        let mut own = 0;
        let door = Door::lock(&segment.file).unwrap();
        assert_eq!(segment.sit(&mut own, LOGIC).unwrap(), 0);
        drop(door);
        assert_eq!(segment.seats_of(BRIDGE), 0);
        assert_eq!(segment.seats_of(LOGIC), 1);
        assert!(segment.may_spin(1, 1), "the right to spin has come free");
        drop(segment);
        assert!(!path.exists());
    }

    #[test]
    fn a_crier_is_started_by_the_first_watcher_that_sleeps() {
        let path = PathBuf::from(format!("/dev/shm/lpcrier{}", std::process::id()));
        let segment = Segment::join(&path).unwrap();
        segment.ring_watchers(5);
        assert!(segment.crier.get().is_none(), "nobody sleeps");
        let announced = watch::announce(segment.watched(5));
        segment.ring_watchers(6);
        assert!(segment.crier.get().is_none(), "nobody sleeps there");
        segment.ring_watchers(5);
        assert!(segment.crier.get().is_some());
        // Whether the cry was before this or comes now: it ends the sleep.
        let minute = Duration::from_secs(60);
        let ended = watch::sleep(segment.watched(5), announced, minute);
        assert_eq!(ended, super::super::word::Ended::Awake);
        drop(segment);
        assert!(!path.exists());
    }
}
