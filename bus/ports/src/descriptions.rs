//! Which services have a description, without reading again what has not changed.
//!
//! The name of a service's list of ends contains a number, which stands in its description. A list
//! whose number no description has is a service that nobody can open any more.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::place::Place;
use crate::shortage::SHARED_MEMORY;
use crate::watch::{SERVICES, Version};

/// The ending of a service's list of ends.
pub(crate) const LIST: &str = "dynamic";

/// The services that have a description.
#[derive(Debug, Default)]
pub(crate) struct Descriptions {
    numbers: BTreeSet<u128>,
    /// The files that need not be read again, each with the number in it.
    read: BTreeMap<Version, Option<u128>>,
}

impl Descriptions {
    /// Reads what has changed since the last look.
    pub(crate) fn look(&mut self, place: &Place) {
        self.numbers.clear();
        let mut before = core::mem::take(&mut self.read);
        let services = place.transport_folder().join(SERVICES);
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

    /// Whether a segment of `place` is the list of ends of a service without a description.
    pub(crate) fn misses(&self, segment: &Path, place: &Place) -> bool {
        let has = |number: u128| self.numbers.contains(&number);
        match parts(segment, place.prefix()) {
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

/// The number of a service or port, and the ending, in the name of a segment.
pub(crate) fn parts<'a>(path: &'a Path, prefix: &str) -> Option<(&'a str, &'a str)> {
    let name = path.strip_prefix(SHARED_MEMORY).ok()?.to_str()?;
    let (stem, end) = name.strip_prefix(prefix)?.rsplit_once('.')?;
    Some((stem.rsplit('_').next().unwrap_or_default(), end))
}
