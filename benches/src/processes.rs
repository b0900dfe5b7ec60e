//! Which parts there are: the scenarios' tables, for whoever starts as one of their processes.
//!
//! Apart from the parts, so that a scenario can start one without knowing the others.

use crate::parts::{self, Play};
use crate::{fanout, hop, machine, path, ring};

/// Every part of every scenario.
const TABLES: &[&[(&str, Play)]] = &[
    machine::PARTS,
    hop::PARTS,
    ring::PARTS,
    path::PARTS,
    path::FLOOR_PARTS,
    fanout::PARTS,
];

/// If this process was started to play a part, plays it and ends the process; otherwise returns
/// at once. To be called first thing in `main` of every executable that measures.
pub fn play_if_asked() {
    parts::play_one_of(TABLES);
}
