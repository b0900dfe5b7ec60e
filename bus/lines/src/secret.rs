//! A secret that only a robot and its station know. With it each proves its name to the other.
//!
//! Nobody ever sends the secret itself. Each side chooses a [`Nonce`], and sends the HMAC-SHA256 of
//! both nonces and the robot's name, made with the secret (`extension::Proof`). Somebody who
//! listens cannot use an old proof, because the other side's next nonce is different. Nor can he
//! send back what he received, because the robot's proof and the station's differ.
//!
//! This proves who is at the other end when a connection begins. It does not encrypt. On a network
//! where others can write, robot and station need a tunnel.

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
/// The system cannot give any.
pub fn random<const N: usize>() -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    let got = getrandom(&mut bytes, GetRandomFlags::empty())?;
    if got != N {
        return Err(io::Error::other("the system gave too few random bytes"));
    }
    Ok(bytes)
}

/// A secret: 16 to 256 visible ASCII characters. Debug output hides it.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

/// Why a text is not a secret, or not a list of secrets.
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
    /// The robot's name is not valid.
    #[error("line {line}: {error}")]
    Name {
        /// Where, from 1.
        line: usize,
        /// Why not.
        error: NameError,
    },
    /// The line has more than a name and a secret.
    #[error("line {line}: write `<name> <secret>`, or one secret alone for all robots")]
    Words {
        /// Where, from 1.
        line: usize,
    },
    /// A robot has two secrets.
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
    /// A new secret of 256 random bits.
    ///
    /// # Errors
    ///
    /// The system cannot give random bytes.
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

    /// The secret as text, for a file.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// A word of 32 hexadecimal digits, made from the secret and a purpose. Nobody can compute the
    /// secret from it.
    pub fn word(&self, purpose: &str) -> String {
        let mac = self.mac(&["lager word", purpose]);
        hex(&mac.finalize().into_bytes()[..16])
    }

    /// This side's proof that it knows the secret.
    pub fn code(&self, side: Side, meeting: &Meeting<'_>) -> Code {
        Code(self.meet(side, meeting).finalize().into_bytes().into())
    }

    /// Whether this code proves that the other side knows the secret. It always takes the same
    /// time, however much of the code is right.
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

    /// The HMAC over these parts, none of which has a line break.
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

/// The side that proves something.
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

/// The values with which one connection begins.
#[derive(Clone, Copy, Debug)]
pub struct Meeting<'m> {
    /// The robot's name.
    pub robot: &'m Name,
    /// The station's nonce.
    pub stations: Nonce,
    /// The robot's nonce.
    pub robots: Nonce,
}

/// A number that one side chooses for one connection: 16 random bytes, written as 32 hexadecimal
/// digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nonce([u8; 16]);

impl Nonce {
    pub(crate) const WANTED: &str = "32 digits of 0-9 and a-f";

    /// The nonce with these bytes.
    pub const fn new(bytes: [u8; 16]) -> Self {
        Self(bytes)
    }

    /// A new nonce.
    ///
    /// # Errors
    ///
    /// The system cannot give random bytes.
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

/// A proof that its sender knows a secret: 32 bytes, written as 64 hexadecimal digits.
/// [`Secret::is_proved`] checks it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code([u8; 32]);

impl Code {
    pub(crate) const WANTED: &str = "64 digits of 0-9 and a-f";

    /// The proof with these bytes.
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

/// The secrets that a station or a robot knows: one for each robot, or one for all, or both.
///
/// As text, each line has one secret, as `<name> <secret>` or alone. Empty lines and lines that
/// begin with `#` do not count.
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
    /// When a line is not valid, or there is no secret.
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
    /// One secret for all robots.
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
