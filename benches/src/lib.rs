//! The project's measurements, each beside its baseline in the same run.
//!
//! A [`Scenario`] is defined once, as groups of rows ([`Group`]). `lager bench` measures whole groups,
//! whose rows take turns, and prints a [`Report`] as a table or as JSON. Criterion times the rows that
//! have a limit, and the guard judges its estimates. [`steps`] has the steps of the path within one
//! process, for criterion and for counting instructions. [`chip`] counts cycles of the boards' images
//! instead; these are exact and have no baseline.
//!
//! An absolute time means little on a shared machine. So a row is measured close to its baseline, and
//! ratios are compared. Nothing here asserts a time; the guard does.
//!
//! **Invariant:** every wait of a measurement has a limit, and a measurement leaves nothing behind.

mod baseline;
pub mod chip;
pub mod compare;
pub mod error;
mod group;
mod hop;
mod load;
pub mod machine;
mod pair;
mod path;
mod plan;
mod publish;
pub mod report;
#[cfg(feature = "rivals")]
pub mod rivals;
pub mod rounds;
mod sample;
pub mod saved;
mod scenario;
pub mod slow;
pub mod stats;
pub mod steps;
pub mod times;
pub mod topic;
mod watch;

pub use error::BenchError;
pub use group::{Entry, Group, Opened, Session};
pub use lager_rig::{Domain, heed_interrupts, interrupted};
pub use path::{Explained, Wanted, explain, may_have_real_time};
pub use report::{Load, Mode, Options, Pace, Ratio, Regime, Report, Row};
pub use rounds::{Rate, Run, Taken};
pub use sample::SIZES;
pub use scenario::Scenario;
pub use stats::{Distribution, Quantiles, median};

/// The prefix of the folders of measurements.
pub const FAMILY: &str = "lager-bench";

/// If this process was started as a scenario's child, does the child's work and ends; otherwise
/// returns at once. Every program that measures calls it first in `main`.
pub fn run_if_asked() {
    lager_rig::process::run_if_asked(&[
        machine::PROCESSES,
        hop::PROCESSES,
        pair::observer::PROCESSES,
        publish::PROCESSES,
        watch::PROCESSES,
        path::PROCESSES,
        path::FLOOR_PROCESSES,
        load::PROCESSES,
    ]);
}

/// The number of runs given on a command line.
///
/// # Errors
/// A sentence that says which numbers are allowed.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err("give a whole number, 1 or more".to_owned()),
        Ok(number) => Ok(number),
    }
}
