//! ExDe, the synchronous one-way bit bus from the sensor board to the steering board (X1-X9).
//!
//! Three wires: data and sync from the sender, return sync from the receiver. Every bit lies on
//! data for one interval and sync goes high for a short time in its middle; the receiver samples on
//! that rise (X3).
//!
//! ```text
//!           bit 0     bit 1                 half    half
//! data  __________,----------,____       |<----->|<----->|
//! sync  _____|__________|_________       ^ data  ^ pulse ^ next bit's data
//! ```
//!
//! The bus itself knows neither packets nor a start or stop (X5). Here a word has a fixed number of
//! bits, most significant first (X8), and words are kept apart by silence: a gap resets the
//! receiver's bit count, so a lost pulse costs one word and never shifts the words after it
//! (AMB-16).
//!
//! The crate stands apart because both boards and their tests need the same timing. Both ends are
//! driven by interrupts, so they are small: they move no pins, read no clock, and only say how long
//! to wait.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod receiver;
mod timing;
mod transmitter;

pub use receiver::Receiver;
pub use timing::Timing;
pub use transmitter::{Action, Step, Transmitter};

/// Bits of a word: one for each line sensor, the first sent is the leftmost (AMB-17).
pub const WORD_BITS: u8 = 11;
