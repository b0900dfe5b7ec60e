//! A pseudo terminal whose slave end has a fixed path, like a serial port.

use std::fs::File;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use crate::Cable;
use lager_home::Clock;

/// How long a read waits for bytes, in ns.
const LOOK_NS: u64 = 1_000_000;

/// The master end, and the link to the slave end. Dropping it pulls the cable.
pub struct Pty {
    cable: Cable,
    link: PathBuf,
}

impl Pty {
    /// A new pseudo terminal, whose slave end is linked at `link`.
    ///
    /// # Panics
    /// When the kernel refuses.
    pub fn new(link: &Path) -> Self {
        let cable = Cable::new().unwrap();
        let _ = std::fs::remove_file(link);
        symlink(cable.path(), link).unwrap();
        Self {
            cable,
            link: link.to_owned(),
        }
    }

    /// Opens the slave end as any other program would.
    ///
    /// # Panics
    /// When the kernel refuses.
    pub fn slave(&self) -> File {
        File::options()
            .read(true)
            .write(true)
            .open(&self.link)
            .unwrap()
    }

    /// Waits at most 1 ms for bytes, and reads those that have come.
    ///
    /// # Panics
    /// When the kernel refuses.
    pub fn read(&self, buffer: &mut [u8]) -> usize {
        let end_ns = Clock::monotonic_ns() + LOOK_NS;
        self.cable.read_until(end_ns, buffer).unwrap()
    }

    /// Writes as many bytes as fit, and returns their number.
    ///
    /// # Panics
    /// When the kernel refuses.
    pub fn write(&self, bytes: &[u8]) -> usize {
        self.cable.write_some(bytes).unwrap()
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.link);
    }
}
