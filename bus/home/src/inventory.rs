//! [`Inventory`]: whether new processes can still find the shared files that running processes use.
//!
//! If somebody removes a file, the processes that have it mapped keep it. They go on and nothing
//! fails, but no new process can find them, or take over from one that ends. So a supervisor checks
//! once a second what the processes of a unit have mapped (`/proc/PID/maps`) and the files that
//! describe it. It reads only descriptions that are new or have changed, and waits for nothing.
//!
//! | file | counts as missing when |
//! |---|---|
//! | a service's list of ports (`.dynamic`), a board of bells, a clock | it is mapped and removed |
//! | the samples of a port (`.data`) | the same, while the port has its tag |
//! | the description of a service (`.service`) | the list of ports is mapped, but undescribed |
//!
//! A new process that finds no description makes another one, with another number. Ports come and
//! go at any moment, so a file counts as missing only when two looks in a row find it missing.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use crate::changes;
use crate::descriptions::{Descriptions, LIST, parts};
use crate::home::Home;

/// The kernel's mark on a mapping whose file was removed.
const REMOVED: &str = " (deleted)";

/// What the last look found missing, and the descriptions that it has read.
#[derive(Debug, Default)]
pub struct Inventory {
    missed: BTreeSet<PathBuf>,
    descriptions: Descriptions,
}

impl Inventory {
    /// Looks at the bus's files that `processes` have mapped. Returns a file that is missing, or
    /// whose description is missing, if the look before found the same.
    pub fn look(&mut self, home: &Home, processes: &[u32]) -> Option<PathBuf> {
        self.descriptions.look(home);
        let ports: BTreeSet<String> = changes::ports(home).unwrap_or_default();
        let mapped = processes.iter().flat_map(|pid| mapped(*pid));
        let missed = mapped
            .filter(|file| is_missed(file, home, &ports, &self.descriptions))
            .map(|file| file.path)
            .collect();
        let before = core::mem::replace(&mut self.missed, missed);
        self.missed.intersection(&before).next().cloned()
    }
}

/// A file that a process has mapped.
struct Mapped {
    path: PathBuf,
    removed: bool,
}

fn mapped(process: u32) -> Vec<Mapped> {
    let maps = fs::read_to_string(format!("/proc/{process}/maps")).unwrap_or_default();
    maps.lines()
        .filter_map(|line| {
            let path = &line[line.find('/')?..];
            let (path, removed) = match path.strip_suffix(REMOVED) {
                Some(path) => (path, true),
                None => (path, false),
            };
            Some(Mapped {
                path: PathBuf::from(path),
                removed,
            })
        })
        .collect()
}

fn is_missed(
    file: &Mapped,
    home: &Home,
    ports: &BTreeSet<String>,
    descriptions: &Descriptions,
) -> bool {
    let Mapped { path, removed } = file;
    if path.starts_with(home.folder()) {
        return *removed && (path.ends_with("bells") || path.ends_with("clock"));
    }
    match parts(path, home.prefix()) {
        Some((_, LIST)) => *removed || descriptions.misses(path, home),
        Some((number, "data")) => *removed && ports.contains(number),
        _ => false,
    }
}
