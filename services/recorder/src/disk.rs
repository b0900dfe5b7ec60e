//! A file that grows at its end, with room reserved beyond it.
//!
//! The recorder reserves room with `fallocate`, which takes blocks of the file system and does not
//! make the file longer. So a later write into this room cannot fail because the disk is full. Some
//! file systems cannot reserve room; there the recorder writes without it. `ulimit -f` limits the
//! length of a file but not such a reserve, so the recorder looks at that limit first.
//!
//! Somebody may remove the file, move it, or take its disk away while the recorder writes. The
//! system reports no error for that. So [`Disk::fate`] checks whether the file is still in its
//! place.

use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};

/// How many bytes are reserved at a time, beyond the bytes that are needed.
const AHEAD: u64 = 4 << 20;

/// What happened to a file that is not in its place any more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Somebody removed it.
    Removed,
    /// Somebody moved it, here if the place is known.
    Moved(Option<PathBuf>),
}

impl fmt::Display for Fate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Removed => write!(
                formatter,
                "was removed while it was recorded, and its samples are lost"
            ),
            Self::Moved(Some(to)) => write!(
                formatter,
                "was moved to {} while it was recorded, and ends there",
                to.display()
            ),
            Self::Moved(None) => write!(formatter, "was moved away while it was recorded"),
        }
    }
}

/// A file that is being written.
#[derive(Debug)]
pub(crate) struct Disk {
    file: File,
    path: PathBuf,
    /// Bytes written.
    length: u64,
    /// Bytes of the file, with the reserved room.
    reserved: u64,
}

impl Disk {
    /// A new file.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        Ok(Self {
            file,
            path: path.to_owned(),
            length: 0,
            reserved: 0,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes written.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Makes sure that the file may grow to this length.
    pub(crate) fn reserve(&mut self, length: u64) -> io::Result<()> {
        if length <= self.reserved {
            return Ok(());
        }
        let most = getrlimit(Resource::Fsize).current.unwrap_or(u64::MAX);
        if length > most {
            return Err(Errno::FBIG.into());
        }
        let more = length.saturating_add(AHEAD).min(most);
        let reserved = self.allocate(more).map(|()| more);
        // Use the last few MiB of a disk as well.
        let reserved = reserved.or_else(|_| self.allocate(length).map(|()| length));
        self.reserved = match reserved {
            Ok(reserved) => reserved,
            Err(Errno::OPNOTSUPP | Errno::NOSYS) => u64::MAX,
            Err(error) => return Err(error.into()),
        };
        Ok(())
    }

    fn allocate(&self, length: u64) -> Result<(), Errno> {
        let more = length.saturating_sub(self.length);
        loop {
            match fallocate(&self.file, FallocateFlags::KEEP_SIZE, self.length, more) {
                Err(Errno::INTR) => {}
                done => return done,
            }
        }
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.length += bytes.len() as u64;
        Ok(())
    }

    /// What happened to the file, if it is not in its place any more.
    pub(crate) fn fate(&self) -> Option<Fate> {
        let own = self.file.metadata().ok()?;
        if own.nlink() == 0 {
            return Some(Fate::Removed);
        }
        match fs::metadata(&self.path) {
            Ok(there) if is_same(&own, &there) => None,
            Err(error) if !is_nothing(&error) => None,
            _ => {
                let now = fs::read_link(format!("/proc/self/fd/{}", self.file.as_raw_fd()));
                let now = now
                    .ok()
                    .filter(|now| fs::metadata(now).is_ok_and(|there| is_same(&own, &there)));
                Some(Fate::Moved(now))
            }
        }
    }

    /// Whether `folder` is on the same disk as the file.
    pub(crate) fn is_on_disk_of(&self, folder: &Path) -> bool {
        let folder = match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        };
        let device = |found: io::Result<fs::Metadata>| found.ok().map(|found| found.dev());
        device(fs::metadata(folder)) == device(self.file.metadata())
    }

    /// Waits until the written bytes are on the disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Gives back the room beyond the end, and waits until everything is on the disk.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.file.set_len(self.length)?;
        self.file.sync_all()
    }

    /// Removes a file that has nothing worth keeping.
    pub(crate) fn remove(self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

fn is_same(one: &fs::Metadata, other: &fs::Metadata) -> bool {
    (one.dev(), one.ino()) == (other.dev(), other.ino())
}

/// Whether this name is free.
fn is_nothing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory)
}

/// Whether the disk has no room, for this user or for anybody.
pub(crate) fn is_full(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_taken_away_is_missed() {
        let folder = std::env::temp_dir().join(format!("lager-disk-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("tour.mcap");
        let mut disk = Disk::create(&path).expect("a file");
        disk.write(b"some").expect("room");
        assert_eq!(disk.fate(), None);
        assert!(disk.is_on_disk_of(&folder) && !disk.is_on_disk_of(Path::new("/proc")));

        let elsewhere = folder.join("elsewhere.mcap");
        fs::rename(&path, &elsewhere).expect("our own file");
        assert_eq!(disk.fate(), Some(Fate::Moved(Some(elsewhere.clone()))));
        // Another file of that name is not this one.
        fs::write(&path, "").expect("a file");
        assert_eq!(disk.fate(), Some(Fate::Moved(Some(elsewhere))));
        fs::remove_dir_all(&folder).expect("our own folder");
        assert_eq!(disk.fate(), Some(Fate::Removed));
    }
}
