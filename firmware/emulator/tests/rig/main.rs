//! The two boards' real images, as chips, in chip time.
//!
//! They are read from `firmware/avr`'s release folder, or from the folder LAGER_IMAGES names; without
//! them these tests fail and say how to build them.

mod arm;
mod exde;
mod failsafe;
mod handshake;
mod noise;
mod replay;
mod settings;
mod support;
