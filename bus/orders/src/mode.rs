//! [`Mode`] and [`Pick`]: who drives, and who picks the goods up.

use serde::{Deserialize, Serialize};

/// Who drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum Mode {
    /// A person, the operator.
    Manual = 0,
    /// Logic, the navigator.
    Autonomous = 1,
}

#[cfg(feature = "lager-sample")]
lager_sample::coded_as_is!(Mode { Manual, Autonomous });

impl Mode {
    /// The other mode.
    pub const fn other(self) -> Self {
        match self {
            Self::Manual => Self::Autonomous,
            Self::Autonomous => Self::Manual,
        }
    }

    /// The mode's word.
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum Pick {
    /// A person moves the arm and says when it is done.
    Manual = 0,
    /// The robot picks by itself.
    Auto = 1,
}

#[cfg(feature = "lager-sample")]
lager_sample::coded_as_is!(Pick { Manual, Auto });

impl Pick {
    /// Its word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Manual => "manual",
            Self::Auto => "auto",
        }
    }

    /// The value with this word.
    pub fn from_word(word: &str) -> Option<Self> {
        let both = [Self::Manual, Self::Auto];
        both.into_iter().find(|pick| pick.as_str() == word)
    }
}
