//! Says what is wrong with a line, in which column, and what should stand there.

use core::fmt;

/// A part of a line is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misread {
    /// Where, in characters from 1.
    pub column: usize,
    /// What should stand there, as the end of a sentence.
    pub wanted: &'static str,
    /// What stands there.
    pub found: Found,
}

/// What a line has at some place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// Nothing: the line ends.
    End,
    /// Nothing: a field is empty, and the line goes on.
    Nothing,
    /// A word, of which at most [`Found::EXCERPT`] characters are kept.
    Word(String),
}

impl Found {
    /// The most characters that are kept of a word.
    pub const EXCERPT: usize = 24;

    pub(crate) fn new(text: &str, is_at_end: bool) -> Self {
        match text {
            "" if is_at_end => Self::End,
            "" => Self::Nothing,
            word => Self::Word(word.chars().take(Self::EXCERPT).collect()),
        }
    }
}

impl fmt::Display for Misread {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            column,
            wanted,
            found,
        } = self;
        match found {
            Found::End => write!(
                formatter,
                "column {column}: the line ends, but {wanted} belongs here"
            ),
            Found::Nothing => write!(
                formatter,
                "column {column}: nothing stands here, but {wanted} belongs here"
            ),
            // Escaped, so that a terminal can show it.
            Found::Word(word) => write!(
                formatter,
                "column {column}: {word:?} stands here, but {wanted} belongs here"
            ),
        }
    }
}

impl core::error::Error for Misread {}
