//! The robot's two boards as chips: the real images in simavr, wired to each other and the world.
//!
//! ```text
//!   main --> shell: ptys, pace, clock page, truth lines
//!               |
//!              Rig: two chips in lock-step, ExDe, the Pi's lines, lager_plant::World
//!               |
//!             Chip: simavr with its departures from the ATmega1284P put right
//! ```
//! Everything but the shell is pure in chip time: the same images, seed and bytes give the same
//! run. It knows packets only in [`pi`], which plays the Raspberry Pi for tests and
//! measurements, and never a topic: GPL-3 stays in this executable.

pub mod chip;
pub mod clock;
mod eeprom;
pub mod measure;
pub mod pi;
pub mod rig;
pub mod shell;
pub mod truth;

pub use eeprom::EepromError;
