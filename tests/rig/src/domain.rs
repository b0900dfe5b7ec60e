//! A bus of its own for each test and each measurement, which is removed at the end even if
//! processes on it have died.
//!
//! No robot sees anything of it, and none is disturbed.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use lager_ports::{Bus, BusConfig, Place};
use lager_topics::Role;

/// Where the buses lie, beside the segments.
const SHARED_MEMORY: &str = "/dev/shm";

/// There is no place for a bus.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{place} cannot be used for a bus of its own ({detail}); check that it exists, is writable and is not full"
)]
pub struct NoPlace {
    /// The folder.
    pub place: PathBuf,
    /// What the kernel says.
    pub detail: String,
}

/// The configuration of the bus in `folder`, for a process that was told the folder.
pub fn bus_at(folder: impl Into<PathBuf>) -> BusConfig {
    BusConfig {
        folder: Some(folder.into()),
        ..BusConfig::default()
    }
}

/// A bus without other users, and a folder for other files. Keep it until all processes on the bus
/// have ended.
#[derive(Debug)]
pub struct Domain {
    folder: PathBuf,
    files: PathBuf,
}

impl Domain {
    /// A new bus, whose folder begins with `family`, at most 15 characters. Also removes what
    /// programs of that family left behind that were killed themselves.
    ///
    /// # Errors
    /// Its folder cannot be made, or `/dev/shm` cannot be written to.
    pub fn new(family: &str) -> Result<Self, NoPlace> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        remove_orphans(family);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let domain = Self::of(family, std::process::id(), number);
        let refused = |detail: String| NoPlace {
            place: domain.folder.clone(),
            detail,
        };
        let place = domain.config().place();
        place.map_err(|error| refused(error.to_string()))?;
        // The transport would say the same in a dozen ways, later.
        let probe = domain.folder.join("probe");
        std::fs::write(&probe, [0; 4096])
            .and_then(|()| std::fs::remove_file(&probe))
            .map_err(|error| refused(error.to_string()))?;
        Ok(domain)
    }

    fn of(family: &str, pid: u32, number: u32) -> Self {
        Self::at(Path::new(SHARED_MEMORY).join(format!("{family}-{pid}-{number}")))
    }

    /// The bus in that folder, which need not be there yet.
    #[must_use]
    pub fn at(folder: PathBuf) -> Self {
        let name = folder.file_name().unwrap_or_default();
        Self {
            files: std::env::temp_dir().join(name),
            folder,
        }
    }

    /// The bus's configuration.
    #[must_use]
    pub fn config(&self) -> BusConfig {
        bus_at(&self.folder)
    }

    /// The bus's folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A folder for files that are not the bus's, on a disk; made when it is first asked for.
    ///
    /// # Panics
    /// When it cannot be made.
    #[must_use]
    pub fn files(&self) -> &Path {
        std::fs::create_dir_all(&self.files).expect("a temporary folder");
        &self.files
    }

    /// Where the bus lives.
    ///
    /// # Panics
    /// When its folder cannot be used any more.
    #[must_use]
    pub fn place(&self) -> Place {
        self.config().place().expect("the bus's folder")
    }

    /// A way onto the bus.
    ///
    /// # Panics
    /// When the bus cannot be opened.
    #[must_use]
    pub fn open(&self, role: Role) -> Bus {
        Bus::open(&self.config(), role).expect("the bus opens")
    }

    /// What processes have left, or still have, in shared memory and in the bus's folder.
    #[must_use]
    pub fn left(&self) -> Vec<PathBuf> {
        let mut left = self.place().segments();
        // The transport keeps one small segment for each bus for ever.
        left.retain(|segment| segment.extension().is_none_or(|end| end != "global_mgmt"));
        let mut folders = vec![self.folder.clone()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                if entry.path().is_dir() {
                    folders.push(entry.path());
                } else {
                    left.push(entry.path());
                }
            }
        }
        left
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.files);
        if let Ok(place) = self.config().place() {
            place.remove();
        }
    }
}

/// Removes the buses of that family whose process is no more.
fn remove_orphans(family: &str) {
    let Ok(entries) = std::fs::read_dir(SHARED_MEMORY) else {
        return;
    };
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name();
        let Some((pid, number)) = name.to_str().and_then(|name| parse(family, name)) else {
            continue;
        };
        if !Path::new(&format!("/proc/{pid}")).exists() {
            drop(Domain::of(family, pid, number));
        }
    }
}

/// The process and the number in the name of a bus's folder.
fn parse(family: &str, name: &str) -> Option<(u32, u32)> {
    let (pid, number) = name
        .strip_prefix(family)?
        .strip_prefix('-')?
        .split_once('-')?;
    Some((pid.parse().ok()?, number.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAMILY: &str = "lager-rig";

    #[test]
    fn folders_are_read_back_as_they_were_named() {
        let domain = Domain::of(FAMILY, 4711, 3);
        let name = domain.folder().file_name().unwrap().to_str().unwrap();
        assert_eq!(parse(FAMILY, name), Some((4711, 3)));
        assert_eq!(parse(FAMILY, "lager-rig-4711"), None);
        assert_eq!(parse(FAMILY, "lager-rigs-4711-3"), None);
    }

    #[test]
    fn what_a_killed_program_left_goes_with_the_next_one() {
        // A process id that is not in use: the kernel gives none above its limit.
        let orphan = Domain::of(FAMILY, u32::MAX, 7);
        let place = orphan.place();
        let segment = Path::new(SHARED_MEMORY).join(format!("{}left", place.prefix()));
        std::fs::write(&segment, b"left").unwrap();
        assert_eq!(orphan.left(), std::slice::from_ref(&segment));
        std::mem::forget(orphan);
        let _domain = Domain::new(FAMILY).unwrap();
        assert!(!segment.exists() && !place.folder().exists());
    }
}
