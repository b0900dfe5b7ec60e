//! [`Packet`]: a packet as eleven bytes and back (U1-U9).
//!
//! ```text
//! byte   0                 1        2 .. 9     10
//!        id | kind << 4    length   payload    end
//! ```
//!
//! Length counts header, payload and end. In version 1 it is always 11, and the end is CRC-8 over
//! the ten bytes before it. An original peer may send 4 to 11 bytes, and nobody checks its end byte
//! (U9). The decoder finds where a packet starts.

use core::fmt;

use crate::bytes::PAYLOAD_LENGTH;
use crate::crc::checksum;
use crate::handshake::Version;
use crate::payload::{Kind, Payload};

/// The length of a full packet (U8), and of every version-1 packet.
pub const PACKET_LENGTH: usize = 11;
/// The length of the shortest packet an original peer may send: one payload byte.
pub const MIN_LENGTH: usize = 4;
/// The end byte that the original writes and nobody checks (U9).
pub const END: u8 = 0xFF;

pub(crate) const HEADER_LENGTH: usize = 2;
const END_LENGTH: usize = 1;
pub(crate) const LENGTH_BYTE: u8 = 11;

/// A packet's number, counted modulo 16 per connection and direction (U4, AMB-10).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PacketId(u8);

impl PacketId {
    /// The number before the first: the "last received" number when a count starts.
    pub(crate) const BEFORE_FIRST: Self = Self(15);

    /// The low four bits of `number`.
    pub const fn new(number: u8) -> Self {
        Self(number & 0x0F)
    }

    /// The next number.
    #[must_use]
    pub const fn next(self) -> Self {
        Self::new(self.0 + 1)
    }

    /// The number, 0 to 15.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// How many packets were lost between `last` and this one, at least; 16 more may be unseen.
    pub const fn missing_since(self, last: Self) -> u8 {
        self.0.wrapping_sub(last.0).wrapping_sub(1) & 0x0F
    }
}

/// One packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Packet {
    /// The packet's number.
    pub id: PacketId,
    /// The content.
    pub payload: Payload,
}

/// Why bytes are not a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodeError {
    /// There are more or fewer bytes than the packet has.
    Size {
        /// How many bytes there are.
        have: usize,
        /// How many the packet has.
        need: usize,
    },
    /// The header states a length that no packet of this version has.
    Length {
        /// The length byte.
        found: u8,
    },
    /// The header states a kind that this version does not have.
    Kind {
        /// The kind's code.
        code: u8,
    },
    /// The check value does not fit.
    Crc {
        /// The check value of the bytes.
        computed: u8,
        /// The check value in the packet.
        found: u8,
    },
    /// A payload byte breaks a rule of its kind: its value is out of range, its complement is
    /// wrong, or it is unused and not 0.
    Payload {
        /// The packet's kind.
        kind: Kind,
        /// The index of the payload byte, from 0.
        index: u8,
        /// Its value.
        found: u8,
    },
}

impl fmt::Display for DecodeError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { have, need } => {
                write!(formatter, "the packet has {need} bytes, not {have}")
            }
            Self::Length { found } => {
                write!(formatter, "no packet of this version is {found} bytes long")
            }
            Self::Kind { code } => write!(formatter, "this version has no packet kind {code}"),
            Self::Crc { computed, found } => write!(
                formatter,
                "the packet is damaged: its check value is {found:#04x}, its bytes give {computed:#04x}"
            ),
            Self::Payload { kind, index, found } => write!(
                formatter,
                "payload byte {index} of a {kind:?} packet cannot be {found:#04x}"
            ),
        }
    }
}

impl core::error::Error for DecodeError {}

impl Packet {
    /// The packet's bytes, always at full length, as every original peer expects (AMB-6).
    ///
    /// The original has no kinds above 5, and refuses the bytes of such a packet.
    pub fn encode(&self, version: Version) -> [u8; PACKET_LENGTH] {
        let mut payload = [0; PAYLOAD_LENGTH];
        self.payload.write(version, &mut payload);
        let mut bytes = [0; PACKET_LENGTH];
        bytes[0] = self.id.get() | (self.payload.kind().code() << 4);
        bytes[1] = LENGTH_BYTE;
        bytes[HEADER_LENGTH..HEADER_LENGTH + PAYLOAD_LENGTH].copy_from_slice(&payload);
        bytes[PACKET_LENGTH - END_LENGTH] = match version {
            Version::Original => END,
            Version::One => checksum(&bytes[..PACKET_LENGTH - END_LENGTH]),
        };
        bytes
    }

    /// Decodes `bytes`, which must be one packet and no more.
    ///
    /// # Errors
    ///
    /// The bytes are not a packet of this version; the error says which rule they break.
    pub fn decode(bytes: &[u8], version: Version) -> Result<Self, DecodeError> {
        Self::decode_from::<true>(bytes, version)
    }

    /// The same for packets from boards and the Pi, or only from the Pi.
    pub(crate) fn decode_from<const BOARDS: bool>(
        bytes: &[u8],
        version: Version,
    ) -> Result<Self, DecodeError> {
        let have = bytes.len();
        if have < MIN_LENGTH {
            return Err(DecodeError::Size {
                have,
                need: MIN_LENGTH,
            });
        }
        let kind = kind_of(bytes[0], version).ok_or(DecodeError::Kind {
            code: bytes[0] >> 4,
        })?;
        let need = length_of(bytes[1], version).ok_or(DecodeError::Length { found: bytes[1] })?;
        if have != need {
            return Err(DecodeError::Size { have, need });
        }
        let (content, end) = bytes.split_at(need - END_LENGTH);
        if version == Version::One {
            let computed = checksum(content);
            if computed != end[0] {
                return Err(DecodeError::Crc {
                    computed,
                    found: end[0],
                });
            }
        }
        let given = &content[HEADER_LENGTH..];
        let mut payload = [0; PAYLOAD_LENGTH];
        payload[..given.len()].copy_from_slice(given);
        match Payload::read::<BOARDS>(kind, version, &payload, given.len()) {
            Ok(payload) => Ok(Self {
                id: PacketId::new(bytes[0]),
                payload,
            }),
            Err(fault) => Err(DecodeError::Payload {
                kind,
                index: fault.index,
                found: payload[usize::from(fault.index)],
            }),
        }
    }
}

/// The kind that a packet's first byte states.
pub(crate) const fn kind_of(first: u8, version: Version) -> Option<Kind> {
    match Kind::from_code(first >> 4) {
        Some(kind) if kind.exists_in(version) => Some(kind),
        _ => None,
    }
}

/// The length that a packet's second byte states, if a packet can have it.
pub(crate) fn length_of(second: u8, version: Version) -> Option<usize> {
    let length = usize::from(second);
    let allowed = match version {
        Version::Original => MIN_LENGTH..=PACKET_LENGTH,
        Version::One => PACKET_LENGTH..=PACKET_LENGTH,
    };
    allowed.contains(&length).then_some(length)
}
