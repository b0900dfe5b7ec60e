//! What holds for any bytes at all. The ordinary tests and the fuzz target ask for the same.

use std::fmt::{Debug, Display};

use lager_floor::Grid;
use lager_lines::conversation::{RobotLine, StationLine};
use lager_lines::gag::{Answer, Request};
use lager_lines::splitter::{LineError, LineSplitter};
use lager_lines::strings::{Goods, map_string, read_map};
use lager_lines::{MAX_LINE, to_line};

/// Splits `bytes`, reads every line as everything, and panics where a law is broken. Tells how many
/// lines were read as something and how many as nothing.
pub(crate) fn hold(bytes: &[u8]) -> (u64, u64) {
    let lines = split(bytes, bytes.len());
    assert_eq!(lines, split(bytes, 1), "pieces of a byte");
    assert_eq!(lines, split(bytes, 7), "pieces of seven bytes");
    let (mut read, mut refused) = (0, 0);
    for line in lines.into_iter().flatten() {
        assert!(line.len() <= MAX_LINE && !line.contains('\n'), "{line:?}");
        if reads(&line) {
            read += 1;
        } else {
            refused += 1;
        }
    }
    (read, refused)
}

/// The lines of `bytes`, given in pieces of `size`.
pub(crate) fn split(bytes: &[u8], size: usize) -> Vec<Result<String, LineError>> {
    let mut splitter = LineSplitter::new();
    let mut lines = Vec::new();
    for mut piece in bytes.chunks(size.max(1)) {
        while let Some(line) = splitter.next(&mut piece) {
            lines.push(line.map(str::to_owned));
        }
        assert!(piece.is_empty(), "everything is taken");
    }
    assert!(splitter.pending() <= MAX_LINE + 1);
    lines
}

/// Reads a line as everything it may be; tells whether it is something.
fn reads(line: &str) -> bool {
    let map = |text: &str| read_map(text).map(MapText);
    [
        back(line, Request::read),
        back(line, Answer::read),
        back(line, RobotLine::read),
        back(line, StationLine::read),
        back(line, map),
        // The empty line is the string of no goods.
        back(line, Goods::read) && !line.is_empty(),
    ]
    .contains(&true)
}

/// A map as its string.
#[derive(Debug, PartialEq)]
struct MapText(Grid);

impl Display for MapText {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&map_string(self.0))
    }
}

/// What was read can be written and is read as the same; what was not read is refused in a
/// sentence of one line.
fn back<T, E>(line: &str, read: impl Fn(&str) -> Result<T, E>) -> bool
where
    T: Display + Debug + PartialEq,
    E: Display + Debug,
{
    match read(line) {
        Ok(value) => {
            let written = to_line(&value).expect("what fits in a line fits again");
            let body = written.strip_suffix('\n').expect("a line's end");
            assert_eq!(read(body).as_ref().ok(), Some(&value), "{line:?}");
            true
        }
        Err(error) => {
            let sentence = error.to_string();
            assert!(sentence.starts_with("column "), "{line:?}: {sentence}");
            let breaks = sentence.chars().filter(|c| c.is_control()).count();
            assert_eq!(breaks, 0, "{line:?}: {sentence:?}");
            false
        }
    }
}
