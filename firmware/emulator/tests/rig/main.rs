//! The two boards' real images, as chips, in chip time.
//!
//! They are read from `firmware/avr/target/images`, or from the folder LAGER_IMAGES names, with
//! those for 9600 Bd in `9600` below it; without them these tests fail and say how to build them.

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
