//! Reads a line word by word and knows at which column it is.

use crate::misread::{Found, Misread};
use crate::text::{Text, TextError};

/// What separates words.
const BLANKS: [char; 2] = [' ', '\t'];

/// A line and how far it has been read.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a> {
    line: &'a str,
    /// The byte at which the next word or a blank before it begins.
    at: usize,
}

/// A word and its place. After the last word, it is an empty word.
#[derive(Clone, Copy)]
pub(crate) struct Word<'a> {
    pub(crate) text: &'a str,
    line: &'a str,
    /// The byte of the line at which it begins.
    start: usize,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(line: &'a str) -> Self {
        Self { line, at: 0 }
    }

    /// The whole line as one word.
    pub(crate) fn whole(line: &'a str) -> Word<'a> {
        Word {
            text: line,
            line,
            start: 0,
        }
    }

    /// The next word; an empty one at the end of the line.
    pub(crate) fn word(&mut self) -> Word<'a> {
        let rest = &self.line[self.at..];
        let word = rest.trim_start_matches(BLANKS);
        let start = self.line.len() - word.len();
        let length = word.find(BLANKS).unwrap_or(word.len());
        self.at = start + length;
        Word {
            text: &word[..length],
            line: self.line,
            start,
        }
    }

    /// The next word, without taking it.
    pub(crate) fn ahead(mut self) -> Word<'a> {
        self.word()
    }

    /// Everything after the one blank that follows the last word, unchanged.
    pub(crate) fn rest_as_text(&mut self) -> Result<Text, Misread> {
        let rest = &self.line[self.at..];
        let text = rest.strip_prefix(BLANKS).unwrap_or(rest);
        let whole = Word {
            text,
            line: self.line,
            start: self.line.len() - text.len(),
        };
        self.at = self.line.len();
        Text::new(text).map_err(|TextError::LineBreak { column }| {
            let before = text.char_indices().nth(column - 1);
            whole
                .from(before.map_or(0, |(byte, _)| byte))
                .misread("a text without a line break")
        })
    }

    /// Checks that nothing is left.
    pub(crate) fn end(mut self) -> Result<(), Misread> {
        let word = self.word();
        if word.text.is_empty() {
            Ok(())
        } else {
            Err(word.misread("the end of the line"))
        }
    }
}

impl<'a> Word<'a> {
    /// Where it begins, in characters from 1.
    pub(crate) fn column(self) -> usize {
        self.line[..self.start].chars().count() + 1
    }

    /// The error that something else should stand here.
    pub(crate) fn misread(self, wanted: &'static str) -> Misread {
        Misread {
            column: self.column(),
            wanted,
            found: Found::new(self.text, self.start == self.line.len()),
        }
    }

    /// This word as a number from `least` to `most`.
    pub(crate) fn number<T: TryFrom<i64>>(
        self,
        wanted: &'static str,
        least: i64,
        most: i64,
    ) -> Result<T, Misread> {
        let digits = self.text.strip_prefix('-').unwrap_or(self.text);
        let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        let number: Option<i64> = self.text.parse().ok().filter(|_| is_number);
        number
            .filter(|number| (least..=most).contains(number))
            .and_then(|number| T::try_from(number).ok())
            .ok_or_else(|| self.misread(wanted))
    }

    /// This word as the value that `read` makes of it.
    pub(crate) fn read<T>(
        self,
        wanted: &'static str,
        read: impl FnOnce(&'a str) -> Option<T>,
    ) -> Result<T, Misread> {
        read(self.text).ok_or_else(|| self.misread(wanted))
    }

    /// The parts before and after the first mark `by`, if there is one.
    pub(crate) fn split(self, by: char) -> Option<(Self, Self)> {
        let before = self.text.find(by)?;
        Some((self.first(before), self.from(before + by.len_utf8())))
    }

    /// The parts between the marks `by`, each with its place.
    pub(crate) fn parts(self, by: char) -> impl Iterator<Item = Word<'a>> {
        let mut start = self.start;
        self.text.split(by).map(move |text| {
            let part = Word {
                text,
                start,
                ..self
            };
            start += text.len() + by.len_utf8();
            part
        })
    }

    /// The same without blanks around it.
    pub(crate) fn trimmed(self) -> Self {
        let text = self.text.trim_start_matches(BLANKS);
        let before = self.text.len() - text.len();
        let text = text.trim_end_matches(BLANKS);
        self.from(before).first(text.len())
    }

    /// The same without the mark `last` at its end.
    pub(crate) fn without_last(self, last: char) -> Self {
        let text = self.text.strip_suffix(last).unwrap_or(self.text);
        self.first(text.len())
    }

    /// The empty place after it.
    pub(crate) fn end(self) -> Self {
        self.from(self.text.len())
    }

    /// Its rest after its first `bytes`.
    fn from(self, bytes: usize) -> Self {
        Self {
            text: &self.text[bytes..],
            start: self.start + bytes,
            ..self
        }
    }

    /// Its first `bytes`.
    fn first(self, bytes: usize) -> Self {
        Self {
            text: &self.text[..bytes],
            ..self
        }
    }
}
