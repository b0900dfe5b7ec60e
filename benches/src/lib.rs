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
mod fanout;
mod group;
mod hop;
pub mod machine;
mod names;
mod pair;
mod path;
mod processes;
pub mod report;
mod ring;
mod sample;
mod scenario;
pub mod slow;
mod stats;
pub mod steps;
pub mod times;
mod turns;

pub use error::BenchError;
pub use group::{Entry, Group, Opened, Session};
pub use lager_rig::{Domain, heed_interrupts, interrupted};
pub use names::UnknownName;
pub use path::may_have_real_time;
pub use processes::run_if_asked;
pub use report::{Mode, Options, Ratio, Regime, Report, Row};
pub use scenario::Scenario;
pub use stats::median;

/// What the folders of measurements begin with.
pub const FAMILY: &str = "lager-bench";
