//! The files that outlive `lager up` and `lager station`: the warehouse that somebody has saved in
//! the panel, how a real robot is built, the orders that wait, and the history of the robots.
//!
//! ```text
//!   the warehouse    in the file that was named, else NAME.toml of a built-in one, else
//!                    warehouse.toml of real boards that nobody told of one, in
//!   the robot        how it is built: in the file that was named, else robot.toml of real boards, in
//!   the orders       and everything else, in
//!                    the state folder: --state or `state`, else
//!                      .state in the folder of the bus, if that was named, else
//!                      $STATE_DIRECTORY, else $XDG_STATE_HOME/lager, else ~/.local/state/lager
//!                        /ROBOT       of `lager up`
//!                        /.station    of `lager station`
//! ```
//! So two buses share nothing (tests rely on that), and the user's own robot finds its files again.
//!
//! A robot runs in a copy of the warehouse's file, made at its start. So a service that starts
//! again finds the same world, whatever somebody has saved since. Only when a person at the panel
//! puts a simulated robot into the saved warehouse, the copy is made anew, and everything starts
//! again in it (`Robot::renew`).

use std::env;
use std::fs::{self, DirBuilder};
use std::io::ErrorKind;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use lager_station::files;

/// In the folder of a bus. No robot can have this name.
const BESIDE_A_BUS: &str = ".state";
/// For `lager station`. No robot can have this name.
const STATION: &str = ".station";
/// How the robot is built.
const ROBOT: &str = "robot.toml";
/// The copy of the warehouse.
const RUNNING: &str = "running.toml";
/// The orders of a robot's own queue.
const ORDERS: &str = "orders.toml";
/// The queue of the robot's own station.
const QUEUE: &str = "queue.toml";
/// The folder of that station's history.
const HISTORY: &str = "history";

/// The folder of everything that is kept: the one that the user named, or one in the folder of the
/// bus if the user named that, or this user's own.
///
/// # Errors
/// Nothing says where it is.
pub fn root(named: Option<&Path>, bus: Option<&Path>) -> Result<PathBuf> {
    if let Some(folder) = named {
        return Ok(std::path::absolute(folder)?);
    }
    if let Some(bus) = bus {
        return Ok(std::path::absolute(bus)?.join(BESIDE_A_BUS));
    }
    let variable = |name| env::var_os(name).filter(|value| !value.is_empty());
    if let Some(folders) = variable("STATE_DIRECTORY") {
        // A system service may have several folders; the first one is for this.
        let folder = env::split_paths(&folders).next();
        return folder.context("STATE_DIRECTORY names no folder");
    }
    let is_whole = |folder: &PathBuf| folder.is_absolute();
    if let Some(folder) = variable("XDG_STATE_HOME")
        .map(PathBuf::from)
        .filter(is_whole)
    {
        return Ok(folder.join("lager"));
    }
    match variable("HOME").map(PathBuf::from).filter(is_whole) {
        Some(home) => Ok(home.join(".local/state/lager")),
        None => bail!(
            "nothing says where to keep the warehouse and the orders: HOME is not set; --state FOLDER does"
        ),
    }
}

/// The folder of one robot or of `lager station`, below the [`root`].
#[derive(Clone, Debug)]
pub struct StateFolder(PathBuf);

impl StateFolder {
    /// The folder of the robot `name`, which may not exist.
    #[must_use]
    pub fn of_robot(root: &Path, name: &str) -> Self {
        Self(root.join(name))
    }

    /// The folder of a station that runs by itself, which may not exist.
    pub fn path_of_station(root: &Path) -> PathBuf {
        root.join(STATION)
    }

    /// The folder of a station that runs by itself.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn of_station(root: &Path) -> Result<Self> {
        let folder = Self(Self::path_of_station(root));
        folder.make()?;
        Ok(folder)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Makes the folder, for this user alone.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn make(&self) -> Result<()> {
        let made = DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(&self.0);
        made.with_context(|| {
            format!(
                "cannot make {}, where warehouse and orders are kept; --state FOLDER takes another",
                self.0.display()
            )
        })
    }

    /// Where the changes of a built-in warehouse are kept. `None` = where a warehouse is kept that
    /// somebody else describes.
    #[must_use]
    pub fn warehouse(&self, builtin: Option<&str>) -> PathBuf {
        self.0.join(match builtin {
            Some(builtin) => format!("{builtin}.toml"),
            None => "warehouse.toml".to_owned(),
        })
    }

    /// Where the description of a real robot is kept.
    #[must_use]
    pub fn robot(&self) -> PathBuf {
        self.0.join(ROBOT)
    }

    /// Where a station keeps its queue.
    pub fn queue(&self) -> PathBuf {
        self.0.join(QUEUE)
    }

    /// Where a station keeps its history.
    pub fn history(&self) -> PathBuf {
        self.0.join(HISTORY)
    }

    /// Where the orders of a robot's own queue are kept.
    pub fn orders(&self) -> PathBuf {
        self.0.join(ORDERS)
    }

    /// The file of [`StateFolder::warehouse`], if there is one that `read` can read, and what to tell
    /// people.
    pub fn saved(
        &self,
        builtin: Option<&str>,
        read: impl FnOnce(&str) -> Result<()>,
    ) -> (Option<String>, Option<String>) {
        let file = self.warehouse(builtin);
        if !file.exists() {
            return (None, None);
        }
        let path = file.display().to_string();
        let without = match builtin {
            Some(builtin) => format!("it is the built-in `{builtin}`"),
            None => "there is none, and the robot waits for one".to_owned(),
        };
        match read(&path) {
            Ok(()) => {
                let note = format!(
                    "the warehouse is the one that was saved in {path}; without that file {without}"
                );
                (Some(path), Some(note))
            }
            Err(error) => {
                let aside = match files::set_aside(&file) {
                    Ok(aside) => format!("it is now {}", aside.display()),
                    Err(error) => format!("it stays there: {error}"),
                };
                let why = format!(
                    "the warehouse that was saved cannot be used: {error:#}; {aside}; without it {without}"
                );
                (None, Some(why))
            }
        }
    }

    /// Removes what has no meaning any more: the copy of the warehouse, an empty queue, and empty
    /// folders.
    pub fn tidy(&self) {
        let _ = fs::remove_file(self.0.join(RUNNING));
        for path in [self.queue(), self.orders()] {
            if fs::metadata(&path).is_ok_and(|file| file.len() == 0) {
                let _ = fs::remove_file(path);
            }
        }
        // They stay if there is something in them.
        let _ = fs::remove_dir(&self.0);
        if let Some(root) = self.0.parent().filter(|root| root.ends_with(BESIDE_A_BUS)) {
            let _ = fs::remove_dir(root);
        }
    }
}

/// The copy of the warehouse in which a robot runs.
#[derive(Clone, Debug)]
pub struct WarehouseCopy {
    /// Where.
    pub folder: StateFolder,
    /// The warehouse, in TOML.
    pub text: String,
}

impl WarehouseCopy {
    /// Writes it, also if somebody has removed the folder. Returns its file.
    ///
    /// # Errors
    /// The disk refuses the file.
    pub fn write(&self) -> Result<PathBuf> {
        self.folder.make()?;
        let path = self.folder.0.join(RUNNING);
        files::replace(&path, &self.text)
            .with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }
}

/// Reads a file that is kept. A damaged file is moved out of the way, and the user is told.
///
/// # Errors
/// The file exists and cannot be read.
pub fn read_kept<T>(path: &Path, notes: &mut Vec<String>) -> Result<T>
where
    T: serde::de::DeserializeOwned + Default,
{
    match files::read_toml(path) {
        Ok(kept) => Ok(kept),
        Err(files::ReadError::Read { error, .. }) if error.kind() == ErrorKind::NotFound => {
            Ok(T::default())
        }
        Err(error) if error.is_damage() => {
            let aside = files::set_aside(path)
                .with_context(|| format!("{error}, and it cannot be moved out of the way"))?;
            notes.push(format!(
                "what was kept is lost: {error}; it is now {}",
                aside.display()
            ));
            Ok(T::default())
        }
        Err(error) => Err(error.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_lies_with_a_bus_that_was_named_unless_somebody_says_otherwise() {
        let bus = Some(Path::new("/run/hall"));
        assert_eq!(root(None, bus).unwrap(), Path::new("/run/hall/.state"));
        let named = Some(Path::new("/srv/hall"));
        assert_eq!(root(named, bus).unwrap(), Path::new("/srv/hall"));
    }

    #[test]
    fn a_saved_warehouse_that_cannot_be_read_is_put_aside_and_told() {
        let root = std::env::temp_dir().join(format!("lager-saved-{}", std::process::id()));
        let folder = StateFolder::of_robot(&root, "r1");
        let small = Some("small");
        assert_eq!(folder.saved(small, |_| Ok(())), (None, None));
        folder.make().unwrap();
        fs::write(folder.warehouse(small), "size = ").unwrap();
        let (file, note) = folder.saved(small, |_| Ok(()));
        assert!(file.unwrap().ends_with("r1/small.toml"));
        assert!(note.unwrap().contains("was saved in"));
        let (file, note) = folder.saved(small, |_| bail!("no number"));
        assert_eq!(file, None);
        let note = note.unwrap();
        assert!(note.contains("no number; it is now"), "{note}");
        assert!(!folder.warehouse(small).exists());
        fs::write(folder.warehouse(None), "size = ").unwrap();
        let (file, note) = folder.saved(None, |_| Ok(()));
        assert!(file.unwrap().ends_with("r1/warehouse.toml"));
        assert!(note.unwrap().ends_with("the robot waits for one"));
        fs::remove_dir_all(root).unwrap();
    }

    #[test]
    fn no_robot_has_the_name_of_a_folder_beside_its_own() {
        for name in [STATION, BESIDE_A_BUS] {
            assert!(name.parse::<lager_home::UnitName>().is_err(), "{name}");
        }
    }
}
