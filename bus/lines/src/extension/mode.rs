//! Who drives, and who picks the goods up: words that orders and states have in common.

/// Who drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// A person.
    Manual,
    /// The logic unit.
    Autonomous,
}

impl Mode {
    pub(super) const WANTED: &str = "manual or autonomous";

    /// The word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Manual => "manual",
            Self::Autonomous => "autonomous",
        }
    }

    /// The mode with this word.
    pub fn from_word(word: &str) -> Option<Self> {
        let both = [Self::Manual, Self::Autonomous];
        both.into_iter().find(|mode| mode.as_str() == word)
    }
}

/// Who picks the goods up at a station.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pick {
    /// A person.
    Manual,
    /// The robot, by itself.
    Auto,
}

impl Pick {
    pub(super) const WANTED: &str = "manual or auto";

    /// The word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Manual => "manual",
            Self::Auto => "auto",
        }
    }

    /// Whose word it is.
    pub fn from_word(word: &str) -> Option<Self> {
        let both = [Self::Manual, Self::Auto];
        both.into_iter().find(|pick| pick.as_str() == word)
    }
}
