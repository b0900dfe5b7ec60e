//! A pty with a fixed name, in place of a board's USB cable, and a file in place of its EEPROM.
//!
//! ```text
//!   bridge --open--> /run/.../sensor --link--> /dev/pts/7 <==kernel==> master, held here
//! ```
//! As with a USB adapter, the port carries nothing while nobody has it open, and bytes that its
//! reader does not fetch are lost; a write never waits. The link is replaced in one step, so the
//! port is never missing, and `drop` removes it if it is still ours.

mod eeprom;

pub use eeprom::{EepromError, EepromFile};

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};
use thiserror::Error;

/// How many bytes from a board wait, at most, until the Pi reads them; further ones are lost.
pub const PI_BUFFER: usize = 4_096;

/// Why a port could not be made.
#[derive(Debug, Error)]
pub enum PtyError {
    /// The system cannot give a pty.
    #[error("the system gives no pty ({0}); is /dev/pts mounted, and is its limit reached?")]
    Open(#[source] io::Error),
    /// Something else is at the link's path.
    #[error("{0} exists and is not a link; choose another path for the port")]
    Taken(PathBuf),
    /// The link cannot be made.
    #[error("cannot link the port at {path}: {source}; does its folder exist?")]
    Link {
        /// The link's path.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

/// The board's end of a port.
#[derive(Debug)]
pub struct Port {
    master: OwnedFd,
    device: PathBuf,
    link: PathBuf,
    open: bool,
}

impl Port {
    /// Makes a port and a link to it at `link`. An existing link is replaced.
    ///
    /// # Errors
    /// The system gives no pty, or `link` cannot be made.
    pub fn create(link: &Path) -> Result<Self, PtyError> {
        let (master, device) = open_master().map_err(|errno| PtyError::Open(errno.into()))?;
        let port = Self {
            master,
            device,
            link: link.to_owned(),
            open: false,
        };
        port.place_link()?;
        Ok(port)
    }

    /// Whether somebody had the port open at the last [`Port::look`].
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// The descriptor to wait on while the port is open.
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }

    /// Checks whether somebody has the port open.
    pub fn look(&mut self) {
        let mut fds = [PollFd::new(&self.master, PollFlags::IN)];
        let no_time = Timespec {
            tv_sec: 0,
            tv_nsec: 0,
        };
        if poll(&mut fds, Some(&no_time)).is_err() {
            return;
        }
        let open = !fds[0].revents().contains(PollFlags::HUP);
        if self.open && !open {
            // The next reader must not get what the last one left.
            if let Ok(device) = ioctl_tiocgptpeer(&self.master, device_flags()) {
                let _ = tcflush(&device, QueueSelector::IFlush);
            }
        }
        self.open = open;
    }

    /// Appends the bytes that were written to the port.
    pub fn read(&self, into: &mut Vec<u8>) {
        let mut chunk = [0; 256];
        // An empty closed port reads as an error.
        while let Ok(count @ 1..) = rustix::io::read(&self.master, &mut chunk) {
            into.extend_from_slice(&chunk[..count]);
        }
    }

    /// Sends bytes to the reader; returns how many were lost.
    pub fn write(&self, bytes: &[u8]) -> usize {
        if !self.open {
            return bytes.len();
        }
        let mut rest = bytes;
        while !rest.is_empty() {
            match rustix::io::write(&self.master, rest) {
                Ok(count) => rest = &rest[count..],
                Err(Errno::INTR) => {}
                Err(_) => break,
            }
        }
        rest.len()
    }

    fn place_link(&self) -> Result<(), PtyError> {
        let taken = |link: &Path| fs::symlink_metadata(link).is_ok_and(|found| !found.is_symlink());
        if taken(&self.link) {
            return Err(PtyError::Taken(self.link.clone()));
        }
        let failed = |source| PtyError::Link {
            path: self.link.clone(),
            source,
        };
        let mut fresh = self.link.as_os_str().to_owned();
        fresh.push(format!(".{}", std::process::id()));
        let _ = fs::remove_file(&fresh);
        std::os::unix::fs::symlink(&self.device, &fresh).map_err(failed)?;
        fs::rename(&fresh, &self.link).map_err(failed)
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        if fs::read_link(&self.link).is_ok_and(|target| target == self.device) {
            let _ = fs::remove_file(&self.link);
        }
    }
}

/// Opening must not make the device this process's terminal.
fn device_flags() -> OpenptFlags {
    OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC
}

/// A pty's master, which does not block, and the path of its device, which is raw: 8 bits, no echo,
/// no line discipline.
fn open_master() -> Result<(OwnedFd, PathBuf), Errno> {
    let master = openpt(device_flags())?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let name = ptsname(&master, Vec::new())?;
    let device = ioctl_tiocgptpeer(&master, device_flags())?;
    let mut settings = tcgetattr(&device)?;
    settings.make_raw();
    tcsetattr(&device, OptionalActions::Now, &settings)?;
    fcntl_setfl(&master, OFlags::NONBLOCK)?;
    Ok((master, PathBuf::from(OsStr::from_bytes(name.as_bytes()))))
}

#[cfg(test)]
mod tests {
    use std::fs::{File, OpenOptions};
    use std::io::{Read, Write};

    use rustix::termios::LocalModes;

    use super::*;

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path =
                std::env::temp_dir().join(format!("lager-pty-{}-{name}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn port(&self) -> (Port, PathBuf) {
            let link = self.0.join("port");
            (Port::create(&link).unwrap(), link)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn open(link: &Path) -> File {
        OpenOptions::new()
            .read(true)
            .write(true)
            .open(link)
            .unwrap()
    }

    fn read_all(port: &Port, wanted: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        // The kernel passes bytes on in a worker thread.
        while bytes.len() < wanted {
            port.read(&mut bytes);
            std::thread::yield_now();
        }
        bytes
    }

    #[test]
    fn bytes_pass_unchanged_in_both_directions() {
        let folder = Folder::new("bytes");
        let (mut port, link) = folder.port();
        let mut cable = open(&link);
        port.look();
        assert!(port.is_open());
        let all: Vec<u8> = (0..=255).collect();
        assert_eq!(port.write(&all), 0);
        let mut got = vec![0; 256];
        cable.read_exact(&mut got).unwrap();
        assert_eq!(got, all);
        cable.write_all(&all).unwrap();
        assert_eq!(read_all(&port, 256), all);
    }

    #[test]
    fn a_port_nobody_has_open_carries_nothing() {
        let folder = Folder::new("closed");
        let (mut port, link) = folder.port();
        port.look();
        assert!(!port.is_open());
        assert_eq!(port.write(b"nobody"), 6);

        let cable = open(&link);
        port.look();
        assert_eq!(port.write(b"unread"), 0);
        drop(cable);
        port.look();
        assert!(!port.is_open());

        let mut cable = open(&link);
        port.look();
        assert_eq!(port.write(b"fresh"), 0);
        let mut got = [0; 5];
        cable.read_exact(&mut got).unwrap();
        assert_eq!(&got, b"fresh");
    }

    #[test]
    fn the_port_stays_raw_when_it_is_opened_again() {
        let folder = Folder::new("raw");
        let (_port, link) = folder.port();
        for _ in 0..2 {
            let settings = tcgetattr(open(&link)).unwrap();
            assert!(
                !settings
                    .local_modes
                    .intersects(LocalModes::ECHO | LocalModes::ICANON)
            );
        }
    }

    #[test]
    fn a_reader_that_sleeps_loses_bytes_and_holds_up_nobody() {
        let folder = Folder::new("full");
        let (mut port, link) = folder.port();
        let _cable = open(&link);
        port.look();
        let mut lost = 0;
        for _ in 0..1_000 {
            lost += port.write(&[0x55; 1_024]);
        }
        assert!(lost > 500_000, "{lost}");
    }

    #[test]
    fn the_link_is_replaced_and_only_ones_own_is_removed() {
        let folder = Folder::new("link");
        let (first, link) = folder.port();
        let second = Port::create(&link).unwrap();
        assert_eq!(fs::read_link(&link).unwrap(), second.device);
        drop(first);
        assert_eq!(fs::read_link(&link).unwrap(), second.device);
        drop(second);
        assert!(fs::symlink_metadata(&link).is_err());

        File::create(&link).unwrap();
        let refused = Port::create(&link).unwrap_err();
        assert!(refused.to_string().contains("is not a link"), "{refused}");
        let nowhere = Port::create(&folder.0.join("no/such/folder")).unwrap_err();
        assert!(
            nowhere.to_string().contains("does its folder exist"),
            "{nowhere}"
        );
    }
}
