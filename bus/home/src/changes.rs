//! [`BusWatch`]: notices that something on a bus has appeared or gone, from the bus's folder alone.
//!
//! Programs use it that wait for topics, readers or writers. `lager_ports::Bus::topics` would open
//! every service, which takes a core for tens of milliseconds; reading the folder takes a hundredth
//! of that.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, DirEntry};
use std::io::{self, ErrorKind};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use crate::home::Home;

/// The folder in which the transport describes its services, one file for each.
pub(crate) const SERVICES: &str = "services";
/// The folder in which each process has a folder, with a tag for each of its ports.
pub(crate) const NODES: &str = "nodes";
/// The ending of the name of a port's tag.
const PORT_TAG: &str = ".port_tag";

/// Says whether the services or the ports of a bus have changed since the last look.
#[derive(Debug)]
pub struct BusWatch {
    look: fn(&Home) -> io::Result<Seen>,
    seen: Option<Seen>,
    told_once: bool,
}

/// What a look found.
#[derive(Debug, PartialEq, Eq)]
enum Seen {
    Services(BTreeSet<Version>),
    /// The ports' numbers. Opening a service also makes a tag for a moment, so the folders' times
    /// say nothing.
    Ports(BTreeSet<String>),
}

impl BusWatch {
    /// Watches the services.
    #[must_use]
    pub fn of_services() -> Self {
        Self::by(|home| services(home).map(Seen::Services))
    }

    /// Watches the ports of all processes. A killed process's ports stay until a sweep removes
    /// them.
    #[must_use]
    pub fn of_ports() -> Self {
        Self::by(|home| ports(home).map(Seen::Ports))
    }

    fn by(look: fn(&Home) -> io::Result<Seen>) -> Self {
        Self {
            look,
            seen: None,
            told_once: false,
        }
    }

    /// Whether one has appeared, was finished or has gone. Also true at the first call, and if the
    /// folder cannot be read. Two calls report each change, because a port has its tag a moment
    /// before it can be seen on its topic, and because two changes at once may have the same time.
    pub fn has_changed(&mut self, home: &Home) -> bool {
        let now = (self.look)(home).ok();
        let is_same = now.is_some() && now == self.seen;
        self.seen = now;
        let is_new = !is_same || self.told_once;
        self.told_once = !is_same;
        is_new
    }
}

/// Longer than the steps in which a kernel notes when a file changed (10 ms at most).
const TICK: Duration = Duration::from_millis(20);

/// A file at one look: its name, its number and when it last changed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Version {
    name: OsString,
    inode: u64,
    /// Since 1970-01-01.
    changed: Duration,
}

impl Version {
    pub(crate) fn of(entry: &DirEntry) -> io::Result<Self> {
        let data = entry.metadata()?;
        Ok(Self {
            name: entry.file_name(),
            inode: data.ino(),
            changed: Duration::new(
                data.ctime().try_into().unwrap_or_default(),
                data.ctime_nsec().try_into().unwrap_or_default(),
            ),
        })
    }

    /// Whether the file may have changed again and still have the same time.
    pub(crate) fn is_of_this_moment(&self) -> bool {
        let now = UNIX_EPOCH.elapsed().unwrap_or_default();
        now.abs_diff(self.changed) < TICK
    }
}

/// The descriptions of all services.
fn services(home: &Home) -> io::Result<BTreeSet<Version>> {
    let files = entries(&home.transport_folder().join(SERVICES))?;
    files.map(|file| Version::of(&file?)).collect()
}

/// The numbers of all ports that have a tag.
pub(crate) fn ports(home: &Home) -> io::Result<BTreeSet<String>> {
    let mut ports = BTreeSet::new();
    for node in entries(&home.transport_folder().join(NODES))? {
        let node = node?;
        // Beside each folder there are three files.
        if !node.file_type()?.is_dir() {
            continue;
        }
        for tag in entries(&node.path())? {
            let name = tag?.file_name();
            let name = name
                .to_str()
                .and_then(|name| name.strip_prefix(home.prefix()));
            let number = name.and_then(|name| name.strip_suffix(PORT_TAG));
            ports.extend(number.map(str::to_owned));
        }
    }
    Ok(ports)
}

/// The entries of a folder; none if it does not exist, because the first process makes it.
fn entries(folder: &Path) -> io::Result<impl Iterator<Item = io::Result<DirEntry>> + use<>> {
    match fs::read_dir(folder) {
        Ok(entries) => Ok(Some(entries).into_iter().flatten()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None.into_iter().flatten()),
        Err(error) => Err(error),
    }
}
