//! The pins of both boards and of the Pi: what each one is connected with, and which way it works.
//!
//! ```text
//!   sensor, steering, pi   the tables
//!     ├──> firmware/avr        sets the ports up, and moves the pins (O7)
//!     ├──> firmware/emulator   connects the emulated chips with each other and with the world
//!     └──> page                firmware/WIRING.md and firmware/wiring.svg, for people
//! ```
//!
//! It is a crate of its own so that these three cannot differ: nobody else spells a pin. A robot that
//! is wired in another way changes a table here, and builds its images and the page again.

#![cfg_attr(not(any(test, feature = "page")), no_std)]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod both;
mod pin;

#[cfg(feature = "page")]
pub mod page;
pub mod pi;
pub mod sensor;
pub mod steering;

pub use pin::{Connection, Connector, Device, Pin, Port, Start, Way};
