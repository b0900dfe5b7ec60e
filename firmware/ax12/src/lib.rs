//! Writes and reads packets of Dynamixel protocol 1.0, which the arm's AX-12 servos use at 1 Mbit/s
//! on one half-duplex wire.
//!
//! ```text
//! instruction:  FF FF | id | length | instruction | parameter 1..N | checksum
//! status:       FF FF | id | length | error bits  | parameter 1..N | checksum
//!
//! length   = N + 2
//! checksum = !(id + length + instruction|error + parameters), low eight bits
//! ```
//!
//! The codec is a crate of its own because both ends of the wire need it: the steering board asks,
//! and the plant's servo models answer. It touches no port, never waits, never allocates, and does
//! not decide anything about a servo.
//!
//! [`Frame`] writes a packet, [`Decoder`] reads one byte by byte. Both kinds of packet have the
//! same shape; only the direction on the wire tells them apart.

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

/// The two bytes at the beginning of every packet.
pub const HEADER: [u8; 2] = [0xFF, 0xFF];

/// All servos obey this id, and none answers (A5).
pub const BROADCAST_ID: u8 = 0xFE;

/// The highest id a single servo can have.
pub const MAX_ID: u8 = 0xFD;

/// Length of a status packet without parameters (A5, `DEFAULT_RETURN_PACKET_SIZE`).
pub const SHORT_STATUS_LENGTH: usize = 6;

/// Longest packet that this crate writes: a SYNC_WRITE of position, speed and torque limit to eight
/// servos.
pub const MAX_FRAME: usize = 64;

/// Bytes of a packet that are not parameters: header, id, length, instruction or error, checksum.
pub const OVERHEAD: usize = 6;

/// Checksum over the bytes between header and checksum (e-Manual, Protocol 1.0).
#[must_use]
pub fn checksum(body: &[u8]) -> u8 {
    !body.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}
