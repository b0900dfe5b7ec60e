//! Turns a value into a line with its end. Only this file does that.

use core::fmt::{self, Write as _};

use thiserror::Error;

/// The most bytes a line has without its end.
pub const MAX_LINE: usize = 1024;

/// A value that does not fit in one line. The caller must shorten the list or cut the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("this would be a line of {length} bytes; at most {MAX_LINE} are allowed, so say less")]
pub struct TooLong {
    /// Bytes the line would have without its end.
    pub length: usize,
}

/// The line for `value`, with LF at its end.
///
/// ```
/// use lager_lines::{gag::Answer, to_line};
///
/// let answer = Answer::read("sidelength 40").unwrap();
/// assert_eq!(to_line(&answer).unwrap(), "sidelength 40\n");
/// ```
///
/// # Errors
///
/// The line would be longer than [`MAX_LINE`] bytes.
pub fn to_line(value: &impl fmt::Display) -> Result<String, TooLong> {
    let mut line = Bounded::default();
    // Only `Display` itself could fail, and none of this crate's does.
    let _ = write!(line, "{value}");
    if line.length > MAX_LINE {
        return Err(TooLong {
            length: line.length,
        });
    }
    line.text.push('\n');
    Ok(line.text)
}

/// Keeps at most a line of text, and counts the bytes beyond.
#[derive(Default)]
struct Bounded {
    text: String,
    length: usize,
}

impl fmt::Write for Bounded {
    fn write_str(&mut self, piece: &str) -> fmt::Result {
        self.length += piece.len();
        if self.length <= MAX_LINE {
            self.text.push_str(piece);
        }
        Ok(())
    }
}
