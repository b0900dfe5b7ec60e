//! A sign of life of a service: when it last came round its loop, in a file of the robot's folder.
//!
//! Bridge, logic and body say something on the bus again and again. A service that does not, such
//! as comm, or that joins no bus, such as the station, writes this instead. Its supervisor, `lager
//! top` and whoever else asks why nothing happens read it, without the bus and without waiting for
//! anybody.
//!
//! ```text
//!   comm.life:  "4711 73012345678901\n"     process, and CLOCK_MONOTONIC in ns
//! ```
//! The file is a lock of its process, so one that a killed process has left is swept like those.

use core::time::Duration;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::clock::Clock;
use crate::lock::{LIFE, Lock, LockError, SUCCESSION};
use crate::name::RobotName;
use crate::place::Place;

/// How often it is written at the most.
const PACE: Duration = Duration::from_millis(100);
/// How long a process may take to write the next one before others call it silent.
pub(crate) const SILENT: Duration = Duration::from_secs(2);

/// The sign of this process, which is taken away when it is dropped.
#[derive(Debug)]
pub struct Life {
    lock: Lock,
    written_ns: AtomicU64,
}

/// A sign as others read it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sign {
    /// The process that gave it.
    pub pid: u32,
    /// When, in ns of `CLOCK_MONOTONIC`.
    pub at_ns: u64,
}

impl Life {
    /// Begins to live as `who` of a robot.
    ///
    /// # Errors
    /// The robot's folder takes no file, or another process is that service.
    pub fn begin(place: &Place, robot: &RobotName, who: &str) -> Result<Self, LockError> {
        place.robot(robot);
        let path = path(place, robot, who);
        let life = Self {
            lock: Lock::take(&path, robot, who, SUCCESSION)?,
            written_ns: AtomicU64::new(0),
        };
        life.goes_on();
        Ok(life)
    }

    /// The service has come round once more. It costs a look at the clock, and ten times a second a
    /// write that waits for nothing.
    pub fn goes_on(&self) {
        let now_ns = Clock::monotonic_ns();
        let written_ns = self.written_ns.load(Ordering::Relaxed);
        if now_ns.saturating_sub(written_ns) >= PACE.as_nanos() as u64 {
            self.written_ns.store(now_ns, Ordering::Relaxed);
            // One that is not written is missed by nobody who hears the next.
            let _ = self.lock.write_beside_number(now_ns);
        }
    }
}

impl Sign {
    /// Whether so much time has passed since that its service has fallen silent. Somebody else's
    /// wait for a core is in it: who acts on it must take that off (`Chance`).
    #[must_use]
    pub fn is_old(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.at_ns) >= SILENT.as_nanos() as u64
    }
}

impl Place {
    /// The last sign of life of `who`, if it gives any.
    #[must_use]
    pub fn sign_of(&self, robot: &RobotName, who: &str) -> Option<Sign> {
        let text = std::fs::read_to_string(path(self, robot, who)).ok()?;
        read(&text)
    }
}

fn path(place: &Place, robot: &RobotName, who: &str) -> PathBuf {
    place.folder_of(robot).join(who).with_extension(LIFE)
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
    use crate::config::BusConfig;

    #[test]
    fn a_sign_is_read_while_its_service_lives_and_is_gone_with_it() {
        let folder = PathBuf::from(format!("/dev/shm/lplife{}", std::process::id()));
        let config = BusConfig {
            folder: Some(folder),
            ..BusConfig::default()
        };
        let place = config.place().expect("a folder");
        let sign = |who| place.sign_of(&config.robot, who);
        assert_eq!(sign("comm"), None);
        let began_ns = Clock::monotonic_ns();
        let life = Life::begin(&place, &config.robot, "comm").expect("a file");
        let first = sign("comm").expect("a sign");
        assert_eq!(first.pid, std::process::id());
        assert!(first.at_ns >= began_ns, "{first:?}");
        std::thread::sleep(PACE);
        life.goes_on();
        let next = sign("comm").expect("a sign");
        assert!(next.at_ns > first.at_ns, "{first:?} {next:?}");
        assert!(!next.is_old(next.at_ns + 1) && next.is_old(next.at_ns + 2_000_000_000));
        place.sweep_locks();
        assert_eq!(sign("comm"), Some(next), "it lives");
        drop(life);
        assert_eq!(sign("comm"), None);

        // What a killed one has left.
        std::fs::write(path(&place, &config.robot, "comm"), "4711 7\n").expect("a file");
        assert_eq!(
            sign("comm"),
            Some(Sign {
                pid: 4711,
                at_ns: 7
            })
        );
        place.sweep_locks();
        assert_eq!(sign("comm"), None);
        place.remove();
    }

    #[test]
    fn what_is_no_sign_is_none() {
        for text in ["", "4711", "4711 ", "4711 7", "a 7\n", "4711 b\n", "-1 7\n"] {
            assert_eq!(read(text), None, "{text:?}");
        }
    }
}
