//! One file of the history: its lines, written and read.

use std::fmt::Write as _;
use std::fs::OpenOptions;
use std::io::{self, BufRead as _, BufReader, Read as _};
use std::ops::ControlFlow;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

use rustix::fs::OFlags;

use super::parts::MOST_OF_PART;

/// One line of the history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry<'l> {
    /// When, in ms since 1970.
    pub at_ms: u64,
    /// The robot's name.
    pub robot: &'l str,
    /// What it told: a line of the extension, `thought <text>`, or `asked <name> <what>`.
    pub line: &'l str,
}

impl<'l> Entry<'l> {
    /// The first word of its line, which says the kind.
    pub fn word(&self) -> &'l str {
        self.line.split(' ').next().unwrap_or_default()
    }

    /// Whether it is a state.
    pub fn is_state(&self) -> bool {
        self.word() == "state"
    }

    /// Adds it to the lines that are written next.
    pub(crate) fn put(&self, lines: &mut String) {
        let Self { at_ms, robot, line } = self;
        let text = format!("{at_ms} {robot} {line}");
        // Writing to a text cannot fail.
        let _ = writeln!(lines, "{:08x} {text}", crc32fast::hash(text.as_bytes()));
    }

    /// A line of a file without its end; `None` if it is damaged.
    fn read(line: &'l [u8]) -> Option<Self> {
        let line = str::from_utf8(line).ok()?;
        let (crc, text) = line.split_once(' ')?;
        if crc.len() != 8 || u32::from_str_radix(crc, 16) != Ok(crc32fast::hash(text.as_bytes())) {
            return None;
        }
        let (at_ms, rest) = text.split_once(' ')?;
        let (robot, line) = rest.split_once(' ')?;
        let at_ms = at_ms.parse().ok()?;
        Some(Self { at_ms, robot, line })
    }
}

/// How the reading of a part went.
#[derive(Clone, Copy, Debug)]
pub(super) struct Read {
    /// Whether the reader wants no more.
    pub(super) flow: ControlFlow<()>,
    /// Lines that were left out because they are damaged.
    pub(super) damaged: u64,
    /// Whether the end of its last line is missing.
    pub(super) is_torn: bool,
}

/// Hands on each line of a part.
///
/// # Errors
/// It cannot be opened or read, or is no regular file.
pub(super) fn read(
    path: &Path,
    mut each: impl FnMut(&Entry<'_>) -> ControlFlow<()>,
) -> io::Result<Read> {
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY;
    let file = OpenOptions::new()
        .read(true)
        .custom_flags(flags.bits() as i32)
        .open(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("it is no regular file"));
    }
    let mut reader = BufReader::with_capacity(64 * 1024, file.take(MOST_OF_PART));
    let mut line = Vec::new();
    let mut read = Read {
        flow: ControlFlow::Continue(()),
        damaged: 0,
        is_torn: false,
    };
    loop {
        line.clear();
        if reader.read_until(b'\n', &mut line)? == 0 {
            return Ok(read);
        }
        let Some(whole) = line.strip_suffix(b"\n") else {
            read.is_torn = true;
            return Ok(read);
        };
        match Entry::read(whole) {
            Some(entry) => read.flow = each(&entry),
            None => read.damaged += 1,
        }
        if read.flow.is_break() {
            return Ok(read);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_was_written_and_no_changed_byte_is_taken_for_it() {
        let entry = Entry {
            at_ms: 1_795_449_546_120,
            robot: "r1",
            line: "thought jag står  still",
        };
        let mut lines = String::new();
        entry.put(&mut lines);
        let line = lines.strip_suffix('\n').unwrap().as_bytes();
        assert_eq!(Entry::read(line), Some(entry));
        for place in 0..line.len() {
            let mut changed = line.to_vec();
            changed[place] ^= 1;
            assert_eq!(Entry::read(&changed), None, "{place}");
            assert_eq!(Entry::read(&line[..place]), None, "{place}");
        }
    }
}
