//! What a robot and its station know and nobody else: a secret, by which each proves to the other
//! that it is who it says.
//!
//! The secret itself is never said. Each side chooses a [`Nonce`], and says the HMAC-SHA256 of both
//! nonces and the robot's name under the secret (`extension::Proof`). Who listens cannot say it
//! again, because the other side's next nonce is another one; and what the robot says is not what
//! the station says, so nobody passes with what he was told himself.
//!
//! It proves who is at the other end when a connection begins. It hides nothing that is said: over
//! a network that others can write to, robot and station talk through a tunnel.

use core::fmt;
use std::collections::BTreeMap;
use std::io;

use hmac::{Hmac, Mac as _};
use rustix::rand::{GetRandomFlags, getrandom};
use sha2::Sha256;
use thiserror::Error;

use crate::text::{Name, NameError};

/// Bytes that nobody can guess, from the system.
///
/// # Errors
///
/// When the system has none to give.
pub fn random<const N: usize>() -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    let got = getrandom(&mut bytes, GetRandomFlags::empty())?;
    if got != N {
        return Err(io::Error::other("the system gave too few random bytes"));
    }
    Ok(bytes)
}

/// A secret: 16 to 256 visible ASCII characters. It is not shown where it is printed for debugging.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

/// Why something is no secret, or no list of secrets.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SecretError {
    /// It is too short or too long.
    #[error(
        "line {line}: a secret has 16 to 256 characters, not {length}; \
         `head -c 24 /dev/urandom | base64` makes a good one"
    )]
    Length {
        /// Where, from 1.
        line: usize,
        /// Its length in bytes.
        length: usize,
    },
    /// A character that is not visible ASCII.
    #[error("line {line}: a secret is made of visible ASCII characters")]
    Character {
        /// Where, from 1.
        line: usize,
    },
    /// What should be a robot's name is none.
    #[error("line {line}: {error}")]
    Name {
        /// Where, from 1.
        line: usize,
        /// Why not.
        error: NameError,
    },
    /// More stands there than a name and a secret.
    #[error("line {line}: write `<name> <secret>`, or one secret alone for all robots")]
    Words {
        /// Where, from 1.
        line: usize,
    },
    /// It is told twice.
    #[error("line {line}: there is a secret of this robot, or of all, already; keep one of them")]
    Twice {
        /// Where, from 1.
        line: usize,
    },
    /// There is none.
    #[error("there is no secret in it; write `<name> <secret>` for each robot, or one for all")]
    Empty,
}

impl Secret {
    /// A new one, of 256 random bits.
    ///
    /// # Errors
    ///
    /// When the system has no random bytes to give.
    pub fn random() -> io::Result<Self> {
        Ok(Self(hex(&random::<32>()?)))
    }

    fn read(line: usize, text: &str) -> Result<Self, SecretError> {
        let length = text.len();
        if !text.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Err(SecretError::Character { line });
        }
        if !(16..=256).contains(&length) {
            return Err(SecretError::Length { line, length });
        }
        Ok(Self(text.to_owned()))
    }

    /// The secret as it stands in a file.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// A word of 32 hexadecimal digits that follows from the secret and from what it is for, and
    /// from which nobody learns the secret.
    pub fn word(&self, purpose: &str) -> String {
        let mac = self.mac(&["lager word", purpose]);
        hex(&mac.finalize().into_bytes()[..16])
    }

    /// What this side says to prove that it knows the secret.
    pub fn code(&self, side: Side, meeting: &Meeting<'_>) -> Code {
        Code(self.meet(side, meeting).finalize().into_bytes().into())
    }

    /// Whether that side knows the secret, who has said this code. It takes as long whatever of the
    /// code is right.
    pub fn is_proved(&self, side: Side, meeting: &Meeting<'_>, code: &Code) -> bool {
        self.meet(side, meeting).verify_slice(&code.0).is_ok()
    }

    fn meet(&self, side: Side, meeting: &Meeting<'_>) -> Hmac<Sha256> {
        let Meeting {
            robot,
            stations,
            robots,
        } = meeting;
        let (stations, robots) = (stations.to_string(), robots.to_string());
        self.mac(&[side.as_str(), robot.as_str(), &stations, &robots])
    }

    /// Over parts of which none has a line break.
    fn mac(&self, parts: &[&str]) -> Hmac<Sha256> {
        let mut mac = Hmac::new_from_slice(self.0.as_bytes()).expect("a key of any length");
        for part in parts {
            mac.update(part.as_bytes());
            mac.update(b"\n");
        }
        mac
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Secret(..)")
    }
}

/// Who proves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The robot, to the station.
    Robot,
    /// The station, to the robot.
    Station,
}

impl Side {
    const fn as_str(self) -> &'static str {
        match self {
            Self::Robot => "lager robot",
            Self::Station => "lager station",
        }
    }
}

/// The beginning of one connection.
#[derive(Clone, Copy, Debug)]
pub struct Meeting<'m> {
    /// The robot's name.
    pub robot: &'m Name,
    /// What the station has chosen.
    pub stations: Nonce,
    /// What the robot has chosen.
    pub robots: Nonce,
}

/// What one side has chosen for one connection: 16 random bytes, written as 32 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nonce([u8; 16]);

impl Nonce {
    pub(crate) const WANTED: &str = "32 digits of 0-9 and a-f";

    /// That of these bytes.
    pub const fn new(bytes: [u8; 16]) -> Self {
        Self(bytes)
    }

    /// A new one.
    ///
    /// # Errors
    ///
    /// When the system has no random bytes to give.
    pub fn random() -> io::Result<Self> {
        random().map(Self)
    }

    pub(crate) fn read(text: &str) -> Option<Self> {
        bytes(text).map(Self)
    }
}

impl fmt::Display for Nonce {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&hex(&self.0))
    }
}

/// What proves that its speaker knows a secret: 32 bytes, written as 64 hexadecimal digits. It is
/// compared by [`Secret::is_proved`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code([u8; 32]);

impl Code {
    pub(crate) const WANTED: &str = "64 digits of 0-9 and a-f";

    /// That of these bytes.
    pub const fn new(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    pub(crate) fn read(text: &str) -> Option<Self> {
        bytes(text).map(Self)
    }
}

impl fmt::Display for Code {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&hex(&self.0))
    }
}

/// The secrets that somebody knows: of each robot its own, or one of all robots, or both.
///
/// As text each stands on a line of its own, `<name> <secret>` or a secret alone. Empty lines and
/// lines that begin with `#` are passed over.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Secrets {
    named: BTreeMap<Name, Secret>,
    of_all: Option<Secret>,
}

impl Secrets {
    /// Reads a list of secrets.
    ///
    /// # Errors
    ///
    /// When a line is none, or there is no secret.
    pub fn read(text: &str) -> Result<Self, SecretError> {
        let mut secrets = Self::default();
        for (line, text) in (1..).zip(text.lines().map(str::trim)) {
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let mut words = text.split_whitespace();
            let before = match (words.next(), words.next(), words.next()) {
                (Some(secret), None, None) => {
                    let secret = Secret::read(line, secret)?;
                    secrets.of_all.replace(secret)
                }
                (Some(name), Some(secret), None) => {
                    let name = Name::new(name);
                    let name = name.map_err(|error| SecretError::Name { line, error })?;
                    secrets.named.insert(name, Secret::read(line, secret)?)
                }
                _ => return Err(SecretError::Words { line }),
            };
            if before.is_some() {
                return Err(SecretError::Twice { line });
            }
        }
        if secrets.is_empty() {
            return Err(SecretError::Empty);
        }
        Ok(secrets)
    }

    /// The secret of this robot, if there is one.
    pub fn of(&self, robot: &Name) -> Option<&Secret> {
        self.named.get(robot).or(self.of_all.as_ref())
    }

    /// The secret of all robots that have none of their own.
    pub const fn of_all(&self) -> Option<&Secret> {
        self.of_all.as_ref()
    }

    /// Whether no robot has one.
    pub fn is_empty(&self) -> bool {
        self.named.is_empty() && self.of_all.is_none()
    }
}

impl From<Secret> for Secrets {
    /// One of all robots.
    fn from(secret: Secret) -> Self {
        Self {
            named: BTreeMap::new(),
            of_all: Some(secret),
        }
    }
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    use core::fmt::Write as _;
    bytes.iter().fold(String::new(), |mut word, byte| {
        let _ = write!(word, "{byte:02x}");
        word
    })
}

fn bytes<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digit = |byte: u8| match byte {
        b'0'..=b'9' => Some(byte - b'0'),
        b'a'..=b'f' => Some(byte - b'a' + 10),
        _ => None,
    };
    let text = text.as_bytes();
    if text.len() != 2 * N {
        return None;
    }
    let mut bytes = [0; N];
    for (byte, pair) in bytes.iter_mut().zip(text.chunks_exact(2)) {
        *byte = digit(pair[0])? << 4 | digit(pair[1])?;
    }
    Some(bytes)
}
