//! Makes lines of bytes that come in pieces of any size.
//!
//! ```text
//!              byte                            the byte beyond MAX_LINE
//!            ┌──────┐                          refused: TooLong
//!            ▼      │                        ┌──────────────────────┐
//!        ┌─────────────┐                     │                      ▼
//!        │   filling   │─────────────────────┘               ┌─────────────┐
//!        └─────────────┘                                     │  skipping   │ bytes are dropped
//!            ▲      │ LF: a line, or refused: NotUtf8        └─────────────┘
//!            └──────┘                                               │ LF
//!            └──────────────────────────────────────────────────────┘
//! ```
//!
//! A line ends with LF or CR LF. A line of more than [`MAX_LINE`] bytes is refused once, as soon as
//! that is certain, and skipped to its end. The next line is read as usual. A line without its end
//! is never returned, because the connection may have ended in its middle. The splitter keeps at
//! most one line in memory.
//!
//! ```
//! use lager_lines::splitter::{LineError, LineSplitter};
//!
//! let mut splitter = LineSplitter::new();
//! let mut bytes: &[u8] = b"styrcomm 2\r\nth\xFFught\nstyr";
//! assert_eq!(splitter.next(&mut bytes), Some(Ok("styrcomm 2")));
//! assert_eq!(splitter.next(&mut bytes), Some(Err(LineError::NotUtf8 { column: 3 })));
//! assert_eq!(splitter.next(&mut bytes), None);
//! assert!(bytes.is_empty());
//! assert_eq!(splitter.pending(), 4);
//!
//! let mut bytes: &[u8] = b"comm 1\n";
//! assert_eq!(splitter.next(&mut bytes), Some(Ok("styrcomm 1")));
//! ```

use thiserror::Error;

use crate::writer::MAX_LINE;

/// Why a line is refused. The lines after it are not affected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum LineError {
    /// It is longer than [`MAX_LINE`] bytes. The rest of it is skipped.
    #[error("the line has more than {MAX_LINE} bytes; send shorter ones")]
    TooLong,
    /// It is not UTF-8.
    #[error("column {column}: here the line is not UTF-8; send it in that encoding")]
    NotUtf8 {
        /// Where the first wrong byte stands, in characters from 1.
        column: usize,
    },
}

/// Takes bytes and gives lines.
#[derive(Clone, Debug)]
pub struct LineSplitter {
    /// Has room for one byte more than a line, for the CR before the LF.
    buffer: [u8; MAX_LINE + 1],
    used: usize,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// The line in the buffer is not complete.
    Filling,
    /// The line in the buffer has been returned; the next byte begins a new one.
    Given,
    /// The line was too long, and has not ended yet.
    Skipping,
}

impl LineSplitter {
    /// A splitter at the beginning of a line.
    pub const fn new() -> Self {
        Self {
            buffer: [0; MAX_LINE + 1],
            used: 0,
            state: State::Filling,
        }
    }

    /// Takes bytes from the front of `bytes` until a line is complete or refused. `None` if all
    /// bytes are taken before that.
    pub fn next(&mut self, bytes: &mut &[u8]) -> Option<Result<&str, LineError>> {
        while let Some((&byte, rest)) = bytes.split_first() {
            *bytes = rest;
            if self.take(byte) {
                return Some(self.outcome());
            }
        }
        None
    }

    /// How many bytes of an incomplete line wait here. If there are any when a connection ends, it
    /// ended in the middle of a line.
    pub const fn pending(&self) -> usize {
        match self.state {
            State::Filling => self.used,
            State::Given | State::Skipping => 0,
        }
    }

    /// Takes one byte. Returns whether the line ends or is refused with it.
    fn take(&mut self, byte: u8) -> bool {
        if self.state == State::Given {
            self.used = 0;
            self.state = State::Filling;
        }
        match (self.state, byte) {
            (State::Skipping, b'\n') => {
                self.used = 0;
                self.state = State::Filling;
                false
            }
            (State::Skipping, _) => false,
            (_, b'\n') => {
                self.state = State::Given;
                true
            }
            // The byte after the limit may only be a CR, because an LF may follow.
            (_, byte) if self.used < MAX_LINE || (self.used == MAX_LINE && byte == b'\r') => {
                self.buffer[self.used] = byte;
                self.used += 1;
                false
            }
            _ => {
                self.state = State::Skipping;
                true
            }
        }
    }

    /// The line that has just ended, or why it is refused.
    fn outcome(&self) -> Result<&str, LineError> {
        if self.state == State::Skipping {
            return Err(LineError::TooLong);
        }
        let line = &self.buffer[..self.used];
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        core::str::from_utf8(line).map_err(|error| {
            let (good, _) = line.split_at(error.valid_up_to());
            let before = core::str::from_utf8(good).map_or(0, |good| good.chars().count());
            LineError::NotUtf8 { column: before + 1 }
        })
    }
}

impl Default for LineSplitter {
    fn default() -> Self {
        Self::new()
    }
}
