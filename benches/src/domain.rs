//! A separate bus for each measurement, which is removed at the end even if processes on it have
//! died.
//!
//! A robot's bus shows nothing of it, and no robot is disturbed.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use lager_ports::BusConfig;

use crate::error::BenchError;

/// What the folders of measurements begin with.
const FAMILY: &str = "lager-bench";

/// Where they lie, beside the segments.
const SHARED_MEMORY: &str = "/dev/shm";

/// A bus without other users. Keep it until all processes on it have ended.
#[derive(Debug)]
pub struct Domain {
    folder: PathBuf,
}

impl Domain {
    /// A new bus. Also removes what measurements left behind that were killed themselves.
    ///
    /// # Errors
    /// Its folder cannot be made, or /dev/shm cannot be written to.
    pub fn new() -> Result<Self, BenchError> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        remove_orphans();
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let domain = Self::of(std::process::id(), number);
        let refused = |detail: String| BenchError::NoPlace {
            place: domain.folder.clone(),
            detail,
        };
        domain
            .config()
            .place()
            .map_err(|error| refused(error.to_string()))?;
        // The transport would say the same in a dozen ways, later.
        let probe = domain.folder.join("probe");
        std::fs::write(&probe, [0; 4096])
            .and_then(|()| std::fs::remove_file(&probe))
            .map_err(|error| refused(error.to_string()))?;
        Ok(domain)
    }

    fn of(pid: u32, number: u32) -> Self {
        let name = format!("{FAMILY}-{pid}-{number}");
        Self {
            folder: Path::new(SHARED_MEMORY).join(name),
        }
    }

    /// The bus's configuration for `lager-ports`.
    pub fn config(&self) -> BusConfig {
        BusConfig {
            folder: Some(self.folder.clone()),
            ..BusConfig::default()
        }
    }

    /// The bus's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        if let Ok(place) = self.config().place() {
            place.remove();
        }
    }
}

/// Removes the buses of measurements whose process is no more.
fn remove_orphans() {
    let Ok(entries) = std::fs::read_dir(SHARED_MEMORY) else {
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
        let name = domain.folder().file_name().unwrap().to_str().unwrap();
        assert_eq!(parse(name), Some((4711, 3)));
        assert_eq!(parse("lager-bench-4711"), None);
        assert_eq!(parse("lager-benches-4711-3"), None);
    }

    #[test]
    fn what_a_killed_measurement_left_goes_with_the_next_one() {
        // A process id that is not in use: the kernel gives none above its limit.
        let orphan = Domain::of(u32::MAX, 7);
        let place = orphan.config().place().unwrap();
        let segment = Path::new(SHARED_MEMORY).join(format!("{}left", place.prefix()));
        std::fs::write(&segment, b"left").unwrap();
        std::mem::forget(orphan);
        let _domain = Domain::new().unwrap();
        assert!(!segment.exists() && !place.folder().exists());
    }
}
