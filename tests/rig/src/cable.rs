//! A pseudo terminal in place of a board's USB cable, for a test that plays the board.
//!
//! ```text
//!   board, this process --write--> master ==kernel==> device --> whoever opens it as a serial port
//!                       <--read---
//! ```
//!
//! Nothing here knows the meaning of the bytes, and every wait has a limit.

use core::time::Duration;
use std::ffi::OsStr;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::PathBuf;

use lager_home::Clock;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use rustix::time::Timespec;

use crate::Refused;

/// A board's end of its cable.
#[derive(Debug)]
pub struct Cable {
    master: OwnedFd,
    path: PathBuf,
}

impl Cable {
    /// A new pseudo terminal in raw mode, as a serial line is.
    ///
    /// # Errors
    /// The kernel gives none.
    pub fn new() -> Result<Self, Refused> {
        open().map_err(Refused::to_make("a pseudo terminal"))
    }

    /// The device that the other end opens as its serial port.
    #[must_use]
    pub fn path(&self) -> &PathBuf {
        &self.path
    }

    /// Sends `bytes`, all of them.
    ///
    /// # Errors
    /// Nobody reads at the other end, or the kernel refuses for another reason.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Refused> {
        match self.write_some(bytes)? {
            count if count == bytes.len() => Ok(()),
            _ => Err(broken(
                "it took a part of a packet or nothing, so nobody reads at the other end",
            )),
        }
    }

    /// Sends as many of `bytes` as there is room for, and returns their number. It is 0 also when
    /// nobody has opened the other end.
    ///
    /// # Errors
    /// The kernel refuses.
    pub fn write_some(&self, bytes: &[u8]) -> Result<usize, Refused> {
        match rustix::io::write(&self.master, bytes) {
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::IO) => Ok(0),
            Err(errno) => Err(broken(&errno.to_string())),
        }
    }

    /// Reads the bytes that have come; 0 = none.
    ///
    /// # Errors
    /// The kernel refuses.
    pub fn read(&self, buffer: &mut [u8]) -> Result<usize, Refused> {
        match rustix::io::read(&self.master, buffer) {
            Ok(count) => Ok(count),
            // EIO: nobody has the other end open.
            Err(Errno::AGAIN | Errno::INTR | Errno::IO) => Ok(0),
            Err(errno) => Err(broken(&errno.to_string())),
        }
    }

    /// Waits for bytes until `end_ns` of `CLOCK_MONOTONIC` and reads them; 0 = none came in time.
    ///
    /// # Errors
    /// The kernel refuses.
    pub fn read_until(&self, end_ns: u64, buffer: &mut [u8]) -> Result<usize, Refused> {
        loop {
            let left = end_ns.saturating_sub(Clock::monotonic_ns());
            let mut fds = [PollFd::new(&self.master, PollFlags::IN)];
            match poll(&mut fds, Some(&timespec(left))) {
                Ok(0) => return Ok(0),
                Ok(_) => {}
                Err(Errno::INTR) => continue,
                Err(errno) => return Err(broken(&errno.to_string())),
            }
            let count = self.read(buffer)?;
            if count > 0 {
                return Ok(count);
            }
            if fds[0].revents().contains(PollFlags::HUP) {
                // Nobody has the other end open, so `poll` returns at once: wait here.
                std::thread::sleep(Duration::from_millis(1).min(Duration::from_nanos(left)));
                if left == 0 {
                    return Ok(0);
                }
            }
        }
    }
}

fn open() -> Result<Cable, Errno> {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let master = openpt(flags)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    fcntl_setfl(&master, OFlags::NONBLOCK)?;
    let mut termios = tcgetattr(&master)?;
    termios.make_raw();
    tcsetattr(&master, OptionalActions::Now, &termios)?;
    let name = ptsname(&master, Vec::new())?;
    let path = PathBuf::from(OsStr::from_bytes(name.as_bytes()));
    Ok(Cable { master, path })
}

fn broken(detail: &str) -> Refused {
    Refused::to_make("the connection through a pseudo terminal")(detail)
}

impl AsFd for Cable {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }
}

/// A duration in ns as the kernel's type.
#[must_use]
pub fn timespec(ns: u64) -> Timespec {
    Timespec {
        tv_sec: i64::try_from(ns / 1_000_000_000).unwrap_or(i64::MAX),
        // Below 10^9.
        tv_nsec: (ns % 1_000_000_000) as _,
    }
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::{Read, Write};

    use super::*;

    #[test]
    fn bytes_pass_unchanged_both_ways() {
        let cable = Cable::new().unwrap();
        let mut device = File::options()
            .read(true)
            .write(true)
            .open(cable.path())
            .unwrap();
        let all: [u8; 256] = core::array::from_fn(|index| index as u8);
        cable.write(&all).unwrap();
        let mut got = [0; 256];
        device.read_exact(&mut got).unwrap();
        assert_eq!(got, all);

        device.write_all(&all[..11]).unwrap();
        let soon = Clock::monotonic_ns() + 10_000_000_000;
        assert_eq!(cable.read_until(soon, &mut got).unwrap(), 11);
        assert_eq!(got[..11], all[..11]);
    }

    #[test]
    fn waiting_for_nothing_has_an_end_with_and_without_a_peer() {
        let cable = Cable::new().unwrap();
        let mut buffer = [0; 11];
        let soon = Clock::monotonic_ns() + 3_000_000;
        assert_eq!(cable.read_until(soon, &mut buffer).unwrap(), 0);
        let _device = File::open(cable.path()).unwrap();
        let soon = Clock::monotonic_ns() + 3_000_000;
        assert_eq!(cable.read_until(soon, &mut buffer).unwrap(), 0);
    }
}
