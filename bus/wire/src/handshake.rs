//! [`Handshake`]: who speaks, by which version of the rules, and why it started (U11, U12, U14).
//!
//! ```text
//! payload byte 0   bits 0-1 synack, bits 2-7 callsign      the original's one byte (U12)
//! payload byte 1   version of the packet rules             version 1 only
//! payload byte 2   why the board started                   version 1 only
//! payload byte 3   1: the link has been up since start     version 1 only
//! payload 4, 5     build number of a board, low byte first version 1 only
//! payload 6, 7     0
//! ```
//!
//! This file only reads and writes bytes. The link machines decide what a handshake means.

use core::fmt;

use crate::bytes::{Bytes, Fault, unused_from};
use crate::coded::coded;

/// The number of the boards' images that fit this source. It counts up with every change of an
/// image that goes to robots. With some numbers (1, 3, 6, 18, 21) a handshake can look like one of an
/// original board; the tests find these, and then the next number is taken.
pub const BUILD: u16 = 7;

coded! {
    /// The rules by which a packet is built.
    pub enum Version {
        /// The original boards: no check value, the end byte means nothing.
        Original = 0,
        /// Both ends are of this project: always 11 bytes, CRC-8 in the end byte.
        One = 1,
    }
}

coded! {
    /// Who sends a handshake (U11).
    pub enum Callsign {
        /// Nobody; the original's mark of a failed handshake.
        Error = 0,
        /// The Raspberry Pi.
        Raspi = 1,
        /// The sensor board.
        Sensor = 2,
        /// The steering board.
        Steering = 3,
    }
}

#[cfg(feature = "lager-sample")]
lager_sample::coded_as_is!(Callsign {
    Error,
    Raspi,
    Sensor,
    Steering
});

/// Its name in sentences and in the names of files.
impl fmt::Display for Callsign {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Error => "unknown",
            Self::Raspi => "Raspberry Pi",
            Self::Sensor => "sensor",
            Self::Steering => "steering",
        })
    }
}

coded! {
    /// Question or answer (U11; these are not the ASCII control codes).
    pub enum SynAck {
        /// A request for an answer.
        Syn = 0,
        /// The answer.
        Ack = 1,
    }
}

coded! {
    /// Why a board started.
    pub enum ResetCause {
        /// Not known, or the other end cannot say.
        Unknown = 0,
        /// Power was switched on.
        PowerOn = 1,
        /// The reset button or pin.
        External = 2,
        /// The supply voltage fell too low.
        BrownOut = 3,
        /// The watchdog.
        Watchdog = 4,
        /// The firmware met a state it does not allow.
        Panic = 5,
        /// A debugger.
        Jtag = 6,
        /// The Pi told it to.
        Ordered = 7,
    }
}

#[cfg(feature = "lager-sample")]
lager_sample::coded_as_is!(ResetCause {
    Unknown,
    PowerOn,
    External,
    BrownOut,
    Watchdog,
    Panic,
    Jtag,
    Ordered,
});

/// The content of a handshake packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Handshake {
    /// Question or answer.
    pub kind: SynAck,
    /// The sender.
    pub sign: Callsign,
    /// The rules by which the packet was built. Encoding ignores this value and writes the version
    /// that it encodes for, so that a packet never claims other rules than its own.
    pub version: Version,
    /// Why the sender started; always `Unknown` from an original board.
    pub reset: ResetCause,
    /// Whether the link has been up since the sender started. If a board asks again and this is
    /// false, the board has restarted, however long it was silent before. Always `false` from the
    /// Pi and from an original board.
    pub was_up: bool,
    /// The build number of the board's image, see [`BUILD`]. 0 from the Pi, from an original board
    /// and from images that had no number yet.
    pub build: u16,
}

impl Handshake {
    /// The original's one byte: synack in bits 0-1, callsign in bits 2-7 (U12).
    pub const fn byte(self) -> u8 {
        self.kind.code() | (self.sign.code() << 2)
    }

    pub(crate) fn write(self, version: Version, payload: &mut Bytes) {
        payload[0] = self.byte();
        if version == Version::One {
            payload[1] = version.code();
            payload[2] = self.reset.code();
            payload[3] = self.was_up.into();
            [payload[4], payload[5]] = self.build.to_le_bytes();
        }
    }

    pub(crate) fn read(version: Version, payload: &Bytes) -> Result<Self, Fault> {
        let (Some(kind), Some(sign)) = (
            SynAck::from_code(payload[0] & 0b11),
            Callsign::from_code(payload[0] >> 2),
        ) else {
            return Err(Fault { index: 0 });
        };
        let (reset, was_up, build) = match version {
            Version::Original => (ResetCause::Unknown, false, 0),
            Version::One => {
                if sign == Callsign::Error {
                    return Err(Fault { index: 0 });
                }
                if payload[1] != version.code() {
                    return Err(Fault { index: 1 });
                }
                let reset = ResetCause::from_code(payload[2]).ok_or(Fault { index: 2 })?;
                let was_up = match payload[3] {
                    0 => false,
                    1 => true,
                    _ => return Err(Fault { index: 3 }),
                };
                unused_from(6, payload)?;
                let build = u16::from_le_bytes([payload[4], payload[5]]);
                (reset, was_up, build)
            }
        };
        Ok(Self {
            kind,
            sign,
            version,
            reset,
            was_up,
            build,
        })
    }
}
