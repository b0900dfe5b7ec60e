//! What outlives `lager up` and `lager station`: the warehouse that was saved in the panel, and the
//! orders that wait.
//!
//! ```text
//!   the warehouse    in the file that was named, else NAME.toml of a built-in one, in
//!   the orders       and everything else, in
//!                    the state folder: --state or `state`, else
//!                      .state in the folder of the bus, if that was named, else
//!                      $STATE_DIRECTORY, else $XDG_STATE_HOME/lager, else ~/.local/state/lager
//!                        /ROBOT       of `lager up`
//!                        /.station    of `lager station`
//! ```
//! So two buses, and a test's above all, share nothing, and the user's own robot finds what it had.
//!
//! What a robot runs in is a copy of the warehouse's file as it was at the start: a process that is
//! started again meanwhile finds the same world, whatever has been saved since.

use std::env;
use std::fs::{self, DirBuilder};
use std::io::ErrorKind;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use lager_plant::Warehouse;
use lager_station::files;

use crate::config::{self, Config};

/// In the folder of a bus; no robot can have the name.
const BESIDE_A_BUS: &str = ".state";
/// Of `lager station`; no robot can have the name.
const STATION: &str = ".station";
/// The warehouse that the robot runs in.
const RUNNING: &str = "running.toml";
/// The orders of a robot's own queue.
const ORDERS: &str = "orders.toml";
/// What its own station keeps of what waits.
const QUEUE: &str = "queue.toml";

/// The folder of everything that is kept.
///
/// # Errors
/// Nothing says where it is.
pub fn root(config: &Config) -> Result<PathBuf> {
    if let Some(folder) = &config.state {
        return Ok(std::path::absolute(folder)?);
    }
    if let Some(bus) = &config.bus.folder {
        return Ok(std::path::absolute(bus)?.join(BESIDE_A_BUS));
    }
    let variable = |name| env::var_os(name).filter(|value| !value.is_empty());
    if let Some(folders) = variable("STATE_DIRECTORY") {
        // A system service may have several; the first one is this one's.
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

/// The folder of one robot or of `lager station`.
#[derive(Clone, Debug)]
pub struct StateFolder(PathBuf);

impl StateFolder {
    /// That of `config`'s robot, which may not be there.
    ///
    /// # Errors
    /// Nothing says where it is.
    pub fn of_robot(config: &Config) -> Result<Self> {
        Ok(Self(root(config)?.join(&config.name)))
    }

    /// That of a station that runs by itself.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn of_station(config: &Config) -> Result<Self> {
        let folder = Self(root(config)?.join(STATION));
        folder.make()?;
        Ok(folder)
    }

    /// Makes it, for this user alone.
    ///
    /// # Errors
    /// It cannot be made.
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

    /// Where the changes of a warehouse are kept: in its file, or here if it is a built-in one.
    ///
    /// # Errors
    /// The current folder is gone.
    pub fn warehouse(&self, name: &str) -> Result<PathBuf> {
        match Warehouse::builtin(name) {
            Some(_) => Ok(self.0.join(format!("{name}.toml"))),
            None => Ok(std::path::absolute(name)?),
        }
    }

    /// Where a station keeps a warehouse that somebody else describes.
    pub fn warehouse_of_nobody(&self) -> PathBuf {
        self.0.join("warehouse.toml")
    }

    /// Where a station keeps what waits to be fetched.
    pub fn queue(&self) -> PathBuf {
        self.0.join(QUEUE)
    }

    /// Where the orders of a robot's own queue are kept.
    pub fn orders(&self) -> PathBuf {
        self.0.join(ORDERS)
    }

    /// The built-in warehouse `name` as it was saved here, if it was, and what to tell people.
    pub fn saved(&self, name: &str) -> (Option<String>, Option<String>) {
        let file = self.0.join(format!("{name}.toml"));
        if Warehouse::builtin(name).is_none() || !file.exists() {
            return (None, None);
        }
        let path = file.display();
        match config::warehouse(&path.to_string()) {
            Ok(_) => (
                Some(path.to_string()),
                Some(format!(
                    "the warehouse is the one that was saved in {path}; without that file it is the built-in `{name}`"
                )),
            ),
            Err(error) => {
                let aside = match files::set_aside(&file) {
                    Ok(aside) => format!("it is now {}", aside.display()),
                    Err(error) => format!("it stays there: {error}"),
                };
                let why = format!(
                    "the warehouse that was saved cannot be used: {error:#}; {aside}, and the built-in `{name}` is used"
                );
                (None, Some(why))
            }
        }
    }

    /// Leaves nothing behind that says nothing: no copy of the warehouse, no empty queue, and no
    /// folder without a file.
    pub fn tidy(&self) {
        let _ = fs::remove_file(self.0.join(RUNNING));
        for path in [self.queue(), self.orders()] {
            if fs::metadata(&path).is_ok_and(|file| file.len() == 0) {
                let _ = fs::remove_file(path);
            }
        }
        // They stay when there is something in them.
        let _ = fs::remove_dir(&self.0);
        if let Some(root) = self.0.parent().filter(|root| root.ends_with(BESIDE_A_BUS)) {
            let _ = fs::remove_dir(root);
        }
    }
}

/// The warehouse that a robot runs in, in a file of its own.
#[derive(Clone, Debug)]
pub struct World {
    /// Where.
    pub folder: StateFolder,
    /// What.
    pub warehouse: Warehouse,
}

impl World {
    /// Writes it, in a folder that may have been removed meanwhile; its file.
    ///
    /// # Errors
    /// The disk does not take it.
    pub fn write(&self) -> Result<PathBuf> {
        self.folder.make()?;
        let path = self.folder.0.join(RUNNING);
        files::replace(&path, &toml::to_string(&self.warehouse)?)
            .with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }
}

/// Reads a file that is kept; a damaged one is moved out of the way, which is said.
///
/// # Errors
/// The file is there and is not read.
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
    use crate::config::BusSection;

    #[test]
    fn what_is_kept_lies_with_a_bus_that_was_named_unless_somebody_says_otherwise() {
        let mut config = Config {
            bus: BusSection {
                folder: Some("/run/hall".into()),
                ..BusSection::default()
            },
            ..Config::default()
        };
        assert_eq!(root(&config).unwrap(), Path::new("/run/hall/.state"));
        config.state = Some("/srv/hall".into());
        assert_eq!(root(&config).unwrap(), Path::new("/srv/hall"));
    }

    #[test]
    fn no_robot_has_the_name_of_a_folder_beside_its_own() {
        for name in [STATION, BESIDE_A_BUS] {
            assert!(name.parse::<lager_ports::RobotName>().is_err(), "{name}");
        }
    }
}
