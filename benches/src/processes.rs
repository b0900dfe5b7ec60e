//! The scenarios' tables of processes, for whoever starts as one of them.
//!
//! Apart from the scenarios, so that each can start its own without knowing the others.

use lager_rig::process::{self, Main};

use crate::{fanout, hop, machine, path, ring};

const TABLES: &[&[(&str, Main)]] = &[
    machine::PROCESSES,
    hop::PROCESSES,
    ring::PROCESSES,
    path::PROCESSES,
    path::FLOOR_PROCESSES,
    fanout::PROCESSES,
];

/// If this process was started as one of a scenario's, is that and ends; otherwise returns at once.
/// To be called first thing in `main` of every executable that measures.
pub fn run_if_asked() {
    process::run_if_asked(TABLES);
}
