//! The logic unit (L1-L10): a pure navigator in a thin shell on the bus.
//!
//! The [`Navigator`] takes events and time. It returns the one steering order that should be in
//! force, and the mission's events and thoughts. It is apart from its shell ([`run`]), so that
//! tests run whole missions in virtual time, with a restart at every moment.
//!
//! **Invariant:** the navigator never reads a clock, never allocates and never knows of the bus;
//! the shell never decides.

#![forbid(unsafe_code)]

mod arm;
mod battery;
pub mod blocks;
mod by_hand;
mod command;
mod config;
mod goods;
pub mod heading;
mod holding;
pub mod judge;
mod latency;
mod manoeuvre;
pub mod map;
pub mod marks;
mod mission;
mod navigator;
pub mod node;
pub mod odometer;
mod outcome;
mod output;
mod place;
pub mod queue;
mod replay;
pub mod route;
mod shell;
mod told;
mod traced;
pub mod turn;

pub use config::LogicConfig;
pub use navigator::{Input, Navigator};
pub use output::Output;
pub use replay::{Answer, Replay, ReplayError};
pub use shell::run;
