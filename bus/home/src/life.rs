//! [`Life`]: a service's sign of life, a file in the unit's folder with the time of its last loop.
//!
//! Many services publish again and again, so others see that they go on. A service that does not
//! publish writes this file instead. Its supervisor and tools read the file, without the bus and
//! without waiting for any process.
//!
//! ```text
//!   comm.life:  "4711 73012345678901\n"     process id, and CLOCK_MONOTONIC in ns
//! ```
//! The process has locked the file, so a sweep removes a killed process's file like other locks.

use core::time::Duration;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::clock::Clock;
use crate::home::Home;
use crate::lock::{LIFE, Lock, LockError, SUCCESSION};
use crate::name::UnitName;

/// How often the file is written at most.
const PACE: Duration = Duration::from_millis(100);
/// A service that has written nothing for this long counts as silent.
const SILENT: Duration = Duration::from_secs(2);

/// The sign of life of this process. Dropping it removes the file.
#[derive(Debug)]
pub struct Life {
    lock: Lock,
    written_ns: AtomicU64,
}

/// A sign of life, as other processes read it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sign {
    /// The process that gave the sign.
    pub pid: u32,
    /// The time of the sign, in ns of `CLOCK_MONOTONIC`.
    pub at_ns: u64,
}

impl Life {
    /// Begins to give signs for the service `who` of a unit.
    ///
    /// # Errors
    /// The file cannot be made in the unit's folder, or another process is that service.
    pub fn begin(home: &Home, unit: &UnitName, who: &str) -> Result<Self, LockError> {
        home.unit(unit);
        let path = path(home, unit, who);
        let life = Self {
            lock: Lock::take(&path, unit, who, SUCCESSION)?,
            written_ns: AtomicU64::new(0),
        };
        life.goes_on();
        Ok(life)
    }

    /// To be called in every loop of the service. It reads the clock each time, and writes the file
    /// at most ten times a second without waiting for anything.
    pub fn goes_on(&self) {
        let now_ns = Clock::monotonic_ns();
        let written_ns = self.written_ns.load(Ordering::Relaxed);
        if now_ns.saturating_sub(written_ns) >= PACE.as_nanos() as u64 {
            self.written_ns.store(now_ns, Ordering::Relaxed);
            // If a write fails, readers take the next sign.
            let _ = self.lock.write_beside_number(now_ns);
        }
    }
}

impl Sign {
    /// Whether the service has been silent for too long. That time includes waits for a core, so a
    /// caller that acts on this must subtract them (`Chance`).
    #[must_use]
    pub fn is_old(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.at_ns) >= SILENT.as_nanos() as u64
    }
}

impl Home {
    /// The last sign of life of `who`, if it gives any.
    #[must_use]
    pub fn sign_of(&self, unit: &UnitName, who: &str) -> Option<Sign> {
        let text = std::fs::read_to_string(path(self, unit, who)).ok()?;
        read(&text)
    }
}

fn path(home: &Home, unit: &UnitName, who: &str) -> PathBuf {
    home.folder_of(unit).join(who).with_extension(LIFE)
}

fn read(text: &str) -> Option<Sign> {
    let (pid, at_ns) = text.strip_suffix('\n')?.split_once(' ')?;
    Some(Sign {
        pid: pid.parse().ok()?,
        at_ns: at_ns.parse().ok()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sign_is_read_while_its_service_lives_and_is_gone_with_it() {
        let folder = PathBuf::from(format!("/dev/shm/lplife{}", std::process::id()));
        let home = Home::open("lager", Some(&folder)).expect("a folder");
        let unit = UnitName::default();
        let sign = |who| home.sign_of(&unit, who);
        assert_eq!(sign("comm"), None);
        let began_ns = Clock::monotonic_ns();
        let life = Life::begin(&home, &unit, "comm").expect("a file");
        let first = sign("comm").expect("a sign");
        assert_eq!(first.pid, std::process::id());
        assert!(first.at_ns >= began_ns, "{first:?}");
        std::thread::sleep(PACE);
        life.goes_on();
        let next = sign("comm").expect("a sign");
        assert!(next.at_ns > first.at_ns, "{first:?} {next:?}");
        assert!(!next.is_old(next.at_ns + 1) && next.is_old(next.at_ns + 2_000_000_000));
        home.sweep_locks();
        assert_eq!(sign("comm"), Some(next), "it lives");
        drop(life);
        assert_eq!(sign("comm"), None);

        // A file that a killed process has left.
        std::fs::write(path(&home, &unit, "comm"), "4711 7\n").expect("a file");
        assert_eq!(
            sign("comm"),
            Some(Sign {
                pid: 4711,
                at_ns: 7
            })
        );
        home.sweep_locks();
        assert_eq!(sign("comm"), None);
        home.remove();
    }

    #[test]
    fn what_is_no_sign_is_none() {
        for text in ["", "4711", "4711 ", "4711 7", "a 7\n", "4711 b\n", "-1 7\n"] {
            assert_eq!(read(text), None, "{text:?}");
        }
    }
}
