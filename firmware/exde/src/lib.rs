//! ExDe, the synchronous one-way bit bus from the sensor board to the steering board (X1-X9).
//!
//! Three wires: data and sync from the sender, return sync from the receiver. Data holds every bit
//! for one interval, and sync goes high for a short time in its middle; the receiver samples data
//! on that rise (X3).
//!
//! ```text
//!           bit 0     bit 1                 half    half
//! data  __________,----------,____       |<----->|<----->|
//! sync  _____|__________|_________       ^ data  ^ pulse ^ next bit's data
//! ```
//!
//! The bus itself has no packets and no start or stop (X5). Here a word has a fixed number of bits,
//! most significant first (X8), and silence separates words: it resets the receiver's bit count, so
//! a lost pulse costs one word and never shifts the words after it (AMB-16).
//!
//! It is a crate of its own because both boards and their tests need the same timing. Interrupts
//! drive both ends, so the code is small: it moves no pins and reads no clock, and only returns how
//! long to wait.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod receiver;
mod timing;
mod transmitter;

pub use receiver::Receiver;
pub use timing::Timing;
pub use transmitter::{Step, Transmitter, WireAction};

/// Bits of a word: one for each line sensor, the leftmost first (AMB-17).
pub const WORD_BITS: u8 = 11;
