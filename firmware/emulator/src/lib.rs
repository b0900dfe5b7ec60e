//! Emulates the robot's two boards: the real images run in simavr, wired to each other and a world.
//!
//! ```text
//!   main --> shell: ptys, pace, clock page, truth lines
//!               |
//!              Rig: two chips in lock-step, ExDe, the Pi's lines, lager_plant::World
//!               |
//!             Chip: simavr with its departures from the ATmega1284P put right
//! ```
//! Everything but the shell works in chip time only: the same images, seed and bytes give the same
//! run. Only [`pi`] knows packets; it plays the Raspberry Pi for tests and measurements. Nothing
//! here knows a topic. GPL-3 applies to this executable alone.

pub mod chip;
pub mod clock;
pub mod measure;
pub mod pi;
pub mod rig;
pub mod shell;
