//! One serial port as the boards need it: raw, 8 data bits, no parity, 1 stop bit, exclusive.
//!
//! It stands apart so that one place turns every error of the operating system about a port into a
//! sentence. It blocks only in [`SerialPort::read`], allocates nothing after opening, and knows
//! nothing of packets.
//!
//! A pseudo terminal works like a real port: modem lines are ignored, and the driver's low-latency
//! mode helps but is not necessary. It needs no speed, so one that cannot be set hinders nothing.

pub mod find;
pub mod holders;
mod low_latency;

use std::fmt;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::time::Duration;

use lager_wire::PACKET_LENGTH;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{FlockOperation, Mode, OFlags, fcntl_setfl, flock, fstat, major, open};
use rustix::io::Errno;
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, QueueSelector, SpecialCodeIndex, Termios,
    ioctl_tiocexcl, tcflush, tcgetattr, tcsetattr,
};

/// Why a port cannot be opened, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OpenPortError {
    /// There is no such device.
    #[error(
        "there is no serial port {}: plug in the board's USB cable, or name the right port (`ls /dev/serial/by-id` lists those there are)",
        path.display()
    )]
    Missing {
        /// The port asked for.
        path: PathBuf,
    },
    /// The user may not open it.
    #[error(
        "this user may not open the serial port {}: `sudo usermod -aG dialout $USER`, then log in again",
        path.display()
    )]
    NoPermission {
        /// The port asked for.
        path: PathBuf,
    },
    /// Another process has it.
    #[error(
        "the serial port {} is in use by another process: stop that one (`fuser -v {}` names it)",
        path.display(),
        path.display()
    )]
    Busy {
        /// The port asked for.
        path: PathBuf,
    },
    /// It is not a terminal device.
    #[error(
        "{} is not a serial port: name a device such as /dev/ttyUSB0 (`ls /dev/serial/by-id` lists those there are)",
        path.display()
    )]
    NotATerminal {
        /// The path asked for.
        path: PathBuf,
    },
    /// The driver cannot do this speed.
    #[error(
        "the serial port {} does not do {baud} Bd: set the boards and the bridge to a speed its adapter knows",
        path.display()
    )]
    Baud {
        /// The port asked for.
        path: PathBuf,
        /// The speed asked for, in baud.
        baud: u32,
    },
    /// Another error of the operating system.
    #[error("the serial port {} cannot be opened: {errno}", path.display())]
    System {
        /// The port asked for.
        path: PathBuf,
        /// The operating system's words.
        errno: Errno,
    },
}

/// Why an open port does not work any more: its device has gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the device has gone ({errno})")]
pub struct PortGone {
    /// What the operating system said.
    pub errno: Errno,
}

/// What happened to a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sent {
    /// The driver has taken all of it.
    Whole,
    /// The driver has taken the beginning; the rest goes before the next packet.
    Partly,
    /// The driver's buffer is full: nothing was taken.
    NotNow,
}

/// An open port. Reading and writing work through a shared reference, so one thread may read
/// while another writes (through its own [`PacketWriter`]).
///
/// It is opened twice. A read may sleep, so that waiting and reading are one system call. A write
/// must not sleep.
pub struct SerialPort {
    path: PathBuf,
    reading: OwnedFd,
    writing: OwnedFd,
    low_latency: bool,
    /// What was set before.
    former: Termios,
}

/// How long the driver lets a read sleep, in tenths of a second.
const READ_TENTHS: u8 = 1;
const READ: Duration = Duration::from_millis(100 * READ_TENTHS as u64);

impl fmt::Debug for SerialPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SerialPort")
            .field("path", &self.path)
            .field("low_latency", &self.low_latency)
            .finish_non_exhaustive()
    }
}

/// Major device numbers of the slave ends of pseudo terminals.
const PTY_SLAVES: std::ops::RangeInclusive<u32> = 136..=143;

impl SerialPort {
    /// Opens `path` at `baud` and throws away the bytes in its buffers.
    pub fn open(path: &Path, baud: u32) -> Result<Self, OpenPortError> {
        let fail = |errno| OpenPortError::from_errno(path, errno);
        // Non-blocking also keeps `open` from waiting for a carrier.
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let writing = open(path, flags, Mode::empty()).map_err(fail)?;
        let mut termios = tcgetattr(&writing).map_err(fail)?;
        lock(&writing).map_err(fail)?;
        let former = termios.clone();

        termios.make_raw();
        termios.input_modes &= !(InputModes::IXOFF | InputModes::IXANY | InputModes::INPCK);
        termios.control_modes &= !(ControlModes::CSIZE
            | ControlModes::PARENB
            | ControlModes::CSTOPB
            | ControlModes::CRTSCTS
            | ControlModes::HUPCL);
        termios.control_modes |= ControlModes::CS8 | ControlModes::CREAD | ControlModes::CLOCAL;
        termios.special_codes[SpecialCodeIndex::VMIN] = 0;
        termios.special_codes[SpecialCodeIndex::VTIME] = READ_TENTHS;
        let no_such_speed = |_| OpenPortError::Baud {
            path: path.to_owned(),
            baud,
        };
        if baud == 0 {
            // For a driver, 0 baud means to hang up.
            return Err(no_such_speed(Errno::INVAL));
        }
        termios.set_speed(baud).map_err(no_such_speed)?;
        tcsetattr(&writing, OptionalActions::Now, &termios).map_err(fail)?;
        // The driver says which speed it has really set.
        let set = tcgetattr(&writing).map_err(fail)?.output_speed();
        if !will_do(set, baud, is_pty(&writing).map_err(fail)?) {
            return Err(no_such_speed(Errno::INVAL));
        }
        let low_latency = low_latency::request(&writing);
        // Open the same device again, whatever `path` leads to by now.
        let again = format!("/proc/self/fd/{}", writing.as_raw_fd());
        let reading = open(again, flags, Mode::empty()).map_err(fail)?;
        fcntl_setfl(&reading, OFlags::empty()).map_err(fail)?;
        shut_out_others(&writing).map_err(fail)?;
        tcflush(&writing, QueueSelector::IOFlush).map_err(fail)?;
        Ok(Self {
            path: path.to_owned(),
            reading,
            writing,
            low_latency,
            former,
        })
    }

    /// The path by which it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Closes a port that is no board's, and sets it as it was.
    pub fn put_back(self) {
        // A device that has gone needs nothing.
        let _ = tcsetattr(&self.writing, OptionalActions::Now, &self.former);
    }

    /// Whether the driver passes on bytes at once. (Some USB adapters collect them for 16 ms.)
    pub fn is_low_latency(&self) -> bool {
        self.low_latency
    }

    /// Reads up to the buffer's length. Waits at most about `timeout` of real time; 0 bytes mean
    /// that nothing came.
    ///
    /// If the driver can keep the time-out itself, it costs no further system call, and is exact to
    /// a tenth of a second.
    pub fn read(&self, buffer: &mut [u8], timeout: Duration) -> Result<usize, PortGone> {
        if timeout < READ && self.poll(timeout)?.is_empty() {
            return Ok(0);
        }
        match rustix::io::read(&self.reading, buffer) {
            // Nothing in time, or the end of the stream.
            Ok(0) if self.poll(Duration::ZERO)?.contains(PollFlags::HUP) => {
                Err(PortGone { errno: Errno::PIPE })
            }
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(errno) => Err(PortGone { errno }),
        }
    }

    /// Whether a read within `timeout` would return something: bytes, or an end.
    fn poll(&self, timeout: Duration) -> Result<PollFlags, PortGone> {
        let timeout = Timespec {
            tv_sec: i64::try_from(timeout.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: timeout.subsec_nanos().into(),
        };
        let mut fds = [PollFd::new(&self.reading, PollFlags::IN)];
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) => Ok(fds[0].revents()),
            Err(Errno::INTR) => Ok(PollFlags::empty()),
            Err(errno) => Err(PortGone { errno }),
        }
    }

    /// Throws away bytes that were written and have not left the machine yet.
    pub fn discard_output(&self) {
        // The reader finds out if a port does not work any more.
        let _ = tcflush(&self.writing, QueueSelector::OFlush);
    }
}

impl AsFd for SerialPort {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.writing.as_fd()
    }
}

/// Locks the port for this process, against programs that ask for the lock. The lock belongs to the
/// open file and ends with the process.
fn lock(fd: &OwnedFd) -> Result<(), Errno> {
    flock(fd, FlockOperation::NonBlockingLockExclusive)
}

/// Keeps out programs that ask for no lock (TIOCEXCL). Not on a pseudo terminal: there it would
/// outlive a killed process while the other end is open, and shut out the next bridge.
fn shut_out_others(fd: &OwnedFd) -> Result<(), Errno> {
    if !is_pty(fd)? {
        ioctl_tiocexcl(fd)?;
    }
    Ok(())
}

/// Whether a port does for `baud` whose driver has set the speed `set`. An adapter has to come near; a
/// pseudo terminal carries bytes at any speed, and an emulator of programs cannot set one.
const fn will_do(set: u32, baud: u32, is_pty: bool) -> bool {
    is_pty || set.abs_diff(baud) <= baud / 50
}

/// Whether it is the slave end of a pseudo terminal.
fn is_pty(fd: &OwnedFd) -> Result<bool, Errno> {
    Ok(PTY_SLAVES.contains(&major(fstat(fd)?.st_rdev)))
}

impl OpenPortError {
    fn from_errno(path: &Path, errno: Errno) -> Self {
        let path = path.to_owned();
        match errno {
            Errno::NOENT | Errno::NXIO | Errno::NODEV | Errno::NOTDIR => Self::Missing { path },
            Errno::ACCESS | Errno::PERM => Self::NoPermission { path },
            Errno::BUSY | Errno::AGAIN => Self::Busy { path },
            Errno::NOTTY | Errno::ISDIR | Errno::INVAL => Self::NotATerminal { path },
            errno => Self::System { path, errno },
        }
    }
}

/// Writes packets to a port, each with one system call. If the driver takes only a part, the rest
/// goes first next time, so packets stay whole.
#[derive(Debug, Default)]
pub struct PacketWriter {
    rest: [u8; PACKET_LENGTH],
    /// How many bytes of `rest` must still be sent: its last ones.
    rest_length: usize,
}

impl PacketWriter {
    /// Sends a packet, after the rest of the one before.
    pub fn write(
        &mut self,
        port: &SerialPort,
        packet: &[u8; PACKET_LENGTH],
    ) -> Result<Sent, PortGone> {
        if self.rest_length > 0 {
            let rest = &self.rest[PACKET_LENGTH - self.rest_length..];
            self.rest_length -= put(port, rest)?;
            if self.rest_length > 0 {
                return Ok(Sent::NotNow);
            }
        }
        match put(port, packet)? {
            0 => Ok(Sent::NotNow),
            PACKET_LENGTH => Ok(Sent::Whole),
            count => {
                self.rest = *packet;
                self.rest_length = PACKET_LENGTH - count;
                Ok(Sent::Partly)
            }
        }
    }
}

fn put(port: &SerialPort, bytes: &[u8]) -> Result<usize, PortGone> {
    match rustix::io::write(port, bytes) {
        Ok(count) => Ok(count),
        Err(Errno::AGAIN | Errno::INTR) => Ok(0),
        Err(errno) => Err(PortGone { errno }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_real_port_needs_the_speed_that_is_asked_for() {
        for (set, is_real_enough) in [
            (500_000, true),
            (495_000, true),
            (461_538, false),
            (0, false),
        ] {
            assert_eq!(will_do(set, 500_000, false), is_real_enough, "{set}");
            assert!(will_do(set, 500_000, true));
        }
    }

    #[test]
    fn every_refusal_of_the_system_says_what_to_do() {
        let path = Path::new("/dev/ttyUSB7");
        for (errno, advice) in [
            (Errno::NOENT, "plug in the board's USB cable"),
            (Errno::NXIO, "plug in the board's USB cable"),
            (Errno::ACCESS, "usermod -aG dialout"),
            (Errno::BUSY, "stop that one"),
            (Errno::AGAIN, "stop that one"),
            (Errno::NOTTY, "is not a serial port"),
        ] {
            let text = OpenPortError::from_errno(path, errno).to_string();
            assert!(
                text.contains("/dev/ttyUSB7") && text.contains(advice),
                "{text}"
            );
        }
        let other = OpenPortError::from_errno(path, Errno::IO);
        assert!(matches!(other, OpenPortError::System { .. }));
    }
}
