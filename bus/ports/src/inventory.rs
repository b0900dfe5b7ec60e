//! Whether new processes can still find the shared files that running processes use.
//!
//! A file that is removed stays with every process that has it mapped. The robot drives on and
//! nothing fails, but no new process can see it, stop it with a tool, or take over from a service
//! that ends. So once a second the attendant looks at what the robot's processes have mapped
//! (`/proc/PID/maps`) and at the files that describe it. It opens nothing of the bus but descriptions
//! that are new or have changed, and waits for nothing.
//!
//! | file | is missed when |
//! |---|---|
//! | a service's list of ends (`.dynamic`), a board of bells, a clock | it is mapped and removed |
//! | the samples of a port (`.data`) | likewise, while the port has its tag |
//! | what a service is (`.service`) | its list of ends is mapped, but has no description |
//!
//! A new process that finds no description makes another one, with another number. Ports come and
//! go at any moment, so a file counts as missing only when two looks in a row miss it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, DirEntry};
use std::path::{Path, PathBuf};

use crate::place::Place;
use crate::shortage::SHARED_MEMORY;
use crate::watch::{NODES, PORT_TAG, SERVICES, Version};

/// The ending of a service's list of ends.
const LIST: &str = "dynamic";

/// How the kernel marks a mapping whose file was removed.
const REMOVED: &str = " (deleted)";

/// What the last look missed.
#[derive(Debug, Default)]
pub struct Inventory {
    described: Described,
    missed: BTreeSet<PathBuf>,
}

impl Inventory {
    /// Looks at what `processes` have mapped of the bus at `place`. Returns a file that is missing,
    /// or whose description is, if the look before missed it too. A process that has ended has
    /// nothing mapped.
    pub fn look(&mut self, place: &Place, processes: &[u32]) -> Option<PathBuf> {
        self.described.look(place);
        let ports = ports(place);
        let mapped = processes.iter().flat_map(|pid| mapped(*pid));
        let missed = mapped
            .filter(|file| is_missed(file, place, &ports, &self.described))
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
    described: &Described,
) -> bool {
    let Mapped { path, removed } = file;
    if path.starts_with(place.folder()) {
        // The bridge watches the stop word itself.
        return *removed && (path.ends_with("bells") || path.ends_with("clock"));
    }
    match parts(path, place.prefix()) {
        Some((_, LIST)) => *removed || described.misses(path),
        Some((number, "data")) => *removed && ports.contains(number),
        _ => false,
    }
}

/// The number of a service or port, and the ending, in the name of a segment.
fn parts<'a>(path: &'a Path, prefix: &str) -> Option<(&'a str, &'a str)> {
    let name = path.strip_prefix(SHARED_MEMORY).ok()?.to_str()?;
    let (stem, end) = name.strip_prefix(prefix)?.rsplit_once('.')?;
    Some((stem.rsplit('_').next().unwrap_or_default(), end))
}

/// The numbers of the ports that processes have.
fn ports(place: &Place) -> BTreeSet<String> {
    let nodes = entries(&place.transport_folder().join(NODES));
    nodes
        .flat_map(|node| entries(&node.path()))
        .filter_map(|file| {
            let name = file.file_name();
            let name = name.to_str()?.strip_prefix(place.prefix())?;
            Some(name.strip_suffix(PORT_TAG)?.to_owned())
        })
        .collect()
}

/// The services that have a description.
#[derive(Debug, Default)]
pub(crate) struct Described {
    prefix: String,
    numbers: BTreeSet<u128>,
    /// The files that need not be read again, each with the number in it.
    read: BTreeMap<Version, Option<u128>>,
}

impl Described {
    pub(crate) fn at(place: &Place) -> Self {
        let mut described = Self::default();
        described.look(place);
        described
    }

    /// Reads what has changed since the last look.
    fn look(&mut self, place: &Place) {
        place.prefix().clone_into(&mut self.prefix);
        self.numbers.clear();
        let mut before = core::mem::take(&mut self.read);
        for file in entries(&place.transport_folder().join(SERVICES)) {
            let Ok(version) = Version::of(&file) else {
                continue;
            };
            let is_settled = !version.is_of_this_moment();
            let read = || number_in(&fs::read_to_string(file.path()).ok()?);
            let number = before.remove(&version).unwrap_or_else(read);
            self.numbers.extend(number);
            if is_settled {
                self.read.insert(version, number);
            }
        }
    }

    /// Whether a segment is the list of ends of a service without a description.
    pub(crate) fn misses(&self, segment: &Path) -> bool {
        let has = |number: u128| self.numbers.contains(&number);
        match parts(segment, &self.prefix) {
            Some((number, LIST)) => !number.parse().is_ok_and(has),
            _ => false,
        }
    }
}

/// The number of the service that a description belongs to; the name of the service's list of ends
/// contains it.
fn number_in(description: &str) -> Option<u128> {
    let value = |key: &str| {
        let mut lines = description.lines();
        let value = lines.find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "))?;
        value.parse::<u64>().ok().map(u128::from)
    };
    Some(value("unique_value")? << 64 | value("payload_value")?)
}

fn entries(folder: &Path) -> impl Iterator<Item = DirEntry> + use<> {
    fs::read_dir(folder).into_iter().flatten().flatten()
}
