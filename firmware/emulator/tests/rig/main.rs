//! Tests the two boards' real images as chips, in chip time.
//!
//! The images are in `firmware/avr/target/images` or in the folder LAGER_IMAGES, those for 9600 Bd
//! in `9600` below it. Without images these tests fail and say how to build them.

mod arm;
mod disturbance;
mod exde;
mod failsafe;
mod handshake;
mod replay;
mod replay_sensor;
mod replay_steering;
mod settings;
mod support;
