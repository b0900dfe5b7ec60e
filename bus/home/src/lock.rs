//! [`Lock`]: which process plays a part of a unit, and which process supervises the unit.
//!
//! There is one lock for each part that only one process may play, and one for the unit's
//! supervisor. A lock is an `flock` on a file in the unit's folder. The kernel releases it when the
//! process ends, however that happens. Only the lock decides. It does not matter whether the file
//! exists, how old it is, or which process id stands in it, which is for messages only. A process
//! that ends in order removes the file while it still holds the lock, so a process that gets a lock
//! checks that the file still has its name.

use core::time::Duration;
use std::fs::{self, File, OpenOptions};
use std::io::Read;
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::Instant;

use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;

use crate::name::UnitName;

/// The endings of the files that a process holds as long as it lives: locks and signs of life.
pub(crate) const ENDS: [&str; 2] = ["lock", LIFE];
pub(crate) const LIFE: &str = "life";

/// How long a process waits for its predecessor to end.
pub(crate) const SUCCESSION: Duration = Duration::from_secs(1);

/// Why a lock could not be taken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LockError {
    /// Another supervisor runs the unit.
    #[error(
        "`{unit}` is already up (process {pid}); give this one another name with --name, or stop that one with Ctrl-C"
    )]
    Up {
        /// The unit.
        unit: String,
        /// Its supervisor's process id.
        pid: String,
    },
    /// Another process plays this part.
    #[error(
        "the {part} of `{unit}` already runs (process {pid}); stop that one, or give this one another name with --name"
    )]
    Service {
        /// The part.
        part: String,
        /// The unit.
        unit: String,
        /// Its process id.
        pid: String,
    },
    /// The file cannot be used.
    #[error("the lock {path} cannot be used ({detail}); check the bus's folder, or start again")]
    File {
        /// The lock's file.
        path: PathBuf,
        /// The system's reason.
        detail: String,
    },
}

/// A lock that this process holds until it is dropped.
#[derive(Debug)]
pub struct Lock {
    file: File,
    path: PathBuf,
}

impl Lock {
    /// Takes the lock at `path` for the part `what` of a unit; waits for it at most `patience`.
    pub(crate) fn take(
        path: &Path,
        unit: &UnitName,
        what: &str,
        patience: Duration,
    ) -> Result<Self, LockError> {
        let failed = |error: std::io::Error| LockError::File {
            path: path.to_owned(),
            detail: error.to_string(),
        };
        let start = Instant::now();
        loop {
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .mode(0o600)
                .open(path)
                .map_err(failed)?;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) if has_name(&file, path) => {
                    let path = path.to_owned();
                    let lock = Self { file, path };
                    lock.write_number().map_err(failed)?;
                    return Ok(lock);
                }
                // The last owner removed the file between opening and locking.
                Ok(()) => continue,
                Err(Errno::WOULDBLOCK) if start.elapsed() >= patience => {
                    let mut pid = String::new();
                    file.read_to_string(&mut pid).map_err(failed)?;
                    return Err(taken(unit, what, pid.trim()));
                }
                Err(Errno::WOULDBLOCK | Errno::INTR) => {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Err(error) => return Err(failed(error.into())),
            }
        }
    }

    /// Whether the lock's file is still the one that others find. If somebody has removed the file,
    /// another process can take the same lock.
    pub fn is_in_place(&self) -> bool {
        has_name(&self.file, &self.path)
    }

    /// Writes this process's id into the file again if somebody has overwritten it, because others
    /// would not find the unit. If that fails, the next call may succeed.
    pub fn renew(&self) {
        let mut there = [0; 16];
        let length = self.file.read_at(&mut there, 0).unwrap_or_default();
        if there[..length] != *std::process::id().to_string().as_bytes() {
            let _ = self.write_number();
        }
    }

    /// Writes a number behind the process id, in one write, so that a reader sees the old or the
    /// new one.
    pub(crate) fn write_beside_number(&self, number: u64) -> std::io::Result<()> {
        let text = format!("{} {number}\n", std::process::id());
        self.file.write_all_at(text.as_bytes(), 0)
    }

    fn write_number(&self) -> std::io::Result<()> {
        self.file.set_len(0)?;
        let number = std::process::id().to_string();
        self.file.write_all_at(number.as_bytes(), 0)
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if self.is_in_place() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Whether a process holds the lock at `path`. Whoever takes the lock at this very moment waits for
/// its turn.
pub(crate) fn is_held(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| {
        let asked = flock(&file, FlockOperation::NonBlockingLockShared);
        asked == Err(Errno::WOULDBLOCK)
    })
}

/// Removes a lock file that a killed process has left.
pub(crate) fn sweep(path: &Path) {
    if let Ok(file) = File::open(path)
        && flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok()
        && has_name(&file, path)
    {
        let _ = fs::remove_file(path);
    }
}

fn has_name(file: &File, path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|there| {
        file.metadata()
            .is_ok_and(|held| (held.dev(), held.ino()) == (there.dev(), there.ino()))
    })
}

fn taken(unit: &UnitName, what: &str, pid: &str) -> LockError {
    let (unit, pid) = (unit.to_string(), pid.to_owned());
    match what {
        "up" => LockError::Up { unit, pid },
        part => LockError::Service {
            part: part.to_owned(),
            unit,
            pid,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(name: &str) -> PathBuf {
        Path::new("/dev/shm").join(format!("lplock{}{name}", std::process::id()))
    }

    #[test]
    fn one_holds_it_and_the_other_is_told_who() {
        let (path, unit) = (scene("a"), UnitName::default());
        // A file that a killed process has left is not a lock.
        fs::write(&path, "4711").unwrap();
        let lock = Lock::take(&path, &unit, "bridge", Duration::ZERO).unwrap();
        let error = Lock::take(&path, &unit, "bridge", Duration::from_millis(20)).unwrap_err();
        let pid = std::process::id();
        assert_eq!(
            error,
            LockError::Service {
                part: "bridge".into(),
                unit: "r1".into(),
                pid: pid.to_string()
            }
        );
        sweep(&path);
        assert!(lock.is_in_place());
        drop(lock);
        assert!(!path.exists());
    }

    #[test]
    fn others_see_whether_it_is_held_and_do_not_hinder_its_next_owner() {
        let (path, unit) = (scene("f"), UnitName::default());
        assert!(!is_held(&path));
        let lock = Lock::take(&path, &unit, "boards", Duration::ZERO).unwrap();
        assert!(is_held(&path));
        drop(lock);
        // A file that a killed process has left is not a lock.
        fs::write(&path, "4711").unwrap();
        assert!(!is_held(&path));
        std::thread::scope(|scope| {
            let looker = scope.spawn(|| {
                for _ in 0..2_000 {
                    is_held(&path);
                }
            });
            while !looker.is_finished() {
                drop(Lock::take(&path, &unit, "boards", SUCCESSION).unwrap());
            }
        });
    }

    #[test]
    fn a_successor_waits_for_a_predecessor_that_is_just_dying() {
        let (path, unit) = (scene("b"), UnitName::default());
        let lock = Lock::take(&path, &unit, "logic", Duration::ZERO).unwrap();
        std::thread::scope(|scope| {
            let successor =
                scope.spawn(|| Lock::take(&path, &unit, "logic", Duration::from_secs(60)));
            std::thread::sleep(Duration::from_millis(20));
            drop(lock);
            assert!(successor.join().unwrap().unwrap().is_in_place());
        });
    }

    #[test]
    fn one_whose_file_was_removed_says_so_and_removes_nobody_elses() {
        let (path, unit) = (scene("c"), UnitName::default());
        let lock = Lock::take(&path, &unit, "up", Duration::ZERO).unwrap();
        fs::remove_file(&path).unwrap();
        assert!(!lock.is_in_place());
        let other = Lock::take(&path, &unit, "up", Duration::ZERO).unwrap();
        drop(lock);
        assert!(other.is_in_place());
    }

    #[test]
    fn a_spoilt_number_is_written_again() {
        let (path, unit) = (scene("e"), UnitName::default());
        let lock = Lock::take(&path, &unit, "up", Duration::ZERO).unwrap();
        for spoilt in ["", "4", "no number at all, and a long one"] {
            fs::write(&path, spoilt).unwrap();
            lock.renew();
            let number = fs::read_to_string(&path).unwrap();
            assert_eq!(number, std::process::id().to_string());
        }
    }

    #[test]
    fn a_killed_ones_file_is_swept() {
        let path = scene("d");
        fs::write(&path, "4711").unwrap();
        sweep(&path);
        assert!(!path.exists());
    }
}
