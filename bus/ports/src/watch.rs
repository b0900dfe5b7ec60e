//! Whether something has come to a bus or gone from it, by a look at the folder of its files.
//!
//! It is for whoever waits for topics or for their ends: [`crate::Bus::topics`] opens every
//! service, which takes a core for tens of milliseconds, and a look at a folder a hundredth of
//! that.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, DirEntry};
use std::io::{self, ErrorKind};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use crate::place::Place;

/// Where the transport describes its services, a file for each.
pub(crate) const SERVICES: &str = "services";
/// Where each process has a folder, with a tag for each of its ports.
pub(crate) const NODES: &str = "nodes";
/// How the name of a port's tag ends.
const PORT_TAG: &str = ".port_tag";

/// Tells whether the services or the ports of the bus at a place are others than before.
#[derive(Debug)]
pub struct BusWatch {
    look: fn(&Place) -> io::Result<Seen>,
    seen: Option<Seen>,
    told_once: bool,
}

/// What there was at a look.
#[derive(Debug, PartialEq, Eq)]
enum Seen {
    Services(BTreeSet<Version>),
    /// Their numbers. Whoever opens a service has a tag for it, too, for a moment, so the times of
    /// the folders tell nothing; and tags never change.
    Ports(BTreeSet<String>),
}

impl BusWatch {
    /// Watches the services.
    #[must_use]
    pub fn of_services() -> Self {
        Self::by(|place| services(place).map(Seen::Services))
    }

    /// Watches the ports of all processes. What a killed one had is there until it is swept.
    #[must_use]
    pub fn of_ports() -> Self {
        Self::by(|place| ports(place).map(Seen::Ports))
    }

    fn by(look: fn(&Place) -> io::Result<Seen>) -> Self {
        Self {
            look,
            seen: None,
            told_once: false,
        }
    }

    /// Whether one has come, was finished or has gone. At the first call, and where the folder
    /// cannot be read, yes. Each change is told by two calls, because a port has its tag a moment
    /// before it can be seen on its topic, and because two changes at once may have the same time.
    pub fn has_changed(&mut self, place: &Place) -> bool {
        let now = (self.look)(place).ok();
        let is_same = now.is_some() && now == self.seen;
        self.seen = now;
        let is_new = !is_same || self.told_once;
        self.told_once = !is_same;
        is_new
    }
}

/// More than the ticks in which a kernel counts when a file changed (10 ms at the most).
const TICK: Duration = Duration::from_millis(20);

/// A file as it was: its name, its number and when it last changed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Version {
    name: OsString,
    inode: u64,
    /// Since 1970.
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

    /// Whether it may have changed once more since, with the same time.
    pub(crate) fn is_of_this_moment(&self) -> bool {
        let now = UNIX_EPOCH.elapsed().unwrap_or_default();
        now.abs_diff(self.changed) < TICK
    }
}

/// The descriptions of all services.
fn services(place: &Place) -> io::Result<BTreeSet<Version>> {
    let files = entries(&place.transport_folder().join(SERVICES))?;
    files.map(|file| Version::of(&file?)).collect()
}

/// The numbers of all ports that have a tag.
pub(crate) fn ports(place: &Place) -> io::Result<BTreeSet<String>> {
    let mut ports = BTreeSet::new();
    for node in entries(&place.transport_folder().join(NODES))? {
        let node = node?;
        // Beside the folders there are files, three for each.
        if !node.file_type()?.is_dir() {
            continue;
        }
        for tag in entries(&node.path())? {
            let name = tag?.file_name();
            let name = name
                .to_str()
                .and_then(|name| name.strip_prefix(place.prefix()));
            let number = name.and_then(|name| name.strip_suffix(PORT_TAG));
            ports.extend(number.map(str::to_owned));
        }
    }
    Ok(ports)
}

/// What is in a folder; nothing if there is none, as the first one makes it.
fn entries(folder: &Path) -> io::Result<impl Iterator<Item = io::Result<DirEntry>> + use<>> {
    match fs::read_dir(folder) {
        Ok(entries) => Ok(Some(entries).into_iter().flatten()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None.into_iter().flatten()),
        Err(error) => Err(error),
    }
}
