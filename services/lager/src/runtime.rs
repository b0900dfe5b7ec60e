//! Where a running robot keeps its few files: the lock of its `up`, the effective configuration
//! the links to the simulated or emulated ports, and an emulated body's clock and EEPROMs.
//!
//! The folder is the user's own, one for each bus and robot. The lock is an flock, so that a
//! killed supervisor leaves nothing to clean up.

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Seek, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use rustix::fs::{FlockOperation, flock};

use crate::config::Config;

/// The effective configuration's file.
const CONFIG: &str = "lager.toml";

/// The folder of one robot on one bus.
#[derive(Clone, Debug)]
pub struct RuntimeFolder(PathBuf);

impl RuntimeFolder {
    /// Makes the folder, readable by this user alone.
    ///
    /// It is below `$XDG_RUNTIME_DIR`, or below `/tmp/lager-<uid>` where that is not set.
    pub fn create(config: &Config) -> Result<Self> {
        let uid = rustix::process::getuid().as_raw();
        let base = base();
        let folder = below(&base, config);
        fs::DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(&folder)
            .with_context(|| format!("cannot make the runtime folder {}", folder.display()))?;
        if fs::symlink_metadata(&base)?.uid() != uid {
            bail!(
                "{} belongs to another user; remove it or set XDG_RUNTIME_DIR",
                base.display()
            );
        }
        Ok(Self(folder))
    }

    /// The configuration that the running robot of `config`'s name was started with, `None` if
    /// none was started here.
    pub fn running(config: &Config) -> Result<Option<Config>> {
        let file = below(&base(), config).join(CONFIG);
        if !file.is_file() {
            return Ok(None);
        }
        Config::load(Some(&file)).map(Some)
    }

    /// The page for an emulated body's time. One that a killed robot has left is gone, so that
    /// nobody takes it for the new one.
    pub fn fresh_clock(&self) -> Result<PathBuf> {
        let path = self.0.join("clock");
        match fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error)
                .with_context(|| format!("cannot remove the old clock page {}", path.display())),
            _ => Ok(path),
        }
    }

    /// The folder for the EEPROMs of emulated boards.
    pub fn eeprom(&self) -> Result<PathBuf> {
        let path = self.0.join("eeprom");
        fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))?;
        Ok(path)
    }

    /// Where the simulated port of the sensor board is linked.
    pub fn sensor_port(&self) -> PathBuf {
        self.0.join("sensor.tty")
    }

    /// Where the simulated port of the steering board is linked.
    pub fn steering_port(&self) -> PathBuf {
        self.0.join("steering.tty")
    }

    /// Writes the effective configuration for the children and returns its path.
    pub fn write_config(&self, config: &Config) -> Result<PathBuf> {
        let path = self.0.join(CONFIG);
        let whole = || -> Result<()> {
            let new = self.0.join("lager.toml.new");
            fs::write(&new, toml::to_string(config)?)?;
            // Whoever reads it at this moment reads all of the old one or all of the new one.
            Ok(fs::rename(&new, &path)?)
        };
        whole().with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }

    /// Takes the robot's name for this process until the guard is dropped.
    pub fn lock(&self, name: &str) -> Result<NameLock> {
        let path = self.0.join("up.lock");
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .with_context(|| {
                format!(
                    "cannot open {}; was it just removed? Try again",
                    path.display()
                )
            })?;
        if flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
            let mut owner = String::new();
            file.read_to_string(&mut owner)?;
            return Err(NameTaken {
                name: name.to_owned(),
                pid: owner.trim().to_owned(),
            }
            .into());
        }
        // An `up` that was just ending may have removed the file between opening and locking.
        let still_there = fs::metadata(&path)
            .is_ok_and(|there| file.metadata().is_ok_and(|held| held.ino() == there.ino()));
        if !still_there {
            bail!("the robot `{name}` was just going down; try again");
        }
        file.set_len(0)?;
        file.rewind()?;
        write!(file, "{}", std::process::id())?;
        Ok(NameLock {
            _file: file,
            folder: self.clone(),
        })
    }
}

/// The folder of all of this user's robots.
fn base() -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(folder) if Path::new(&folder).is_dir() => PathBuf::from(folder).join("lager"),
        _ => PathBuf::from(format!("/tmp/lager-{}", rustix::process::getuid().as_raw())),
    }
}

fn below(base: &Path, config: &Config) -> PathBuf {
    base.join(config.bus.prefix.as_deref().unwrap_or("bus"))
        .join(&config.name)
}

/// Held by the one supervisor of a robot.
#[derive(Debug)]
pub struct NameLock {
    _file: File,
    folder: RuntimeFolder,
}

impl Drop for NameLock {
    /// Leaves no file behind after a clean stop.
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder.0);
        // The two folders above stay while another robot or bus lives in them.
        if let Some(bus) = self.folder.0.parent() {
            let _ = fs::remove_dir(bus);
            if let Some(base) = bus.parent() {
                let _ = fs::remove_dir(base);
            }
        }
    }
}

/// A second `up` of the same name.
#[derive(Debug)]
pub struct NameTaken {
    name: String,
    pid: String,
}

impl std::fmt::Display for NameTaken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "a robot named `{}` is already up (process {}); give this one another name with --name, or stop that one with Ctrl-C",
            self.name, self.pid
        )
    }
}

impl std::error::Error for NameTaken {}
