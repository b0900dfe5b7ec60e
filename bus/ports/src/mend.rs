//! Mends a bus by its files alone. It maps nothing, opens nothing as a service and waits for
//! nothing, so it works when no process answers, and whatever the files hold.
//!
//! | what | when it goes |
//! |---|---|
//! | an unfinished segment: empty, or not readable yet | at every look, if no process has it open |
//! | an unfinished description of a service | likewise |
//! | a service's list of ends that no description names | likewise |
//! | a node's folder without the node | likewise, if it is older than a creation takes |
//! | any segment, description or socket | in [`mend`], if no process has it open |
//! | a node's files; bells, locks, what `up` kept | likewise |
//!
//! The kernel says whether a process has a file open ([`lease`]). So the files of living processes
//! are left alone, also of processes that are stopped or are just making them. What a dead process
//! has registered with living ones is removed by the ordinary sweep ([`sweep`](crate::sweep)).

use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::descriptions::Descriptions;
use crate::error::OpenError;
use crate::lease;
use crate::name::RobotName;
use crate::place::{Place, user_name};
use crate::watch::{NODES, SERVICES};

/// A creator makes a node's folder and opens a file in it at once.
const CREATION: Duration = Duration::from_secs(2);

/// The end of the name of the segment that every process of the bus opens to get its number. The
/// transport lets every user write to it.
const COUNTER: &str = ".global_mgmt";

/// All that is in it: the transport's version, and the number.
const COUNTER_SIZE: u64 = 16;

/// iceoryx2 0.10.0, as it stands there.
const VERSION: u64 = 0x000a_0000;

/// What a supervisor and a station of its own keep in the robot's folder.
const RUNTIME: [&str; 12] = [
    "lager.toml",
    "lager.toml.new",
    "sensor.tty",
    "steering.tty",
    "clock",
    "gag",
    "secret",
    "secret.new",
    "warehouse.toml",
    "warehouse.toml.new",
    "warehouse.toml.queue",
    "warehouse.toml.queue.new",
];

/// What [`mend`] has found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mended {
    /// How many files it has removed.
    pub removed: usize,
    /// Damaged files that are still in use: empty, or another user's. The processes that use them
    /// must end first.
    pub damaged: Vec<PathBuf>,
}

/// Removes all files of a bus that no process uses.
///
/// # Errors
/// The folder cannot be used, or belongs to another user.
pub fn mend(config: &crate::BusConfig) -> Result<Mended, OpenError> {
    let place = config.place()?;
    let mut removed = unfinished(&place, &mut Descriptions::default());
    removed += segments(&place)
        .filter(|path| !is_counter(path))
        .filter(|path| lease::remove_unused(path))
        .count();
    let mut living = false;
    for node in nodes(&place) {
        if node.is_used() {
            living = true;
        } else {
            removed += node.remove();
        }
    }
    for folder in [place.transport_folder(), services(&place)] {
        removed += files(&folder).filter(|path| remove_left(path)).count();
    }
    removed += earlier(&place);
    for robot in place.robots() {
        removed += tidy(&place, &robot);
    }
    if !living {
        let counters = segments(&place).filter(|path| is_counter(path));
        removed += counters.filter(|path| lease::remove_unused(path)).count();
    }
    Ok(Mended {
        removed,
        damaged: damaged(config)?,
    })
}

/// The segments of a bus that are empty or belong to another user.
///
/// # Errors
/// The folder cannot be used, or belongs to another user.
pub fn damaged(config: &crate::BusConfig) -> Result<Vec<PathBuf>, OpenError> {
    let place = config.place()?;
    Ok(segments(&place).filter(|path| is_damaged(path)).collect())
}

/// Removes what was never finished and whose creator is gone, and lists of ends whose description
/// is; returns how much it was. Such a list is left where a sweep had it open while the rest of its
/// service was removed.
pub(crate) fn unfinished(place: &Place, descriptions: &mut Descriptions) -> usize {
    let bad_counter = |path: &Path| is_counter(path) && !is_sound_counter(path);
    let all: Vec<PathBuf> = segments(place).collect();
    // After the segments: a service has its description first.
    descriptions.look(place);
    let segments = all
        .iter()
        .filter(|path| is_unfinished(path) || bad_counter(path) || descriptions.misses(path, place))
        .filter(|path| lease::remove_unused(path))
        .count();
    let descriptions = files(&services(place))
        .filter(|path| mode(path).is_some_and(|mode| mode & 0o200 != 0))
        .filter(|path| lease::remove_unused(path))
        .count();
    let nodes = nodes(place)
        .into_iter()
        .filter(|node| node.monitors.is_empty() && !node.is_used())
        .map(|node| node.remove())
        .sum::<usize>();
    segments + descriptions + nodes
}

/// Refuses a bus on which another user has put a segment: that user could control every process
/// that opens it.
pub(crate) fn refuse_foreign(place: &Place) -> Result<(), OpenError> {
    match foreign(place) {
        Some((path, uid)) => Err(OpenError::ForeignSegment {
            path,
            uid,
            name: user_name(uid),
        }),
        None => Ok(()),
    }
}

/// Keeps other users from emptying the segment that the transport lets them write to. Only this
/// user needs it, because all of a bus belongs to one user.
pub(crate) fn protect(place: &Place) {
    for path in segments(place).filter(|path| is_counter(path)) {
        if mode(&path).is_some_and(|mode| mode & 0o077 != 0) {
            let _ = fs::set_permissions(&path, fs::Permissions::from_mode(0o600));
        }
    }
}

/// Removes what is left of the bus before it was cleared.
fn earlier(place: &Place) -> usize {
    let mut folders = place.transport_folders();
    folders.retain(|folder| *folder != place.transport_folder());
    let mut removed = 0;
    // A folder's own folders come behind it.
    let mut at = 0;
    while let Some(folder) = folders.get(at).cloned() {
        removed += files(&folder).filter(|path| remove_left(path)).count();
        let below = fs::read_dir(&folder).into_iter().flatten().flatten();
        folders.extend(below.map(|entry| entry.path()).filter(|path| path.is_dir()));
        at += 1;
    }
    for folder in folders.iter().rev() {
        let _ = fs::remove_dir(folder);
    }
    removed
}

fn foreign(place: &Place) -> Option<(PathBuf, u32)> {
    let uid = rustix::process::geteuid().as_raw();
    segments(place).find_map(|path| {
        let owner = fs::symlink_metadata(&path).ok()?.uid();
        (owner != uid).then_some((path, owner))
    })
}

fn segments(place: &Place) -> impl Iterator<Item = PathBuf> {
    place.segments().into_iter()
}

fn services(place: &Place) -> PathBuf {
    place.transport_folder().join(SERVICES)
}

fn files(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| entry.path())
        .filter(|path| !path.is_dir())
}

fn mode(path: &Path) -> Option<u32> {
    let found = fs::symlink_metadata(path).ok()?;
    Some(found.permissions().mode() & 0o777)
}

/// A segment is readable when it is whole; before that it has no size, or no contents.
fn is_unfinished(path: &Path) -> bool {
    fs::symlink_metadata(path)
        .is_ok_and(|found| found.len() == 0 || found.permissions().mode() & 0o400 == 0)
}

fn is_damaged(path: &Path) -> bool {
    let uid = rustix::process::geteuid().as_raw();
    fs::symlink_metadata(path).is_ok_and(|found| found.len() == 0 || found.uid() != uid)
}

fn is_counter(path: &Path) -> bool {
    path.to_string_lossy().ends_with(COUNTER)
}

fn is_sound_counter(path: &Path) -> bool {
    let sized = fs::metadata(path).is_ok_and(|found| found.len() == COUNTER_SIZE);
    sized && fs::read(path).is_ok_and(|bytes| bytes.first_chunk() == Some(&VERSION.to_ne_bytes()))
}

/// Removes a description or a socket that no process uses.
fn remove_left(path: &Path) -> bool {
    let kind = fs::symlink_metadata(path).map(|found| found.file_type());
    if kind.is_ok_and(|kind| kind.is_socket()) {
        // A socket without a process refuses the connection.
        let asked = UnixDatagram::unbound().and_then(|socket| socket.connect(path));
        let refused = std::io::ErrorKind::ConnectionRefused;
        return asked.is_err_and(|error| error.kind() == refused) && fs::remove_file(path).is_ok();
    }
    lease::remove_unused(path)
}

/// Removes what killed processes have left in a robot's folder, and the folder if it is then empty.
/// The stop word is never removed.
fn tidy(place: &Place, robot: &RobotName) -> usize {
    let folder = place.folder_of(robot);
    let before = files(&folder).count();
    place.sweep_locks_of(robot);
    lease::remove_unused(&folder.join("bells"));
    // While this process holds the name, no supervisor can start.
    if let Ok(_name) = place.lock_name(robot) {
        for name in RUNTIME {
            let _ = fs::remove_file(folder.join(name));
        }
        let _ = fs::remove_dir_all(folder.join("eeprom"));
    }
    let removed = before - files(&folder).count().min(before);
    let _ = fs::remove_dir(&folder);
    removed
}

/// What the transport keeps of a process, as it was at one look: a folder of tags and details, and
/// the files beside it that tell whether the process lives.
struct Node {
    folder: PathBuf,
    inside: Vec<PathBuf>,
    monitors: Vec<PathBuf>,
}

fn nodes(place: &Place) -> Vec<Node> {
    let beside = place.transport_folder().join(NODES);
    let mut nodes: Vec<Node> = Vec::new();
    let entries = fs::read_dir(&beside).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        let id = match name.strip_prefix(place.prefix()) {
            Some(monitor) => monitor.split('.').next().unwrap_or_default(),
            None => name,
        };
        let folder = beside.join(id);
        let at = nodes.iter().position(|node| node.folder == folder);
        let at = at.unwrap_or_else(|| {
            nodes.push(Node {
                inside: files(&folder).collect(),
                folder,
                monitors: Vec::new(),
            });
            nodes.len() - 1
        });
        if name != id {
            nodes[at].monitors.push(entry.path());
        }
    }
    nodes
}

impl Node {
    fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.inside.iter().chain(&self.monitors)
    }

    /// Whether a process has one of the files open, as the one whose node it is does from the
    /// moment it makes them.
    fn is_used(&self) -> bool {
        self.files().any(|path| lease::is_used(path))
    }

    /// Removes what no process uses; returns how many files it was. A folder that was empty goes
    /// only when it is older than a creation takes, and what has come into it since stays.
    fn remove(&self) -> usize {
        let removed = self
            .files()
            .filter(|path| lease::remove_unused(path))
            .count();
        if self.files().next().is_some() || is_older_than(&self.folder, CREATION) {
            let _ = fs::remove_dir(&self.folder);
        }
        removed
    }
}

fn is_older_than(path: &Path, age: Duration) -> bool {
    let changed = fs::metadata(path).and_then(|found| found.modified());
    changed.is_ok_and(|when| SystemTime::now().duration_since(when).unwrap_or_default() >= age)
}
