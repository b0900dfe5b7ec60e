//! Free text at the end of a line, and names, which are single words.

use core::fmt;

use thiserror::Error;

/// Any text without a line break. It may hold other control characters, so a program that shows it
/// in a terminal must escape them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Text(String);

/// Why something is not a [`Text`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum TextError {
    /// It has a line break.
    #[error("column {column}: a line break stands here, but a text is one line; leave it out")]
    LineBreak {
        /// Where, in characters from 1.
        column: usize,
    },
}

impl Text {
    /// The text, unchanged.
    ///
    /// # Errors
    ///
    /// It has a CR or an LF.
    pub fn new(text: impl Into<String>) -> Result<Self, TextError> {
        let text = text.into();
        match text
            .chars()
            .position(|character| matches!(character, '\r' | '\n'))
        {
            Some(before) => Err(TextError::LineBreak { column: before + 1 }),
            None => Ok(Self(text)),
        }
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Text {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// A name: 1 to 32 of `a`-`z`, `0`-`9`, `-` and `_`. Names of robots have this form.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Name(String);

/// Why something is not a [`Name`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum NameError {
    /// It is empty or too long.
    #[error("a name has 1 to {most} characters, not {length}", most = Name::MAX_LENGTH)]
    Length {
        /// Its length in characters.
        length: usize,
    },
    /// It has a character that names may not have.
    #[error("column {column}: {found:?} stands here; a name is made of a-z, 0-9, - and _")]
    Character {
        /// Where, in characters from 1.
        column: usize,
        /// What stands there.
        found: char,
    },
}

impl Name {
    /// The longest name, in characters.
    pub const MAX_LENGTH: usize = 32;
    pub(crate) const WANTED: &str = "a name of 1 to 32 of a-z, 0-9, - and _";

    /// The text as a name.
    ///
    /// # Errors
    ///
    /// It is too short, too long or has other characters.
    pub fn new(name: impl Into<String>) -> Result<Self, NameError> {
        let name = name.into();
        let allowed = |found: char| matches!(found, 'a'..='z' | '0'..='9' | '-' | '_');
        let length = name.chars().count();
        if let Some((before, found)) = name.chars().enumerate().find(|(_, c)| !allowed(*c)) {
            return Err(NameError::Character {
                column: before + 1,
                found,
            });
        }
        if (1..=Self::MAX_LENGTH).contains(&length) {
            Ok(Self(name))
        } else {
            Err(NameError::Length { length })
        }
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Name {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}
