//! The handshake: who speaks, by which version of the rules, and why it started (U11, U12, U14).
//!
//! ```text
//! payload byte 0   bits 0-1 synack, bits 2-7 callsign      the original's one byte (U12)
//! payload byte 1   version of the packet rules             version 1 only
//! payload byte 2   why the board started                   version 1 only
//! payload 3 to 7   0
//! ```
//!
//! It is apart because the link machines decide what a handshake means; here it is only bytes.

use crate::coded::coded;
use crate::payload::{Bytes, Fault, unused_from};

coded! {
    /// The rules a packet is built by.
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

coded! {
    /// Question or answer (U11; these are not the ASCII control codes).
    pub enum SynAck {
        /// A request to be answered.
        Syn = 0,
        /// The answer.
        Ack = 1,
    }
}

coded! {
    /// Why a board started.
    pub enum ResetCause {
        /// Not known, or the peer cannot say.
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
    }
}

/// A handshake packet's content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Handshake {
    /// Question or answer.
    pub kind: SynAck,
    /// The sender.
    pub sign: Callsign,
    /// The rules the packet was built by. Encoding writes the version it encodes for, whatever
    /// stands here, so that a packet never claims other rules than its own.
    pub version: Version,
    /// Why the sender started; always `Unknown` from an original board.
    pub reset: ResetCause,
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
        }
    }

    pub(crate) fn read(version: Version, payload: &Bytes) -> Result<Self, Fault> {
        let (Some(kind), Some(sign)) = (
            SynAck::from_code(payload[0] & 0b11),
            Callsign::from_code(payload[0] >> 2),
        ) else {
            return Err(Fault { index: 0 });
        };
        let reset = match version {
            Version::Original => ResetCause::Unknown,
            Version::One => {
                if sign == Callsign::Error {
                    return Err(Fault { index: 0 });
                }
                if payload[1] != version.code() {
                    return Err(Fault { index: 1 });
                }
                unused_from(3, payload)?;
                ResetCause::from_code(payload[2]).ok_or(Fault { index: 2 })?
            }
        };
        Ok(Self {
            kind,
            sign,
            version,
            reset,
        })
    }
}
