//! Whether new processes can still find the shared files that running processes use.
//!
//! A file that is removed stays with every process that has it mapped. The robot drives on and
//! nothing fails, but no new process can see it, stop it with a tool, or take over from a service
//! that ends. So once a second the attendant looks at what the robot's processes have mapped
//! (`/proc/PID/maps`) and at the files that describe it. It opens nothing of the bus but
//! descriptions that are new or have changed, and waits for nothing.
//!
//! | file | is missed when |
//! |---|---|
//! | a service's list of ends (`.dynamic`), a board of bells, a clock | it is mapped and removed |
//! | the samples of a port (`.data`) | likewise, while the port has its tag |
//! | what a service is (`.service`) | its list of ends is mapped, but has no description |
//!
//! A new process that finds no description makes another one, with another number. Ports come and
//! go at any moment, so a file counts as missing only when two looks in a row miss it.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use crate::bus::Bus;
use crate::descriptions::{Descriptions, LIST, parts};
use crate::place::Place;
use crate::watch;

/// How the kernel marks a mapping whose file was removed.
const REMOVED: &str = " (deleted)";

/// What the last look missed.
#[derive(Debug, Default)]
pub struct Inventory {
    missed: BTreeSet<PathBuf>,
}

impl Inventory {
    /// Looks at what `processes` have mapped of `bus`. Returns a file that is missing, or whose
    /// description is, if the look before missed it too. A process that has ended has nothing
    /// mapped.
    pub fn look(&mut self, bus: &Bus, processes: &[u32]) -> Option<PathBuf> {
        let place = bus.place();
        let mut descriptions = bus.descriptions();
        descriptions.look(place);
        let ports: BTreeSet<String> = watch::ports(place).unwrap_or_default();
        let mapped = processes.iter().flat_map(|pid| mapped(*pid));
        let missed = mapped
            .filter(|file| is_missed(file, place, &ports, &descriptions))
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
    place: &Place,
    ports: &BTreeSet<String>,
    descriptions: &Descriptions,
) -> bool {
    let Mapped { path, removed } = file;
    if path.starts_with(place.folder()) {
        // The bridge watches the stop word itself.
        return *removed && (path.ends_with("bells") || path.ends_with("clock"));
    }
    match parts(path, place.prefix()) {
        Some((_, LIST)) => *removed || descriptions.misses(path, place),
        Some((number, "data")) => *removed && ports.contains(number),
        _ => false,
    }
}
