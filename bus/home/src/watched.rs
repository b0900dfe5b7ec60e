//! [`Watched`]: what a supervisor knows of the services that it keeps alive, in a file of the unit's
//! folder.
//!
//! Others read it without the supervisor and without the bus. The supervisor writes it when
//! something has changed.
//!
//! ```text
//!   services:  "bridge 4711 73012345678901 0\n"     service, process id or `-`, since when in ns of
//!              "logic - 73012399678901 2\n"         CLOCK_MONOTONIC, restarts
//! ```

use std::fmt::Write as _;
use std::{fs, io};

use crate::home::Home;
use crate::name::UnitName;

pub(crate) const FILE: &str = "services";

/// A service that a supervisor keeps alive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Watched {
    /// Its name on the command line.
    pub name: String,
    /// Its process, if it runs.
    pub pid: Option<u32>,
    /// When it was started, or when it ended, in ns of `CLOCK_MONOTONIC`.
    pub since_ns: u64,
    /// How often it has been started again.
    pub restarts: u32,
}

impl Home {
    /// Writes the services of a unit. A reader gets the whole old file or the whole new one.
    ///
    /// # Errors
    /// The unit has no folder, or it cannot be written.
    pub fn write_watched(&self, unit: &UnitName, services: &[Watched]) -> io::Result<()> {
        let mut text = String::new();
        for service in services {
            let pid = service.pid.map_or("-".to_owned(), |pid| pid.to_string());
            let Watched {
                name,
                since_ns,
                restarts,
                ..
            } = service;
            let _ = writeln!(text, "{name} {pid} {since_ns} {restarts}");
        }
        let file = self.folder_of(unit).join(FILE);
        let new = file.with_extension("new");
        fs::write(&new, text)?;
        fs::rename(&new, &file)
    }

    /// The services of a unit that its supervisor keeps alive; none where there is no supervisor.
    pub fn watched(&self, unit: &UnitName) -> Vec<Watched> {
        let text = fs::read_to_string(self.folder_of(unit).join(FILE)).unwrap_or_default();
        text.lines().filter_map(read).collect()
    }
}

fn read(line: &str) -> Option<Watched> {
    let mut words = line.split(' ');
    let mut next = || words.next();
    Some(Watched {
        name: next()?.to_owned(),
        pid: match next()? {
            "-" => None,
            pid => Some(pid.parse().ok()?),
        },
        since_ns: next()?.parse().ok()?,
        restarts: next()?.parse().ok()?,
    })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn services_are_read_as_they_were_written_until_the_supervisor_ends() {
        let folder = PathBuf::from(format!("/dev/shm/lpwatched{}", std::process::id()));
        let home = Home::open("lager", Some(&folder)).expect("a folder");
        let unit = UnitName::default();
        assert!(
            home.write_watched(&unit, &[]).is_err(),
            "there is no folder"
        );
        home.unit(&unit);
        assert_eq!(home.watched(&unit), []);
        let service = |name: &str, pid, restarts| Watched {
            name: name.to_owned(),
            pid,
            since_ns: 73_012_345_678_901,
            restarts,
        };
        let services = [service("bridge", Some(4711), 0), service("logic", None, 2)];
        home.write_watched(&unit, &services).expect("a file");
        assert_eq!(home.watched(&unit), services);
        home.forget(&unit, &[]);
        assert_eq!(home.watched(&unit), []);
        home.remove();
    }

    #[test]
    fn what_is_no_service_is_none() {
        for line in [
            "",
            "bridge",
            "bridge 1 2",
            "bridge x 2 0",
            "bridge 1 x 0",
            "bridge 1 2 x",
        ] {
            assert_eq!(read(line), None, "{line:?}");
        }
    }
}
