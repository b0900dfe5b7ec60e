//! [`Line`]: what the Pi's end needs of a serial line.

use core::time::Duration;
use std::io;

/// A serial line to one board, and a clock.
pub trait Line {
    /// Sends all bytes.
    ///
    /// # Errors
    /// The line is gone.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// The next byte; `None` if none has come within this time.
    ///
    /// # Errors
    /// The line is gone.
    fn receive(&mut self, within: Duration) -> io::Result<Option<u8>>;

    /// The time since any fixed instant.
    fn now(&self) -> Duration;
}
