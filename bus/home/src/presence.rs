//! Finds out which processes of a unit run, from the locks that they hold in the unit's folder.
//!
//! It opens nothing of the transport, so it also works when the bus does not. It takes no lock,
//! because a process that starts at that moment would then be refused. It reads instead: the file
//! of a lock names its last owner, and an owner that still has the file open still has the lock.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Error, ErrorKind};
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

use crate::home::Home;
use crate::name::UnitName;

/// A process that holds a lock of a unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// The part that it plays, or `up` for the supervisor.
    pub what: String,
    /// Its process id.
    pub pid: u32,
    /// Whether a signal has stopped it; it goes on when it is continued.
    pub frozen: bool,
}

impl Home {
    /// The units that are up here, each with the processes that hold its locks.
    pub fn up(&self) -> BTreeMap<UnitName, Vec<Holder>> {
        let units = self.units().into_iter();
        units
            .map(|unit| (holders(&self.folder_of(&unit)), unit))
            .filter(|(holders, _)| !holders.is_empty())
            .map(|(holders, unit)| (unit, holders))
            .collect()
    }
}

/// The processes that hold the locks in a unit's folder.
fn holders(folder: &Path) -> Vec<Holder> {
    let mut holders: Vec<Holder> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| {
            let name = entry.file_name();
            let what = name.to_str()?.strip_suffix(".lock")?.to_owned();
            let pid = fs::read_to_string(entry.path()).ok()?.trim().parse().ok()?;
            has_open(pid, &entry.path()).then(|| Holder {
                what,
                pid,
                frozen: is_frozen(pid),
            })
        })
        .collect();
    holders.sort_by(|a, b| a.what.cmp(&b.what));
    holders
}

/// Whether a process has a file open.
fn has_open(pid: u32, file: &Path) -> bool {
    let is_hidden = |error: &Error| error.kind() == ErrorKind::PermissionDenied;
    let entries = match fs::read_dir(format!("/proc/{pid}/fd")) {
        Ok(entries) => entries,
        Err(error) => return is_hidden(&error) && has_locked(pid, file),
    };
    for entry in entries.flatten() {
        match fs::read_link(entry.path()) {
            Ok(open) if open == file => return true,
            Err(error) if is_hidden(&error) => return has_locked(pid, file),
            _ => {}
        }
    }
    false
}

/// Whether a process has locked a file. The kernel tells everybody who has locked what, but not
/// which files a process has open that has more rights than this one, such as a service with the
/// right to real time.
fn has_locked(pid: u32, file: &Path) -> bool {
    let Ok(metadata) = fs::metadata(file) else {
        return false;
    };
    let locks = fs::read_to_string("/proc/locks").unwrap_or_default();
    locks
        .lines()
        .any(|lock| is_lock_of(lock, pid, metadata.ino()))
}

/// Whether a line of `/proc/locks` tells of this process and of a file with this number:
/// `3: FLOCK  ADVISORY  WRITE 4711 00:1a:67 0 EOF`.
fn is_lock_of(line: &str, pid: u32, number: u64) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    let ["FLOCK", _, "WRITE", holder, place, ..] = words.get(1..).unwrap_or_default() else {
        return false;
    };
    let of_file = place.rsplit(':').next();
    holder.parse() == Ok(pid) && of_file.and_then(|it| it.parse().ok()) == Some(number)
}

/// Whether a process is stopped by a signal or by a debugger.
fn is_frozen(pid: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // The state follows the name. The name is in parentheses and may contain anything.
    let state = stat
        .rsplit(") ")
        .next()
        .and_then(|rest| rest.chars().next());
    matches!(state, Some('T' | 't'))
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use rustix::fs::{FlockOperation, flock};

    use super::*;

    #[test]
    fn a_lock_is_found_among_those_that_the_kernel_tells() {
        let line = "3: FLOCK  ADVISORY  WRITE 4711 00:1a:67 0 EOF";
        assert!(is_lock_of(line, 4_711, 67));
        assert!(!is_lock_of(line, 4_712, 67));
        assert!(!is_lock_of(line, 4_711, 1_167));
        // Somebody waits for it.
        assert!(!is_lock_of(
            "3: -> FLOCK ADVISORY WRITE 4711 00:1a:67 0 EOF",
            4_711,
            67
        ));
        assert!(!is_lock_of(
            "4: POSIX  ADVISORY  WRITE 4711 00:1a:67 0 EOF",
            4_711,
            67
        ));
        assert!(!is_lock_of("", 4_711, 67));
        let path = std::env::temp_dir().join(format!("lager-locked-{}", std::process::id()));
        let file = File::create(&path).expect("a temporary file");
        let own = std::process::id();
        assert!(!has_locked(own, &path));
        flock(&file, FlockOperation::LockExclusive).expect("a lock");
        assert!(has_locked(own, &path));
        fs::remove_file(&path).expect("its own file");
    }

    #[test]
    fn a_lock_is_held_by_who_is_named_in_it_and_has_it_open() {
        let folder = std::env::temp_dir().join(format!("lager-presence-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a temporary folder");
        let folder = fs::canonicalize(folder).expect("a temporary folder");
        let lock = folder.join("bridge.lock");
        fs::write(&lock, std::process::id().to_string()).expect("a temporary file");
        assert_eq!(holders(&folder), [], "left by a killed process");
        let open = File::open(&lock).expect("a temporary file");
        let holder = Holder {
            what: "bridge".into(),
            pid: std::process::id(),
            frozen: false,
        };
        assert_eq!(holders(&folder), [holder]);
        drop(open);
        fs::remove_dir_all(folder).expect("a temporary folder");
    }
}
