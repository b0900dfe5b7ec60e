//! [`BoardLine`]: a board's serial port as the boards' bootloader needs it.

use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::time::Duration;

use lager_bridge::serial::{OpenPortError, SerialPort};
use lager_home::Clock;
use lager_loader::Line;
use lager_wake::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

/// The longest wait before it looks whether somebody ends the program, in real time.
const LOOK: Duration = Duration::from_millis(50);
const LOOK_SPEC: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 50_000_000,
};
/// The longest command has 262 bytes, which take 0.3 s at 9600 Bd.
const SENDS: Duration = Duration::from_secs(3);

/// An open port, and the time of the board behind it.
pub struct BoardLine {
    port: SerialPort,
    clock: Clock,
    shutdown: Shutdown,
    received: VecDeque<u8>,
}

impl BoardLine {
    /// Opens a port for this process alone.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(
        path: &Path,
        baud: u32,
        clock: Clock,
        shutdown: &Shutdown,
    ) -> Result<Self, OpenPortError> {
        Ok(Self {
            port: SerialPort::open(path, baud)?,
            clock,
            shutdown: shutdown.clone(),
            received: VecDeque::new(),
        })
    }

    /// Fails once somebody ends the program.
    fn go_on(&self) -> io::Result<()> {
        match self.shutdown.is_requested() {
            true => Err(io::Error::other("somebody has ended this program")),
            false => Ok(()),
        }
    }
}

impl Line for BoardLine {
    fn send(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        let until = self.now() + SENDS;
        while !bytes.is_empty() {
            self.go_on()?;
            match rustix::io::write(&self.port, bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) if self.now() < until => {
                    let mut fds = [PollFd::new(&self.port, PollFlags::OUT)];
                    // An interrupted wait is only shorter.
                    let _ = poll(&mut fds, Some(&LOOK_SPEC));
                }
                Err(errno) => return Err(errno.into()),
            }
        }
        Ok(())
    }

    fn receive(&mut self, within: Duration) -> io::Result<Option<u8>> {
        let until = self.now() + within;
        let mut chunk = [0; 512];
        loop {
            if let Some(byte) = self.received.pop_front() {
                return Ok(Some(byte));
            }
            self.go_on()?;
            let left = until.saturating_sub(self.now());
            if left.is_zero() {
                return Ok(None);
            }
            let wait = self.clock.real(left).min(LOOK);
            let count = self.port.read(&mut chunk, wait).map_err(io::Error::other)?;
            self.received.extend(&chunk[..count]);
        }
    }

    fn now(&self) -> Duration {
        self.clock.now()
    }
}
