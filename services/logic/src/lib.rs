//! The logic unit (L1-L10): a pure navigator in a thin shell on the bus.
//!
//! The [`Navigator`] takes events and time. It returns the one steering order that should be in
//! force, and the mission's events and thoughts. It stands apart from its shell ([`run`]), so that
//! tests can run whole missions in virtual time, with a restart at every moment.
//!
//! **Invariants**
//!
//! - The navigator never reads a clock, never allocates and never knows of the bus.
//! - A run can be proved. The shell publishes on `nav/inputs` what it told its navigator, when, and
//!   a proof of the answer, after the navigator's orders have left. `lager bag play --verify` repeats
//!   the run, so a navigator may depend on nothing but its inputs.
//! - The mission knows no line, and a manoeuvre knows no purpose. Only `manoeuvre/mod.rs` knows
//!   both and chooses. A manoeuvre ends in an outcome.
//! - A navigator without a state to resume is `Lost` until a reset or `lager place`. After a
//!   disturbed turn several headings are possible until a mark decides.
//! - An order without an open way waits, and a successor finds it on `mission/queue` or in
//!   `nav/status`. There is one piece of each product: the navigator refuses a second order for it
//!   until a person says that the goods are back.

#![forbid(unsafe_code)]

mod arm;
mod battery;
mod belief;
pub mod blocks;
mod by_hand;
mod command;
mod config;
mod ending;
mod entry;
mod goods;
mod holding;
pub mod judge;
mod latency;
mod manoeuvre;
pub mod map;
pub mod marks;
mod mission;
mod navigator;
pub mod odometer;
mod outgoing;
mod output;
pub mod queue;
mod replay;
pub mod route;
mod shell;
mod traced;
pub mod turn;

pub use config::LogicConfig;
pub use navigator::{Input, Navigator};
pub use outgoing::{KnownHealth, Outgoing, Part};
pub use output::Output;
pub use replay::{Replay, ReplayError, Replayed};
pub use shell::run;
