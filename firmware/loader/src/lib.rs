//! The boards' bootloader: what its program on the chip and the Pi have to agree on.
//!
//! ```text
//!   header   what an image says of itself      \
//!   stk      the bytes on the line              > chip (firmware/avr/src/loader) and Pi
//!   entry    how a board gets into its loader  |
//!   fuses    what a programmer sets once       /
//!
//!   image    an image for a board, from a hex file         \
//!   line     what a serial line has to do                   > Pi (feature `host`)
//!   client   the commands, one by one                      |
//!   update   a board gets a new image and tells its number |
//!   board    which board is at a line, and its restart     /
//! ```
#![cfg_attr(not(any(test, feature = "host")), no_std)]
#![forbid(unsafe_code)]

pub mod entry;
pub mod fuses;
mod header;
pub mod stk;

#[cfg(feature = "host")]
mod board;
#[cfg(feature = "host")]
mod client;
#[cfg(feature = "host")]
mod error;
#[cfg(feature = "host")]
mod image;
#[cfg(feature = "host")]
mod line;
#[cfg(feature = "host")]
mod update;

pub use header::{BOOT_SECTION, CRC_TABLE, Header, PAGE, crc_step};

#[cfg(feature = "host")]
pub use board::{Found, Runs, ask, find, listen, restart};
#[cfg(feature = "host")]
pub use client::{Client, LoaderError};
#[cfg(feature = "host")]
pub use error::UpdateError;
#[cfg(feature = "host")]
pub use image::{Image, ImageError};
#[cfg(feature = "host")]
pub use line::Line;
#[cfg(feature = "host")]
pub use update::{enter, update, write};
