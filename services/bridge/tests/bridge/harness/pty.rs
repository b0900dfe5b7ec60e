//! A pseudo terminal whose slave end is found under a fixed path, as a serial port is.

use std::fs::File;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// The master end, and the link to the slave end. Dropped it is unplugged.
pub(crate) struct Pty {
    master: OwnedFd,
    link: PathBuf,
}

impl Pty {
    /// A new pseudo terminal, whose slave end is linked at `link`.
    pub(crate) fn new(link: &Path) -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let master = openpt(flags).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        fcntl_setfl(&master, OFlags::NONBLOCK).unwrap();
        // A serial line has no echo, whether its port is open or not.
        let mut termios = tcgetattr(&master).unwrap();
        termios.make_raw();
        tcsetattr(&master, OptionalActions::Now, &termios).unwrap();
        let slave = ptsname(&master, Vec::new()).unwrap();
        let _ = std::fs::remove_file(link);
        symlink(slave.to_str().unwrap(), link).unwrap();
        Self {
            master,
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
        let mut fds = [PollFd::new(&self.master, PollFlags::IN)];
        let _ = poll(&mut fds, Some(&timeout));
        let hung_up = fds[0].revents().contains(PollFlags::HUP);
        match rustix::io::read(&self.master, buffer) {
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
        match rustix::io::write(&self.master, bytes) {
            Ok(count) => count,
            Err(Errno::AGAIN | Errno::IO) => 0,
            Err(errno) => panic!("writing to the pseudo terminal: {errno}"),
        }
    }
}

impl AsFd for Pty {
    fn as_fd(&self) -> std::os::fd::BorrowedFd<'_> {
        self.master.as_fd()
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.link);
    }
}
