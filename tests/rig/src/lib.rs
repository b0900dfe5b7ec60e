//! Helpers for tests and benches: a bus of their own, this program started again as another
//! process, memory that processes share, boards and their Pi behind pseudo terminals, and an
//! allocator that counts.
//!
//! They are a crate of their own, so that each exists once. Nothing here measures or asserts.

pub mod allocations;
mod board;
pub mod boards;
mod cable;
mod described;
mod domain;
mod held_up;
mod host;
mod interrupts;
mod map;
mod outset;
pub mod proc;
pub mod process;
pub mod schedule;
mod shared;

pub use board::{Board, GAP_US, SPEAK_EVERY_NS, wheels_in_the_air};
pub use cable::{Cable, timespec};
pub use described::behind_ports;
pub use domain::{Domain, NoPlace, bus_at};
pub use held_up::Watch;
pub use host::Host;
pub use interrupts::{heed_interrupts, interrupted};
pub use map::one_square;
pub use outset::Outset;
pub use process::{Parent, Process, ProcessError};
pub use shared::{Barrier, Counter, Shareable, Shared, inherit};

/// The kernel refused something that a test or a measurement needs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{what} could not be made ({detail}); check the limit of open files (ulimit -n) and free memory"
)]
pub struct Refused {
    /// The thing that could not be made.
    pub what: &'static str,
    /// The kernel's reason.
    pub detail: String,
}

impl Refused {
    /// Makes this error out of the kernel's, for `map_err`; `what` could not be made.
    pub fn to_make<E: core::fmt::Display>(what: &'static str) -> impl FnOnce(E) -> Self {
        move |error| Self {
            what,
            detail: error.to_string(),
        }
    }
}
