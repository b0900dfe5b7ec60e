//! [`Descriptions`]: which services have a description. Reads only those that have changed.
//!
//! The name of a service's list of ports contains a number, which also stands in its description.
//! If no description has the number of a list, nobody can open that service any more.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::changes::{SERVICES, Version};
use crate::home::Home;
use crate::shortage::SHARED_MEMORY;

/// The ending of the name of a service's list of ports.
pub(crate) const LIST: &str = "dynamic";

/// The services that have a description.
#[derive(Debug, Default)]
pub struct Descriptions {
    numbers: BTreeSet<u128>,
    /// The files that need not be read again, and the number in each.
    read: BTreeMap<Version, Option<u128>>,
}

impl Descriptions {
    /// Reads the descriptions that have changed since the last look.
    pub fn look(&mut self, home: &Home) {
        self.numbers.clear();
        let mut before = core::mem::take(&mut self.read);
        let services = home.transport_folder().join(SERVICES);
        for file in fs::read_dir(services).into_iter().flatten().flatten() {
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

    /// Whether `segment` is the list of ports of a service that has no description.
    pub fn misses(&self, segment: &Path, home: &Home) -> bool {
        let has = |number: u128| self.numbers.contains(&number);
        match parts(segment, home.prefix()) {
            Some((number, LIST)) => !number.parse().is_ok_and(has),
            _ => false,
        }
    }
}

/// The number of the service to which a description belongs. It is also in the name of the
/// service's list of ports.
fn number_in(description: &str) -> Option<u128> {
    let value = |key: &str| {
        let mut lines = description.lines();
        let value = lines.find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "))?;
        value.parse::<u64>().ok().map(u128::from)
    };
    Some(value("unique_value")? << 64 | value("payload_value")?)
}

/// The number of a service or port, and the ending, from the name of a segment.
pub(crate) fn parts<'a>(path: &'a Path, prefix: &str) -> Option<(&'a str, &'a str)> {
    let name = path.strip_prefix(SHARED_MEMORY).ok()?.to_str()?;
    let (stem, end) = name.strip_prefix(prefix)?.rsplit_once('.')?;
    Some((stem.rsplit('_').next().unwrap_or_default(), end))
}
