//! A pseudo terminal whose slave end is found under a fixed path, as a serial port is.

use std::fs::File;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use lager_ports::Clock;
use lager_rig::Cable;

/// How long a read waits for bytes, in ns.
const LOOK_NS: u64 = 1_000_000;

/// The master end, and the link to the slave end. Dropped it is unplugged.
pub(crate) struct Pty {
    cable: Cable,
    link: PathBuf,
}

impl Pty {
    /// A new pseudo terminal, whose slave end is linked at `link`.
    pub(crate) fn new(link: &Path) -> Self {
        let cable = Cable::new().unwrap();
        let _ = std::fs::remove_file(link);
        symlink(cable.path(), link).unwrap();
        Self {
            cable,
            link: link.to_owned(),
        }
    }

    /// Opens the slave end as any program would.
    pub(crate) fn slave(&self) -> File {
        File::options()
            .read(true)
            .write(true)
            .open(&self.link)
            .unwrap()
    }

    /// Waits at most a millisecond for bytes and reads what is there.
    pub(crate) fn read(&self, buffer: &mut [u8]) -> usize {
        let end_ns = Clock::monotonic_ns() + LOOK_NS;
        self.cable.read_until(end_ns, buffer).unwrap()
    }

    /// Writes as much as fits; how much that was.
    pub(crate) fn write(&self, bytes: &[u8]) -> usize {
        self.cable.write_some(bytes).unwrap()
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.link);
    }
}
