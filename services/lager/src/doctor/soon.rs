//! The checks of `lager doctor` that take no time and stop nothing: comm tells their findings to the
//! station, so the panel shows them.

use lager_home::Clock;
use lager_lines::Name;
use lager_lines::extension::Finding;

use super::{OPEN_FILES, SHARED_MEMORY_MIB, free_shared_memory, most_open_files};
use crate::overload::Load;

/// What is wrong with this machine, in codes of the table of sentences.
pub fn findings() -> Vec<Finding> {
    let now_ns = Clock::monotonic_ns().saturating_add_signed(Clock::unix_offset_ns());
    let free = free_shared_memory().unwrap_or(0);
    let files = most_open_files();
    let load = Load::now().filter(Load::is_too_much);
    let found = [
        ("shared_memory", (free < SHARED_MEMORY_MIB).then_some(free)),
        ("open_files", (files < OPEN_FILES).then_some(files)),
        ("overload", load.map(|load| load.percent().round() as u64)),
        ("calendar", lager_recorder::doubt(now_ns).map(|_| 0)),
    ];
    let finding = |(code, seen): (&str, Option<u64>)| {
        Some(Finding {
            code: Name::new(code).ok()?,
            seen: u32::try_from(seen?).unwrap_or(u32::MAX),
        })
    };
    found.into_iter().filter_map(finding).collect()
}
