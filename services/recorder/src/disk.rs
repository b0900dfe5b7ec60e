//! A file that grows at its end, with room reserved beyond it.
//!
//! Room is reserved with `fallocate`, which takes blocks of the file system without making the file
//! longer; so what is written into it later cannot fail for want of room. A file system that cannot
//! do that is written to without a reserve.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;

/// What is reserved at a time beyond what is needed, in bytes.
const AHEAD: u64 = 4 << 20;

/// A file that is being written.
#[derive(Debug)]
pub(crate) struct Disk {
    file: File,
    path: PathBuf,
    /// Bytes written.
    length: u64,
    /// Bytes of the file for which there is room.
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

    /// Makes sure that the file may become so long.
    pub(crate) fn reserve(&mut self, length: u64) -> io::Result<()> {
        if length <= self.reserved {
            return Ok(());
        }
        let more = length.saturating_add(AHEAD);
        let reserved = self.allocate(more).map(|()| more);
        // The last few MiB of a disk are used as well.
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

    /// Waits until what was written is on the disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Gives the room beyond the end back, and waits until all is on the disk.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.file.set_len(self.length)?;
        self.file.sync_all()
    }

    /// Removes a file of which nothing is worth keeping.
    pub(crate) fn remove(self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Whether there is no room, for this user or at all.
pub(crate) fn is_full(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge
    )
}
