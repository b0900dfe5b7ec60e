//! `prove`, `proof` and `proved`: by what a robot and a station prove who they are.

use core::fmt;

use crate::misread::Misread;
use crate::reader::Reader;
use crate::secret::{Code, Nonce};

/// A line by which a robot and a station prove to each other that they know the robot's secret
/// ([`secret`](crate::secret)).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// The station asks for a proof, with its nonce.
    Asked(Nonce),
    /// The robot proves it, and asks the station with its own nonce.
    Robot(Nonce, Code),
    /// The station proves it.
    Station(Code),
}

impl Proof {
    const ASKED: &str = "prove";
    const ROBOT: &str = "proof";
    const STATION: &str = "proved";

    /// Reads a line; `None` if its first word is another one.
    ///
    /// # Errors
    ///
    /// When a nonce or a code is missing or is none.
    pub fn read(line: &str) -> Option<Result<Self, Misread>> {
        let mut reader = Reader::new(line);
        let first = reader.word().text;
        let nonce = |reader: &mut Reader<'_>| reader.word().read(Nonce::WANTED, Nonce::read);
        let code = |reader: &mut Reader<'_>| reader.word().read(Code::WANTED, Code::read);
        let read = match first {
            Self::ASKED => nonce(&mut reader).map(Self::Asked),
            Self::ROBOT => {
                nonce(&mut reader).and_then(|nonce| Ok(Self::Robot(nonce, code(&mut reader)?)))
            }
            Self::STATION => code(&mut reader).map(Self::Station),
            _ => return None,
        };
        Some(read.and_then(|read| reader.end().map(|()| read)))
    }
}

impl fmt::Display for Proof {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Asked(nonce) => write!(formatter, "{} {nonce}", Self::ASKED),
            Self::Robot(nonce, code) => write!(formatter, "{} {nonce} {code}", Self::ROBOT),
            Self::Station(code) => write!(formatter, "{} {code}", Self::STATION),
        }
    }
}
