//! Dynamixel protocol 1.0, as the AX-12 servos of the arm speak it at 1 Mbit/s on one half-duplex
//! wire.
//!
//! ```text
//! instruction:  FF FF | id | length | instruction | parameter 1..N | checksum
//! status:       FF FF | id | length | error bits  | parameter 1..N | checksum
//!
//! length   = N + 2
//! checksum = !(id + length + instruction|error + parameters), low eight bits
//! ```
//!
//! The codec stands apart from the arm's control because both ends of the wire need it: the
//! steering board asks, the servo models of the plant answer. It never touches a port, never waits,
//! never allocates and never decides what a servo should do.
//!
//! A packet is written with [`Frame`] and read back, byte by byte, with [`Decoder`]. The two packet
//! kinds share one shape, so only the reader's place on the wire says which of them a packet is.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod decoder;
mod error_bits;
mod frame;
mod instruction;
pub mod table;

pub use decoder::{Counters, Decoder, InstructionDecoder, Packet, StatusDecoder};
pub use error_bits::ErrorBits;
pub use frame::{EncodeError, Frame};
pub use instruction::Instruction;

/// The two bytes every packet begins with.
pub const HEADER: [u8; 2] = [0xFF, 0xFF];

/// The id all servos obey and none answers (A5).
pub const BROADCAST_ID: u8 = 0xFE;

/// The highest id a single servo can have.
pub const MAX_ID: u8 = 0xFD;

/// Length of a status packet without parameters (A5, `DEFAULT_RETURN_PACKET_SIZE`).
pub const SHORT_STATUS_LENGTH: usize = 6;

/// Longest packet this crate writes: a SYNC_WRITE of position, speed and torque limit to eight
/// servos.
pub const MAX_FRAME: usize = 64;

/// Bytes of a packet that are not parameters: header, id, length, instruction or error, checksum.
pub const OVERHEAD: usize = 6;

/// Checksum over the bytes between header and checksum (e-Manual, Protocol 1.0).
#[must_use]
pub fn checksum(body: &[u8]) -> u8 {
    !body.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}
