//! A bus of its own for each measurement, swept at the end whoever died meanwhile.
//!
//! Nothing of it can be seen from a robot's bus, and no robot is disturbed.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use lager_ports::{BusConfig, remove_stale_nodes};

use crate::error::BenchError;

/// What the folders and the shared files of measurements begin with.
const FAMILY: &str = "lager-bench";

/// Where the transport keeps its segments.
const SHARED_MEMORY: &str = "/dev/shm";

/// A bus nobody else is on. Keep it until all processes on it have ended.
#[derive(Debug)]
pub(crate) struct Domain {
    prefix: String,
    root: PathBuf,
}

impl Domain {
    /// A new bus. Also removes what measurements left behind that were killed themselves.
    ///
    /// # Errors
    /// Its folder cannot be made, or /dev/shm cannot be written to.
    pub(crate) fn new() -> Result<Self, BenchError> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        remove_orphans();
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let domain = Self::of(std::process::id(), number);
        let refused = |place: &Path, error: std::io::Error| BenchError::NoPlace {
            place: place.to_owned(),
            detail: error.to_string(),
        };
        std::fs::create_dir_all(&domain.root).map_err(|error| refused(&domain.root, error))?;
        // The transport would say the same in a dozen ways, later.
        let probe = Path::new(SHARED_MEMORY).join(format!("{}probe", domain.prefix));
        std::fs::write(&probe, [0; 4096])
            .and_then(|()| std::fs::remove_file(&probe))
            .map_err(|error| refused(Path::new(SHARED_MEMORY), error))?;
        Ok(domain)
    }

    fn of(pid: u32, number: u32) -> Self {
        Self {
            prefix: format!("{FAMILY}-{pid}-{number}_"),
            root: std::env::temp_dir().join(format!("{FAMILY}-{pid}-{number}")),
        }
    }

    /// The bus's configuration for `lager-ports`.
    pub(crate) fn config(&self) -> BusConfig {
        BusConfig {
            prefix: Some(self.prefix.clone()),
            root: Some(self.root.clone()),
            ..BusConfig::default()
        }
    }

    /// What the names of the bus's shared files begin with.
    pub(crate) fn prefix(&self) -> &str {
        &self.prefix
    }

    /// The bus's folder.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        // The regular way first; what it does not know of goes by name, which nobody else uses.
        let _ = remove_stale_nodes(&self.config());
        for file in shared_files(&self.prefix) {
            let _ = std::fs::remove_file(file);
        }
        let _ = std::fs::remove_dir_all(&self.root);
    }
}

fn shared_files(prefix: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(SHARED_MEMORY) else {
        return Vec::new();
    };
    entries
        .filter_map(Result::ok)
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix))
        .map(|entry| entry.path())
        .collect()
}

/// Removes the buses of measurements whose process is no more.
fn remove_orphans() {
    let Ok(entries) = std::fs::read_dir(std::env::temp_dir()) else {
        return;
    };
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name();
        let Some((pid, number)) = name.to_str().and_then(parse) else {
            continue;
        };
        if !Path::new(&format!("/proc/{pid}")).exists() {
            drop(Domain::of(pid, number));
        }
    }
}

/// The process and the number in the name of a measurement's folder.
fn parse(name: &str) -> Option<(u32, u32)> {
    let (pid, number) = name
        .strip_prefix(FAMILY)?
        .strip_prefix('-')?
        .split_once('-')?;
    Some((pid.parse().ok()?, number.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_read_back_as_they_were_named() {
        let domain = Domain::of(4711, 3);
        let name = domain.root().file_name().unwrap().to_str().unwrap();
        assert_eq!(parse(name), Some((4711, 3)));
        assert_eq!(parse("lager-bench-4711"), None);
        assert_eq!(parse("lager-benches-4711-3"), None);
    }

    #[test]
    fn what_a_killed_measurement_left_goes_with_the_next_one() {
        // A process id that is not in use: the kernel gives none above its limit.
        let orphan = Domain::of(u32::MAX, 7);
        std::fs::create_dir_all(orphan.root()).unwrap();
        let file = Path::new(SHARED_MEMORY).join(format!("{}left", orphan.prefix()));
        std::fs::write(&file, b"left").unwrap();
        std::mem::forget(orphan);
        let _domain = Domain::new().unwrap();
        assert!(!file.exists());
    }
}
