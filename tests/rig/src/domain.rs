//! A separate bus for each test and each measurement. It disturbs no robot on this machine, and it
//! is removed at the end even if processes on it have died.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use lager_home::Home;
use lager_ports::{Bus, BusConfig};
use lager_topics::{LAGER, Role};

/// The kernel's folder for shared memory; the buses lie beside the segments.
const SHARED_MEMORY: &str = "/dev/shm";

/// A folder in which no bus can be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{place} cannot be used for a bus of its own ({detail}); check that it exists, is writable and is not full"
)]
pub struct NoPlace {
    /// The folder.
    pub place: PathBuf,
    /// The kernel's reason.
    pub detail: String,
}

/// The configuration of the bus in `folder`, for a process that got the folder from its parent.
pub fn bus_at(folder: impl Into<PathBuf>) -> BusConfig {
    BusConfig {
        folder: Some(folder.into()),
        ..BusConfig::of(&LAGER)
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
    /// A new bus. Its folder's name begins with `family`, at most 15 characters. Also removes the
    /// buses that killed programs of that family have left.
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
        let place = domain.config().home();
        place.map_err(|error| refused(error.to_string()))?;
        // Without this check the transport would fail later, with a dozen different messages.
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

    /// A folder on a disk for files that are not the bus's; the first call makes it.
    ///
    /// # Panics
    /// When it cannot be made.
    #[must_use]
    pub fn files(&self) -> &Path {
        std::fs::create_dir_all(&self.files).expect("a temporary folder");
        &self.files
    }

    /// The bus's place in the file system.
    ///
    /// # Panics
    /// When its folder cannot be used any more.
    #[must_use]
    pub fn home(&self) -> Home {
        self.config().home().expect("the bus's folder")
    }

    /// Opens the bus in this role.
    ///
    /// # Panics
    /// When the bus cannot be opened.
    #[must_use]
    pub fn open(&self, role: Role) -> Bus {
        Bus::open(&self.config(), role).expect("the bus opens")
    }

    /// The files in shared memory and in the bus's folder that processes use or have left.
    #[must_use]
    pub fn left(&self) -> Vec<PathBuf> {
        let mut left = self.home().segments();
        // The transport never removes one small segment of each bus.
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
        if let Ok(place) = self.config().home() {
            place.remove();
        }
    }
}

/// Removes the buses of that family whose process has ended.
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
        // No process has this id: the kernel gives none above its limit.
        let orphan = Domain::of(FAMILY, u32::MAX, 7);
        let place = orphan.home();
        let segment = Path::new(SHARED_MEMORY).join(format!("{}left", place.prefix()));
        std::fs::write(&segment, b"left").unwrap();
        assert_eq!(orphan.left(), std::slice::from_ref(&segment));
        std::mem::forget(orphan);
        let _domain = Domain::new(FAMILY).unwrap();
        assert!(!segment.exists() && !place.folder().exists());
    }
}
