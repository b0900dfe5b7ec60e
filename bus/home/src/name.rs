//! [`UnitName`]: the name of a unit, such as a robot.

use std::fmt;
use std::str::FromStr;

/// The transport's folder. It stands in the bus's folder beside those of the units.
pub(crate) const TRANSPORT: &str = "iceoryx2";

/// Whether the name is not free for a unit because the transport uses it.
pub(crate) fn is_transport(name: &str) -> bool {
    name.starts_with(TRANSPORT)
}

/// The name of a unit: 1 to 24 characters of `a`-`z`, `0`-`9` and `-`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct UnitName(String);

impl UnitName {
    /// The longest name, in characters.
    pub const MAX_LENGTH: usize = 24;

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for UnitName {
    fn default() -> Self {
        Self("r1".to_owned())
    }
}

impl fmt::Display for UnitName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Why a text is not a unit's name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnitNameError {
    /// It is empty.
    #[error("a name cannot be empty; use 1 to 24 of a-z, 0-9 and -, for example `r1`")]
    Empty,
    /// It is too long.
    #[error("the name `{0}` has more than 24 characters; choose a shorter one")]
    TooLong(String),
    /// The transport's folder beside the units' folders has this name.
    #[error(
        "nothing can be called `{0}`, as the bus keeps its own files under that name; choose another"
    )]
    Reserved(String),
    /// It has a character that is not allowed.
    #[error("the name `{name}` contains `{character}`; only a-z, 0-9 and - are allowed")]
    Character {
        /// The text.
        name: String,
        /// The first character that is not allowed.
        character: char,
    },
}

impl FromStr for UnitName {
    type Err = UnitNameError;

    fn from_str(text: &str) -> Result<Self, UnitNameError> {
        if text.is_empty() {
            return Err(UnitNameError::Empty);
        }
        let allowed = |c: &char| c.is_ascii_lowercase() || c.is_ascii_digit() || *c == '-';
        if let Some(character) = text.chars().find(|c| !allowed(c)) {
            return Err(UnitNameError::Character {
                name: text.to_owned(),
                character,
            });
        }
        if text.len() > Self::MAX_LENGTH {
            return Err(UnitNameError::TooLong(text.to_owned()));
        }
        if is_transport(text) {
            return Err(UnitNameError::Reserved(text.to_owned()));
        }
        Ok(Self(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_names_are_taken_as_they_are() {
        for name in ["r1", "a", "-", "unit-7", "abcdefghijklmnopqrstuvwx"] {
            assert_eq!(name.parse::<UnitName>().unwrap().as_str(), name);
        }
    }

    #[test]
    fn bad_names_are_refused_with_the_reason() {
        let reason = |name: &str| name.parse::<UnitName>().unwrap_err().to_string();
        assert!(reason("").contains("cannot be empty"));
        assert!(reason("R1").contains("contains `R`"));
        assert!(reason("r/1").contains("contains `/`"));
        assert!(reason("å").contains("contains `å`"));
        assert!(reason("iceoryx2").contains("its own files"));
        assert!(reason("abcdefghijklmnopqrstuvwxy").contains("more than 24"));
    }
}
