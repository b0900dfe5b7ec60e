//! Mends a bus by its files alone. It maps nothing, opens no service and waits for nothing. So it
//! works when no process answers, whatever the files contain.
//!
//! | what | when it is removed |
//! |---|---|
//! | an unfinished segment: empty, or not readable yet | at every look, if no process has it open |
//! | an unfinished description of a service | the same |
//! | a service's list of ports that no description names | the same |
//! | a node's folder without files beside it | the same, if it is older than a creation takes |
//! | any segment, description or socket | in [`mend`], if no process has it open |
//! | a node's files; bells, locks, a supervisor's files | the same |
//!
//! The kernel says whether a process has a file open (`in_use`). So the files of living processes
//! stay, even if the process is stopped or is just making them. The bus's own sweep
//! (`lager_ports::Bus::sweep`) removes what a dead process has registered with living ones.

use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::changes::{NODES, SERVICES};
use crate::descriptions::Descriptions;
use crate::error::HomeError;
use crate::home::{Home, user_name};
use crate::name::UnitName;
use crate::{asked, in_use, watched};

/// The longest time between the making of a node's folder and of the first file in it.
const CREATION: Duration = Duration::from_secs(2);

/// The ending of the name of the segment from which every process of the bus gets its number. The
/// transport lets every user write to this segment.
const COUNTER: &str = ".global_mgmt";

/// The size of its contents in bytes: the transport's version, and the number.
const COUNTER_SIZE: u64 = 16;

/// The version of iceoryx2 0.10.0, as it stands there.
const VERSION: u64 = 0x000a_0000;

/// The result of [`mend`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mended {
    /// How many files it has removed.
    pub removed: usize,
    /// Damaged files that are still in use: they are empty, or belong to another user. The
    /// processes that use them must end first.
    pub damaged: Vec<PathBuf>,
}

/// Removes all files of a bus that no process uses. In the folder of a unit without a supervisor,
/// it also removes the files in `kept`.
pub fn mend(home: &Home, kept: &[&str]) -> Mended {
    let mut removed = unfinished(home, &mut Descriptions::default());
    removed += segments(home)
        .filter(|path| !is_counter(path))
        .filter(|path| in_use::remove_unused(path))
        .count();
    let mut living = false;
    for node in nodes(home) {
        if node.is_used() {
            living = true;
        } else {
            removed += node.remove();
        }
    }
    for folder in [home.transport_folder(), services(home)] {
        removed += files(&folder).filter(|path| remove_left(path)).count();
    }
    removed += earlier(home);
    for unit in home.units() {
        removed += tidy(home, &unit, kept);
    }
    if !living {
        let counters = segments(home).filter(|path| is_counter(path));
        removed += counters.filter(|path| in_use::remove_unused(path)).count();
    }
    Mended {
        removed,
        damaged: damaged(home),
    }
}

/// The segments of a bus that are empty or belong to another user.
pub fn damaged(home: &Home) -> Vec<PathBuf> {
    segments(home).filter(|path| is_damaged(path)).collect()
}

/// Removes what a dead process has not finished, and lists of ports without a description; returns
/// the number of files. Such a list remains if a sweep had it open while its service was removed.
pub fn unfinished(home: &Home, descriptions: &mut Descriptions) -> usize {
    let bad_counter = |path: &Path| is_counter(path) && !is_sound_counter(path);
    let all: Vec<PathBuf> = segments(home).collect();
    // After the segments were listed: a service has its description before its segments.
    descriptions.look(home);
    let segments = all
        .iter()
        .filter(|path| is_unfinished(path) || bad_counter(path) || descriptions.misses(path, home))
        .filter(|path| in_use::remove_unused(path))
        .count();
    let descriptions = files(&services(home))
        .filter(|path| mode(path).is_some_and(|mode| mode & 0o200 != 0))
        .filter(|path| in_use::remove_unused(path))
        .count();
    let nodes = nodes(home)
        .into_iter()
        .filter(|node| node.monitors.is_empty() && !node.is_used())
        .map(|node| node.remove())
        .sum::<usize>();
    segments + descriptions + nodes
}

/// Refuses a bus on which another user has put a segment. That user could control every process
/// that opens the segment.
pub fn refuse_foreign(home: &Home) -> Result<(), HomeError> {
    match foreign(home) {
        Some((path, uid)) => Err(HomeError::ForeignSegment {
            path,
            uid,
            name: user_name(uid),
        }),
        None => Ok(()),
    }
}

/// Keeps other users from emptying the segment that the transport lets them write to. Only this
/// user needs it, because one user owns the whole bus.
pub fn protect(home: &Home) {
    for path in segments(home).filter(|path| is_counter(path)) {
        if mode(&path).is_some_and(|mode| mode & 0o077 != 0) {
            let _ = fs::set_permissions(&path, fs::Permissions::from_mode(0o600));
        }
    }
}

/// Removes the remains of the bus's earlier generations.
fn earlier(home: &Home) -> usize {
    let mut folders = home.transport_folders();
    folders.retain(|folder| *folder != home.transport_folder());
    let mut removed = 0;
    // The folders inside a folder are appended behind it.
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

fn foreign(home: &Home) -> Option<(PathBuf, u32)> {
    let uid = rustix::process::geteuid().as_raw();
    segments(home).find_map(|path| {
        let owner = fs::symlink_metadata(&path).ok()?.uid();
        (owner != uid).then_some((path, owner))
    })
}

fn segments(home: &Home) -> impl Iterator<Item = PathBuf> {
    home.segments().into_iter()
}

fn services(home: &Home) -> PathBuf {
    home.transport_folder().join(SERVICES)
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

/// A whole segment is readable. Before that it has no size or no permission to read.
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
        // A socket that no process has open refuses the connection.
        let asked = UnixDatagram::unbound().and_then(|socket| socket.connect(path));
        let refused = std::io::ErrorKind::ConnectionRefused;
        return asked.is_err_and(|error| error.kind() == refused) && fs::remove_file(path).is_ok();
    }
    in_use::remove_unused(path)
}

impl Home {
    /// Removes what a unit's processes have written in its folder to be read by others, and the files
    /// in `kept`: nobody writes them any more. A file that was half written has the ending `new`.
    pub fn forget(&self, unit: &UnitName, kept: &[&str]) {
        let folder = self.folder_of(unit);
        for name in [asked::FILE, watched::FILE].iter().chain(kept) {
            let _ = fs::remove_file(folder.join(name));
            let _ = fs::remove_file(folder.join(format!("{name}.new")));
        }
    }
}

/// Removes the files that killed processes have left in a unit's folder, and the folder if it is
/// then empty. Other files stay.
fn tidy(home: &Home, unit: &UnitName, kept: &[&str]) -> usize {
    let folder = home.folder_of(unit);
    let before = files(&folder).count();
    home.sweep_locks_of(unit);
    in_use::remove_unused(&folder.join("bells"));
    // While this process holds the name, no supervisor can start.
    if let Ok(_name) = home.lock_name(unit) {
        home.forget(unit, kept);
        for name in kept {
            let _ = fs::remove_dir_all(folder.join(name));
        }
    }
    let removed = before - files(&folder).count().min(before);
    let _ = fs::remove_dir(&folder);
    removed
}

/// The transport's files of one process at one look: a folder of tags and details, and the files
/// beside it that show whether the process lives.
struct Node {
    folder: PathBuf,
    inside: Vec<PathBuf>,
    monitors: Vec<PathBuf>,
}

fn nodes(home: &Home) -> Vec<Node> {
    let beside = home.transport_folder().join(NODES);
    let mut nodes: Vec<Node> = Vec::new();
    let entries = fs::read_dir(&beside).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        let id = match name.strip_prefix(home.prefix()) {
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

    /// Whether a process has one of the files open. Its own process has from the start.
    fn is_used(&self) -> bool {
        self.files().any(|path| in_use::is_used(path))
    }

    /// Removes the files that no process uses; returns their number. A folder that was empty is
    /// removed only when it is older than a creation takes. Files that came since then stay.
    fn remove(&self) -> usize {
        let removed = self
            .files()
            .filter(|path| in_use::remove_unused(path))
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
