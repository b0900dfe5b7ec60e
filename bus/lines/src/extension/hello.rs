//! `lager 1 <name> [<ms>]`: that a peer speaks the extension, and that it is there.

use core::fmt;

use super::fields::Value as _;
use crate::misread::Misread;
use crate::reader::Reader;
use crate::text::Name;

/// That a peer speaks the extension, and who it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hello {
    /// The highest version it speaks, 1 to 255.
    pub version: u8,
    /// The name of the robot, or of the station.
    pub name: Name,
    /// The robot's clock in ms when it said so; a station repeats what it answers.
    pub clock_ms: Option<u64>,
}

impl Hello {
    /// The version that is specified here.
    pub const VERSION: u8 = 1;
    pub(super) const WORD: &str = "lager";

    /// Reads a line; `None` if its first word is another one.
    ///
    /// # Errors
    ///
    /// When a version, a name or a time is none, or one of the first two is missing.
    pub fn read(line: &str) -> Option<Result<Self, Misread>> {
        let mut reader = Reader::new(line);
        (reader.word().text == Self::WORD).then(|| {
            let version = reader.word().number("a version from 1 to 255", 1, 255)?;
            let name = reader.word();
            let name = name.read(Name::WANTED, |name| Name::new(name).ok())?;
            let clock_ms = reader.word().read("a time in ms", |word| match word {
                "" => Some(None),
                ms => u64::of(ms).map(Some),
            })?;
            reader.end()?;
            Ok(Self {
                version,
                name,
                clock_ms,
            })
        })
    }

    /// The version that two who have announced themselves use.
    pub fn version_with(&self, other: &Self) -> u8 {
        self.version.min(other.version)
    }
}

impl fmt::Display for Hello {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {} {}", Self::WORD, self.version, self.name)?;
        match self.clock_ms {
            Some(ms) => write!(formatter, " {ms}"),
            None => Ok(()),
        }
    }
}
