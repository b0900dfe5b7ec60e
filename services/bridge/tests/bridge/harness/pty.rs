//! A pseudo terminal whose slave end is found under a fixed path, as a serial port is.

use std::fs::File;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use lager_rig::Cable;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

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
        let timeout = Timespec {
            tv_sec: 0,
            tv_nsec: 1_000_000,
        };
        let mut fds = [PollFd::new(&self.cable, PollFlags::IN)];
        let _ = poll(&mut fds, Some(&timeout));
        let hung_up = fds[0].revents().contains(PollFlags::HUP);
        match rustix::io::read(&self.cable, buffer) {
            Ok(count) => count,
            Err(_) => {
                if hung_up {
                    // Nobody has the slave open: `poll` does not wait then.
                    std::thread::sleep(std::time::Duration::from_millis(1));
                }
                0
            }
        }
    }

    /// Writes as much as fits; how much that was.
    pub(crate) fn write(&self, bytes: &[u8]) -> usize {
        match rustix::io::write(&self.cable, bytes) {
            Ok(count) => count,
            Err(Errno::AGAIN | Errno::IO) => 0,
            Err(errno) => panic!("writing to the pseudo terminal: {errno}"),
        }
    }
}

impl AsFd for Pty {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.cable.as_fd()
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.link);
    }
}
