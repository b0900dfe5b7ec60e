//! Where a bus lives: in one folder of its user, and in `/dev/shm`.
//!
//! ```text
//!     <folder>/              0700, owned by the user who runs the robots
//!         iceoryx2/          the transport's own files and sockets; `iceoryx2-1/` after the bus
//!                            has been cleared once, and so on
//!         <robot>/           0700
//!             bells          the board of bells, see `doorbell`
//!             stop           the stop word
//!             up.lock, bridge.lock, logic.lock …      see [`Lock`]
//!             lager.toml, sensor.tty, steering.tty, clock, eeprom/     the supervisor's
//!             gag, secret, warehouse.toml, warehouse.toml.queue        its station's
//!     /dev/shm/lager_<8 hex>_…      the transport's segments; the number is made from the folder
//! ```
//!
//! A bus that was damaged and cleared gets new names for its files (a new generation), because an
//! observer of the old bus may still live, and removes files by name when it ends.
//!
//! The folder is `/run/lager` where that belongs to this user, as for a system service, else
//! `/dev/shm/lager-<uid>`. Nothing that tidies up `/tmp` and no other session of the user can
//! remove a part of it. A folder that others may enter, or that is a link, is refused, so nobody
//! else can put files there. Whoever takes a robot's name meets the robot that has it, and a sweep
//! removes only files of this user's bus.

use std::fmt;
use std::fs::{self, DirBuilder};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, SemanticString};
use lager_topics::Role;

use crate::error::OpenError;
use crate::lock::{self, Lock, LockError, SUCCESSION};
use crate::name::{RobotName, TRANSPORT, is_transport};
use crate::shortage::SHARED_MEMORY;

/// The folder of a system service.
const SYSTEM: &str = "/run/lager";

/// The longest path of a socket, in bytes.
const LONGEST_SOCKET: usize = 107;

/// What a socket's path needs besides the folder and the prefix: the transport's folder with a
/// slash before and behind it, a 128-bit number, `.event`.
const BELOW_FOLDER: usize = 1 + TRANSPORT.len() + 2 + 1 + 39 + 6;

/// `lager_`, eight digits, the generation, `_`.
const PREFIX_LENGTH: usize = 16;

/// A bus's generations: the first, and after it one for each letter and digit but 0, again and
/// again.
const GENERATIONS: &[u8] = b"0123456789abcdefghijklmnopqrstuvwxyz";

/// The longest folder, in bytes.
const LONGEST_FOLDER: usize = LONGEST_SOCKET - BELOW_FOLDER - PREFIX_LENGTH;

/// A bus's folder, which exists and is this user's alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    folder: PathBuf,
    /// What the names of all generations' segments begin with.
    stem: String,
    /// An index of [`GENERATIONS`].
    generation: usize,
    prefix: String,
}

impl Place {
    /// The place at `folder`, or this user's own; the folder is made if it is missing.
    pub(crate) fn open(folder: Option<&Path>) -> Result<Self, OpenError> {
        let folder = folder.map_or_else(own_folder, Path::to_owned);
        if !folder.is_absolute() {
            return Err(OpenError::RelativeFolder(folder));
        }
        make(&folder)?;
        check(&folder)?;
        let folder = fs::canonicalize(&folder).map_err(|error| refused(&folder, &error))?;
        if folder.as_os_str().len() > LONGEST_FOLDER {
            return Err(OpenError::FolderTooLong {
                folder,
                limit: LONGEST_FOLDER,
            });
        }
        let stem = stem_of(&folder);
        let generation = generation_in(&folder);
        Ok(Self {
            prefix: prefix(&stem, generation),
            folder,
            stem,
            generation,
        })
    }

    /// The folder, without links.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What the names of the bus's segments in `/dev/shm` begin with.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// A robot's folder, which is made if it is missing. If it cannot be made, opening a file in it
    /// says why.
    pub fn robot(&self, robot: &RobotName) -> PathBuf {
        let folder = self.folder_of(robot);
        let _ = make(&folder);
        folder
    }

    /// A robot's folder, which may not be there.
    pub fn folder_of(&self, robot: &RobotName) -> PathBuf {
        self.folder.join(robot.as_str())
    }

    /// The file of a robot's board of bells, which may not be there.
    pub(crate) fn bells(&self, robot: &RobotName) -> PathBuf {
        self.folder_of(robot).join("bells")
    }

    /// The robots that have a folder here, up or not.
    pub fn robots(&self) -> Vec<RobotName> {
        let mut robots: Vec<RobotName> = fs::read_dir(&self.folder)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
            .filter(|entry| !is_transport(&entry.file_name().to_string_lossy()))
            .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
            .collect();
        robots.sort();
        robots
    }

    /// Takes a robot's service for this process until the lock is dropped. A predecessor that is
    /// just dying is waited for, one second at most.
    ///
    /// # Errors
    /// Another process has it, or the file cannot be used.
    pub fn lock(&self, robot: &RobotName, role: Role) -> Result<Lock, LockError> {
        let role = role.to_string();
        let path = self.robot(robot).join(format!("{role}.lock"));
        Lock::take(&path, robot, &role, SUCCESSION)
    }

    /// Takes a robot's name for its supervisor until the lock is dropped.
    ///
    /// # Errors
    /// Another process has it, or the file cannot be used.
    pub fn lock_name(&self, robot: &RobotName) -> Result<Lock, LockError> {
        let path = self.robot(robot).join("up.lock");
        Lock::take(&path, robot, "up", core::time::Duration::ZERO)
    }

    /// The bus's segments in `/dev/shm`, of all its generations, whosever they are.
    pub fn segments(&self) -> Vec<PathBuf> {
        fs::read_dir(SHARED_MEMORY)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| {
                let name = entry.file_name();
                name.to_str()
                    .is_some_and(|name| name.starts_with(&self.stem))
            })
            .map(|entry| entry.path())
            .collect()
    }

    /// Removes the locks' files and the signs of life that killed processes have left.
    pub fn sweep_locks(&self) {
        for robot in self.robots() {
            self.sweep_locks_of(&robot);
        }
    }

    pub(crate) fn sweep_locks_of(&self, robot: &RobotName) {
        fs::read_dir(self.folder_of(robot))
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| {
                let end = path.extension().and_then(|end| end.to_str());
                end.is_some_and(|end| lock::ENDS.contains(&end))
            })
            .for_each(|path| lock::sweep(&path));
    }

    /// Removes everything of a damaged bus but the robots' folders, and begins its next generation,
    /// so that `robot`, none of whose services runs, can be started on a new one. Observers lose
    /// it. Where another robot is up nothing is removed; says whether it was.
    pub fn clear(&self, robot: &RobotName) -> bool {
        if self.up().keys().any(|other| other != robot) {
            return false;
        }
        let old = self.transport_folders();
        // From now on every new process joins the next generation.
        let _ = fs::create_dir(transport_folder(&self.folder, next(self.generation)));
        for segment in self.segments() {
            let _ = fs::remove_file(segment);
        }
        for folder in old {
            let _ = fs::remove_dir_all(folder);
        }
        let _ = fs::remove_file(self.bells(robot));
        true
    }

    /// Removes the bus with all its files, even while it is used. For a process that has made the
    /// bus for itself alone, as a measurement does.
    pub fn remove(&self) {
        for segment in self.segments() {
            let _ = fs::remove_file(segment);
        }
        let _ = fs::remove_dir_all(&self.folder);
    }

    /// Where the transport keeps its files: its root path.
    pub fn transport_folder(&self) -> PathBuf {
        transport_folder(&self.folder, self.generation)
    }

    /// Whether a new process would still find this bus.
    pub(crate) fn is_current(&self) -> bool {
        generation_in(&self.folder) == self.generation
    }

    /// The transport's folders of all generations: a process that joined the bus before it was
    /// cleared may have made a folder of an earlier generation again.
    pub(crate) fn transport_folders(&self) -> Vec<PathBuf> {
        (0..GENERATIONS.len())
            .map(|generation| transport_folder(&self.folder, generation))
            .filter(|folder| folder.is_dir())
            .collect()
    }

    /// Tells the transport where it lives.
    pub(crate) fn furnish(&self, config: &mut Config) -> Result<(), OpenError> {
        config.global.prefix = FileName::new(self.prefix.as_bytes())
            .expect("letters, digits and underscores are a file's name");
        let root = self.transport_folder();
        let bytes = root.as_os_str().as_encoded_bytes();
        let path = iceoryx2::prelude::Path::new(bytes)
            .map_err(|_| OpenError::RelativeFolder(self.folder.clone()))?;
        config.global.set_root_path(&path);
        Ok(())
    }
}

/// This user's folder where none is named.
fn own_folder() -> PathBuf {
    let uid = rustix::process::geteuid().as_raw();
    let system = Path::new(SYSTEM);
    if fs::symlink_metadata(system).is_ok_and(|found| found.is_dir() && found.uid() == uid) {
        return system.to_owned();
    }
    Path::new(SHARED_MEMORY).join(format!("lager-{uid}"))
}

/// A folder where another user's robots may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherPlace {
    /// The folder.
    pub folder: PathBuf,
    /// Its owner.
    pub uid: u32,
    /// The owner as `sudo -u` knows him.
    pub name: String,
}

impl fmt::Display for OtherPlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { folder, uid, name } = self;
        let folder = folder.display();
        write!(
            formatter,
            "{folder} belongs to UID {uid} ({name}); for that user's robots use `sudo -u {name} lager ...`"
        )
    }
}

/// Where the robots of other users on this machine would be, for a user who finds no robot.
pub fn other_places() -> Vec<OtherPlace> {
    let own = rustix::process::geteuid().as_raw();
    let beside = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let users = beside
        .filter(|entry| {
            let name = entry.file_name();
            let uid = name.to_str().and_then(|name| name.strip_prefix("lager-"));
            uid.is_some_and(|uid| uid.parse::<u32>().is_ok())
        })
        .map(|entry| entry.path());
    let mut places: Vec<OtherPlace> = std::iter::once(PathBuf::from(SYSTEM))
        .chain(users)
        .filter_map(|folder| {
            let found = fs::symlink_metadata(&folder).ok()?;
            (found.is_dir() && found.uid() != own).then(|| OtherPlace {
                folder,
                uid: found.uid(),
                name: user_name(found.uid()),
            })
        })
        .collect();
    places.sort_by(|a, b| a.folder.cmp(&b.folder));
    places
}

fn next(generation: usize) -> usize {
    // The first is for buses that were never cleared.
    generation % (GENERATIONS.len() - 1) + 1
}

/// The youngest generation there is. After the last letter that is an older one for the moment in
/// which the bus is cleared.
fn generation_in(folder: &Path) -> usize {
    (0..GENERATIONS.len())
        .rev()
        .find(|generation| transport_folder(folder, *generation).is_dir())
        .unwrap_or_default()
}

fn transport_folder(folder: &Path, generation: usize) -> PathBuf {
    folder.join(match generation {
        0 => TRANSPORT.to_owned(),
        _ => format!("{TRANSPORT}-{}", char::from(GENERATIONS[generation])),
    })
}

fn prefix(stem: &str, generation: usize) -> String {
    match generation {
        0 => format!("{stem}_"),
        _ => format!("{stem}{}_", char::from(GENERATIONS[generation])),
    }
}

/// Made from the folder by FNV-1a, folded to 32 bits: another folder is another bus.
fn stem_of(folder: &Path) -> String {
    let bytes = folder.as_os_str().as_encoded_bytes();
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    format!("lager_{:08x}", (hash >> 32) as u32 ^ hash as u32)
}

fn make(folder: &Path) -> Result<(), OpenError> {
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        // What stands there instead is for `check` to name.
        .or_else(|error| match fs::symlink_metadata(folder) {
            Ok(_) => Ok(()),
            Err(_) => Err(refused(folder, &error)),
        })
}

/// Refuses a folder that is not this user's alone.
fn check(folder: &Path) -> Result<(), OpenError> {
    let found = fs::symlink_metadata(folder).map_err(|error| refused(folder, &error))?;
    let folder = folder.to_owned();
    if !found.is_dir() {
        return Err(OpenError::NoFolder(folder));
    }
    if found.uid() != rustix::process::geteuid().as_raw() {
        return Err(OpenError::ForeignFolder {
            folder,
            uid: found.uid(),
            name: user_name(found.uid()),
        });
    }
    let mode = found.permissions().mode() & 0o777;
    if mode & 0o077 != 0 {
        return Err(OpenError::SharedFolder { folder, mode });
    }
    Ok(())
}

fn refused(folder: &Path, error: &std::io::Error) -> OpenError {
    OpenError::Folder {
        folder: folder.to_owned(),
        detail: error.to_string(),
    }
}

/// How `sudo -u` knows a user.
pub(crate) fn user_name(uid: u32) -> String {
    let users = fs::read_to_string("/etc/passwd").unwrap_or_default();
    users
        .lines()
        .find_map(|line| {
            let mut fields = line.split(':');
            let name = fields.next()?;
            (fields.nth(1)?.parse() == Ok(uid)).then(|| name.to_owned())
        })
        .unwrap_or_else(|| format!("'#{uid}'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder in which a test may do what it wants.
    struct Scene(PathBuf);

    impl Scene {
        fn new(name: &str) -> Self {
            let folder = Path::new(SHARED_MEMORY).join(format!("lpl{}{name}", std::process::id()));
            fs::create_dir(&folder).unwrap();
            Self(folder)
        }

        fn open(&self, name: &str) -> Result<Place, OpenError> {
            Place::open(Some(&self.0.join(name)))
        }
    }

    impl Drop for Scene {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn a_place_is_made_for_its_user_alone() {
        let scene = Scene::new("a");
        let place = scene.open("bus").unwrap();
        assert_eq!(mode(place.folder()), 0o700);
        let robot: RobotName = "r7".parse().unwrap();
        assert_eq!(mode(&place.robot(&robot)), 0o700);
        fs::create_dir(place.transport_folder()).unwrap();
        assert_eq!(place.robots(), [robot]);
        assert_eq!(scene.open("bus").unwrap(), place);
        assert_ne!(scene.open("other").unwrap().prefix(), place.prefix());
        assert_eq!(place.prefix().len(), PREFIX_LENGTH - 1);
    }

    #[test]
    fn a_cleared_bus_has_names_of_its_own_and_everybody_finds_them() {
        let scene = Scene::new("g");
        let robot: RobotName = "r7".parse().unwrap();
        let mut seen = Vec::new();
        for _ in 0..GENERATIONS.len() {
            let place = scene.open("bus").unwrap();
            seen.push(place.prefix().to_owned());
            assert!(place.clear(&robot));
            let next = scene.open("bus").unwrap();
            assert!(!next.prefix().starts_with(place.prefix()));
            assert_eq!(next.transport_folders(), [next.transport_folder()]);
            assert_eq!(next.robots(), []);
        }
        seen.sort();
        seen.dedup();
        assert_eq!(seen.len(), GENERATIONS.len());
    }

    #[test]
    fn who_was_on_a_bus_before_it_was_cleared_does_not_bring_it_back() {
        let scene = Scene::new("h");
        let old = scene.open("bus").unwrap();
        fs::create_dir(old.transport_folder()).unwrap();
        for _ in 0..3 {
            let place = scene.open("bus").unwrap();
            assert!(place.clear(&"r7".parse().unwrap()));
            fs::create_dir(old.transport_folder()).unwrap();
            assert_ne!(scene.open("bus").unwrap(), place);
            assert_ne!(scene.open("bus").unwrap(), old);
            assert!(!old.is_current());
        }
    }

    #[test]
    fn what_is_not_ours_alone_is_refused_with_what_to_do() {
        let scene = Scene::new("b");
        let bus = scene.0.join("bus");
        fs::create_dir(&bus).unwrap();
        fs::set_permissions(&bus, fs::Permissions::from_mode(0o750)).unwrap();
        let said = scene.open("bus").unwrap_err().to_string();
        assert!(
            said.contains("0750") && said.contains("chmod 700"),
            "{said}"
        );

        fs::set_permissions(&bus, fs::Permissions::from_mode(0o700)).unwrap();
        std::os::unix::fs::symlink(&bus, scene.0.join("link")).unwrap();
        fs::write(scene.0.join("file"), b"").unwrap();
        std::os::unix::fs::symlink("nowhere", scene.0.join("dangling")).unwrap();
        for name in ["link", "file", "dangling"] {
            let error = scene.open(name).unwrap_err();
            assert!(matches!(error, OpenError::NoFolder(_)), "{name}: {error}");
        }
    }

    #[test]
    fn a_relative_or_long_folder_is_refused() {
        let said = Place::open(Some(Path::new("var/lager"))).unwrap_err();
        assert!(said.to_string().contains("absolute"), "{said}");
        let scene = Scene::new("c");
        let length = |name: &str| scene.0.join(name).as_os_str().len();
        let longest = "x".repeat(LONGEST_FOLDER - length("x") + 1);
        assert!(scene.open(&longest).is_ok());
        let said = scene.open(&format!("{longest}x")).unwrap_err().to_string();
        assert!(
            said.contains("too long") && said.contains(&LONGEST_FOLDER.to_string()),
            "{said}"
        );
    }

    #[test]
    fn users_are_named_as_sudo_knows_them() {
        assert_eq!(user_name(0), "root");
        assert_eq!(user_name(4_123_456_789), "'#4123456789'");
    }
}
