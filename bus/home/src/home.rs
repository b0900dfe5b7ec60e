//! [`Home`]: where a bus lives, which is one folder of its user, and files in `/dev/shm`.
//!
//! A home belongs to a family of units, such as the robots of one user. Each unit has a name, a
//! folder of its own, and topics whose names begin with the family's name and the unit's name.
//!
//! ```text
//!     <folder>/              0700, owned by the user who runs the units
//!         iceoryx2/          the transport's own files and sockets; `iceoryx2-1/` after the bus
//!                            has been cleared once, and so on
//!         <unit>/            0700
//!             bells          the board of bells (`lager-wake`)
//!             up.lock, bridge.lock, logic.lock …      see [`Lock`]
//!             comm.life …                             see [`Life`](crate::Life)
//!         whatever the application keeps there: a stop word, a clock page, a configuration
//!     /dev/shm/lager_<8 hex>_…      the transport's segments; the number is a hash of the folder
//! ```
//!
//! When a damaged bus is cleared, the new bus gets other names for its files (a new generation). An
//! observer of the old bus may still live, and it removes files by their old names when it ends.
//!
//! The folder is `/run/<family>` if that belongs to this user, as for a system service, else
//! `/dev/shm/<family>-<uid>`. No program that tidies up `/tmp` and no other session of the user can
//! remove a part of it. A folder that other users may enter, or that is a link, is refused, so
//! nobody else can put files there. Two processes that take the same unit's name meet in the same
//! folder. A sweep removes only files of this user's bus.

use std::fs::{self, DirBuilder};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use lager_sample::Part;

use crate::error::HomeError;
use crate::lock::{self, Lock, LockError, SUCCESSION};
use crate::name::{TRANSPORT, UnitName, is_transport};
use crate::shortage::SHARED_MEMORY;

/// The longest path of a socket, in bytes.
pub const LONGEST_SOCKET: usize = 107;

/// The part of a socket's path besides the folder and the prefix: the transport's folder with a
/// slash before and behind it, a 128-bit number, `.event`.
const BELOW_FOLDER: usize = 1 + TRANSPORT.len() + 2 + 1 + 39 + 6;

/// The length of `lager_`, eight digits, the generation, `_`.
const PREFIX_LENGTH: usize = 16;

/// The marks of a bus's generations: `0` for the first, then each other digit and letter in turn.
const GENERATIONS: &[u8] = b"0123456789abcdefghijklmnopqrstuvwxyz";

/// The longest folder, in bytes.
const LONGEST_FOLDER: usize = LONGEST_SOCKET - BELOW_FOLDER - PREFIX_LENGTH;

/// A bus's folder. It exists, and only this user may enter it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Home {
    folder: PathBuf,
    /// The beginning of the names of all generations' segments.
    stem: String,
    /// An index of [`GENERATIONS`].
    generation: usize,
    prefix: String,
}

impl Home {
    /// Opens the home at `folder`, or this user's own of the family. Makes a missing folder.
    ///
    /// # Errors
    /// The folder cannot be used, or other users may enter it.
    pub fn open(family: &str, folder: Option<&Path>) -> Result<Self, HomeError> {
        let folder = folder.map_or_else(|| own_folder(family), Path::to_owned);
        if !folder.is_absolute() {
            return Err(HomeError::RelativeFolder(folder));
        }
        make(&folder)?;
        check(&folder)?;
        let folder = fs::canonicalize(&folder).map_err(|error| refused(&folder, &error))?;
        if folder.as_os_str().len() > LONGEST_FOLDER {
            return Err(HomeError::FolderTooLong {
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

    /// The folder's path, with links resolved.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The beginning of the names of the bus's segments in `/dev/shm`.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// A unit's folder. Makes it if it is missing; if that fails, opening a file in it reports why.
    pub fn unit(&self, unit: &UnitName) -> PathBuf {
        let folder = self.folder_of(unit);
        let _ = make(&folder);
        folder
    }

    /// A unit's folder, which may not exist.
    pub fn folder_of(&self, unit: &UnitName) -> PathBuf {
        self.folder.join(unit.as_str())
    }

    /// The file of a unit's board of bells, which may not exist.
    pub fn bells(&self, unit: &UnitName) -> PathBuf {
        self.folder_of(unit).join("bells")
    }

    /// The units that have a folder here, running or not.
    pub fn units(&self) -> Vec<UnitName> {
        let mut units: Vec<UnitName> = fs::read_dir(&self.folder)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
            .filter(|entry| !is_transport(&entry.file_name().to_string_lossy()))
            .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
            .collect();
        units.sort();
        units
    }

    /// Makes this process the only one that plays `part` in a unit, until the lock is dropped. If
    /// the last one is just ending, waits for it, at most one second.
    ///
    /// # Errors
    /// Another process plays the part, or the file cannot be used.
    pub fn lock(&self, unit: &UnitName, part: impl Into<Part>) -> Result<Lock, LockError> {
        let part = part.into().name();
        let path = self.unit(unit).join(format!("{part}.lock"));
        Lock::take(&path, unit, part, SUCCESSION)
    }

    /// Whether a process plays `part` in a unit at present.
    pub fn is_held(&self, unit: &UnitName, part: impl Into<Part>) -> bool {
        let part = part.into().name();
        lock::is_held(&self.folder_of(unit).join(format!("{part}.lock")))
    }

    /// Makes this process the only supervisor of a unit, until the lock is dropped.
    ///
    /// # Errors
    /// Another process supervises it, or the file cannot be used.
    pub fn lock_name(&self, unit: &UnitName) -> Result<Lock, LockError> {
        let path = self.unit(unit).join("up.lock");
        Lock::take(&path, unit, "up", core::time::Duration::ZERO)
    }

    /// The bus's segments in `/dev/shm`, of all generations and all owners.
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

    /// Removes the lock files and the signs of life that killed processes have left.
    pub fn sweep_locks(&self) {
        for unit in self.units() {
            self.sweep_locks_of(&unit);
        }
    }

    /// Does this for one unit.
    pub fn sweep_locks_of(&self, unit: &UnitName) {
        fs::read_dir(self.folder_of(unit))
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

    /// Removes everything of a damaged bus except the units' folders, and begins its next
    /// generation, so that `unit` can be started on a new bus. No service of it may run. Observers
    /// lose the old bus. Removes nothing if another unit is up. Returns whether the bus was
    /// removed.
    pub fn clear(&self, unit: &UnitName) -> bool {
        if self.up().keys().any(|other| other != unit) {
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
        let _ = fs::remove_file(self.bells(unit));
        true
    }

    /// Removes the bus with all its files, even while it is in use. For a process that has made the
    /// bus for itself alone, such as a measurement.
    pub fn remove(&self) {
        for segment in self.segments() {
            let _ = fs::remove_file(segment);
        }
        let _ = fs::remove_dir_all(&self.folder);
    }

    /// The folder in which the transport keeps its files (its root path).
    pub fn transport_folder(&self) -> PathBuf {
        transport_folder(&self.folder, self.generation)
    }

    /// Whether a new process would still find this bus.
    pub fn is_current(&self) -> bool {
        generation_in(&self.folder) == self.generation
    }

    /// The transport's folders of all generations. A process that joined the bus before it was
    /// cleared may have made an earlier generation's folder again.
    pub fn transport_folders(&self) -> Vec<PathBuf> {
        (0..GENERATIONS.len())
            .map(|generation| transport_folder(&self.folder, generation))
            .filter(|folder| folder.is_dir())
            .collect()
    }
}

/// This user's folder, if the caller names none.
fn own_folder(family: &str) -> PathBuf {
    let uid = rustix::process::geteuid().as_raw();
    let system = system_folder(family);
    if fs::symlink_metadata(&system).is_ok_and(|found| found.is_dir() && found.uid() == uid) {
        return system;
    }
    Path::new(SHARED_MEMORY).join(format!("{family}-{uid}"))
}

/// The folder of a system service.
fn system_folder(family: &str) -> PathBuf {
    Path::new("/run").join(family)
}

/// A folder in which another user's units may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherHome {
    /// The folder.
    pub folder: PathBuf,
    /// Its owner.
    pub uid: u32,
    /// The owner's name, as `sudo -u` takes it.
    pub name: String,
}

/// Folders of other users' units on this machine, for a user who finds no unit.
pub fn other_homes(family: &str) -> Vec<OtherHome> {
    let own = rustix::process::geteuid().as_raw();
    let beside = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let users = beside
        .filter(|entry| {
            let name = entry.file_name();
            let uid = name
                .to_str()
                .and_then(|name| name.strip_prefix(family)?.strip_prefix('-'));
            uid.is_some_and(|uid| uid.parse::<u32>().is_ok())
        })
        .map(|entry| entry.path());
    let mut homes: Vec<OtherHome> = std::iter::once(system_folder(family))
        .chain(users)
        .filter_map(|folder| {
            let found = fs::symlink_metadata(&folder).ok()?;
            (found.is_dir() && found.uid() != own).then(|| OtherHome {
                folder,
                uid: found.uid(),
                name: user_name(found.uid()),
            })
        })
        .collect();
    homes.sort_by(|a, b| a.folder.cmp(&b.folder));
    homes
}

fn next(generation: usize) -> usize {
    // The first generation is for buses that were never cleared.
    generation % (GENERATIONS.len() - 1) + 1
}

/// The newest generation that exists. After the last letter the count starts again, so for the
/// moment in which the bus is cleared this is an older one.
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

/// A hash of the folder's path (FNV-1a, folded to 32 bits), so that another folder is another bus.
fn stem_of(folder: &Path) -> String {
    let bytes = folder.as_os_str().as_encoded_bytes();
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    format!("lager_{:08x}", (hash >> 32) as u32 ^ hash as u32)
}

fn make(folder: &Path) -> Result<(), HomeError> {
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        // If something else stands there, `check` says what.
        .or_else(|error| match fs::symlink_metadata(folder) {
            Ok(_) => Ok(()),
            Err(_) => Err(refused(folder, &error)),
        })
}

/// Refuses a folder that is not this user's alone.
fn check(folder: &Path) -> Result<(), HomeError> {
    let found = fs::symlink_metadata(folder).map_err(|error| refused(folder, &error))?;
    let folder = folder.to_owned();
    if !found.is_dir() {
        return Err(HomeError::NoFolder(folder));
    }
    if found.uid() != rustix::process::geteuid().as_raw() {
        return Err(HomeError::ForeignFolder {
            folder,
            uid: found.uid(),
            name: user_name(found.uid()),
        });
    }
    let mode = found.permissions().mode() & 0o777;
    if mode & 0o077 != 0 {
        return Err(HomeError::SharedFolder { folder, mode });
    }
    Ok(())
}

fn refused(folder: &Path, error: &std::io::Error) -> HomeError {
    HomeError::Folder {
        folder: folder.to_owned(),
        detail: error.to_string(),
    }
}

/// A user's name, as `sudo -u` takes it.
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

        fn open(&self, name: &str) -> Result<Home, HomeError> {
            Home::open("lager", Some(&self.0.join(name)))
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
        let home = scene.open("bus").unwrap();
        assert_eq!(mode(home.folder()), 0o700);
        let unit: UnitName = "r7".parse().unwrap();
        assert_eq!(mode(&home.unit(&unit)), 0o700);
        fs::create_dir(home.transport_folder()).unwrap();
        assert_eq!(home.units(), [unit]);
        assert_eq!(scene.open("bus").unwrap(), home);
        assert_ne!(scene.open("other").unwrap().prefix(), home.prefix());
        assert_eq!(home.prefix().len(), PREFIX_LENGTH - 1);
    }

    #[test]
    fn a_cleared_bus_has_names_of_its_own_and_everybody_finds_them() {
        let scene = Scene::new("g");
        let unit: UnitName = "r7".parse().unwrap();
        let mut seen = Vec::new();
        for _ in 0..GENERATIONS.len() {
            let home = scene.open("bus").unwrap();
            seen.push(home.prefix().to_owned());
            assert!(home.clear(&unit));
            let next = scene.open("bus").unwrap();
            assert!(!next.prefix().starts_with(home.prefix()));
            assert_eq!(next.transport_folders(), [next.transport_folder()]);
            assert_eq!(next.units(), []);
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
            let home = scene.open("bus").unwrap();
            assert!(home.clear(&"r7".parse().unwrap()));
            fs::create_dir(old.transport_folder()).unwrap();
            assert_ne!(scene.open("bus").unwrap(), home);
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
            assert!(matches!(error, HomeError::NoFolder(_)), "{name}: {error}");
        }
    }

    #[test]
    fn a_relative_or_long_folder_is_refused() {
        let said = Home::open("lager", Some(Path::new("var/lager"))).unwrap_err();
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
