//! How this machine is, as far as it takes no time and stops nothing to find out: comm tells it to the
//! station, so the panel shows it. The findings are those of `lager doctor`.

use std::fs;

use lager_comm::Machine;
use lager_home::Clock;
use lager_lines::Name;
use lager_lines::extension::Finding;

use super::{OPEN_FILES, SHARED_MEMORY_MIB, free_shared_memory, most_open_files};
use crate::overload::Load;

/// How this machine is.
pub fn machine() -> Machine {
    let load = Load::now();
    Machine {
        load_percent: load.map(|load| load.percent()),
        cores: load.and_then(|load| u16::try_from(load.cores()).ok()),
        memory_mib: memory(&fs::read_to_string("/proc/meminfo").unwrap_or_default()),
        found: findings(load),
    }
}

/// All memory and what programs can still get, in MiB, from `/proc/meminfo`, which counts KiB.
fn memory(meminfo: &str) -> Option<[u32; 2]> {
    let size = |name: &str| {
        let mut lines = meminfo.lines();
        let rest = lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
        let kib: u64 = rest.trim().strip_suffix(" kB")?.parse().ok()?;
        u32::try_from(kib / 1024).ok()
    };
    Some([size("MemTotal")?, size("MemAvailable")?])
}

/// What is wrong, in codes of the table of sentences.
fn findings(load: Option<Load>) -> Vec<Finding> {
    let now_ns = Clock::monotonic_ns().saturating_add_signed(Clock::unix_offset_ns());
    let free = free_shared_memory().ok();
    let files = most_open_files();
    let load = load.filter(Load::is_too_much);
    let found = [
        (
            "shared_memory",
            free.filter(|free| *free < SHARED_MEMORY_MIB),
        ),
        ("open_files", (files < OPEN_FILES).then_some(files)),
        ("overload", load.map(|load| load.percent().into())),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_as_the_kernel_writes_it() {
        let meminfo =
            "MemTotal:        3884396 kB\nMemFree:  100 kB\nMemAvailable:    2150400 kB\n";
        assert_eq!(memory(meminfo), Some([3793, 2100]));
        assert_eq!(memory("MemTotal: 1 kB\n"), None);
    }
}
