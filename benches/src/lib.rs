//! The project's measurements, each beside its baseline in the same run.
//!
//! A scenario (`hop`, `path`, `fanout`) starts the processes it needs, measures every candidate and
//! every baseline in turn, and returns a [`Report`], which prints as a table and serialises as
//! JSON. [`chip`] counts cycles of the boards' images instead; these are exact and have no
//! baseline. The criterion targets beside this library and `lager bench` both run this code.
//!
//! Absolute times mean little on a shared machine. So candidates and baselines take turns within
//! one run, and a report states ratios of one run. Nothing here asserts a time; the guard does.
//!
//! **Invariant:** every wait of a measurement has a limit, and nothing is left behind when it ends.

mod ball;
mod baseline;
pub mod cast;
pub mod chip;
mod domain;
pub mod error;
pub mod fanout;
pub mod hop;
pub mod machine;
mod parts;
pub mod path;
pub mod report;
mod ring;
mod run;
mod scenarios;
mod schedule;
mod shared;
pub mod slow;
mod stats;
pub mod times;

pub use domain::Domain;
pub use error::BenchError;
pub use parts::{heed_interrupts, interrupted};
pub use report::{Mode, Options, Ratio, Regime, Report, Row};
pub use scenarios::{a_second_of_bytes, a_second_of_packets};
pub use stats::median;
