//! The project's measurements, each beside its baseline in the same run.
//!
//! A [`Scenario`] is defined once, as groups of rows that take turns ([`Group`]). `lager bench` and
//! the guard measure whole groups and get a [`Report`], which prints as a table and serialises as
//! JSON; criterion times single rows. [`steps`] are the parts of the path within one process, for
//! criterion and for counting instructions. [`chip`] counts cycles of the boards' images instead;
//! these are exact and have no baseline.
//!
//! Absolute times mean little on a shared machine. So candidates and baselines take turns within
//! one run, and a report states ratios of one run. Nothing here asserts a time; the guard does.
//!
//! **Invariant:** every wait of a measurement has a limit, and nothing is left behind when it ends.

mod baseline;
pub mod chip;
pub mod error;
mod group;
mod hop;
pub mod machine;
mod pair;
mod path;
mod publish;
pub mod report;
mod sample;
mod scenario;
pub mod slow;
pub mod stats;
pub mod steps;
pub mod times;

pub use error::BenchError;
pub use group::{Entry, Group, Opened, Session};
pub use lager_rig::{Domain, heed_interrupts, interrupted};
pub use path::may_have_real_time;
pub use report::{Mode, Options, Ratio, Regime, Report, Row};
pub use scenario::Scenario;
pub use stats::{Quantiles, median};

/// What the folders of measurements begin with.
pub const FAMILY: &str = "lager-bench";

/// If this process was started as one of a scenario's, is that and ends; otherwise returns at once.
/// To be called first thing in `main` of every executable that measures.
pub fn run_if_asked() {
    lager_rig::process::run_if_asked(&[
        machine::PROCESSES,
        hop::PROCESSES,
        publish::PROCESSES,
        path::PROCESSES,
        path::FLOOR_PROCESSES,
    ]);
}
