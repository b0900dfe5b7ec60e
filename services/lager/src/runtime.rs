//! What a running robot keeps in its folder of the bus ([`Place`]): the lock of its `up`, the
//! effective configuration, the links to the simulated or emulated ports, an emulated body's clock
//! and EEPROMs, what a station of its own has open, and the secret of its link. What outlives `up`
//! is `state.rs`'s.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use lager_lines::secret::Secret;
use lager_ports::{Life, Lock, Place, RobotName, StopPage, StopWord};

use crate::config::Config;
use crate::services::Service;

/// The effective configuration's file.
const CONFIG: &str = "lager.toml";
/// The links to the ports of a body that is none.
const SENSOR: &str = "sensor.tty";
const STEERING: &str = "steering.tty";
/// An emulated body's page of time, and the folder of its boards' EEPROMs.
const CLOCK: &str = "clock";
const EEPROM: &str = "eeprom";
/// The socket for a GaG of the robot's own station, and what waits there for the length of a
/// script.
const GAG: &str = "gag";
const QUEUE: &str = "queue.toml";
/// The secret by which the robot and its own station prove who they are.
const SECRET: &str = "secret";

/// The folder of one robot on one bus.
#[derive(Clone, Debug)]
pub struct RuntimeFolder {
    place: Place,
    robot: RobotName,
    path: PathBuf,
}

impl RuntimeFolder {
    /// Makes the folder, readable by this user alone.
    pub fn create(config: &Config) -> Result<Self> {
        let bus = config.bus()?;
        let place = bus.place()?;
        Ok(Self {
            path: place.robot(&bus.robot),
            robot: bus.robot,
            place,
        })
    }

    /// The configuration that the running robot of `config`'s name was started with, `None` if
    /// none was started here.
    pub fn running(config: &Config) -> Result<Option<Config>> {
        let bus = config.bus()?;
        let file = bus.place()?.folder_of(&bus.robot).join(CONFIG);
        if !file.is_file() {
            return Ok(None);
        }
        Config::load(Some(&file)).map(Some)
    }

    /// Begins to give signs of life as this service of `config`'s robot.
    ///
    /// # Errors
    /// The folder takes none, or another process is that service.
    pub fn live_as(config: &Config, service: Service) -> Result<Life> {
        let bus = config.bus()?;
        Ok(Life::begin(&bus.place()?, &bus.robot, service.command())?)
    }

    /// Where the own station of `config`'s robot listens for a GaG.
    pub fn gag(config: &Config) -> Result<PathBuf> {
        let bus = config.bus()?;
        Ok(bus.place()?.folder_of(&bus.robot).join(GAG))
    }

    /// Where the own station keeps what waits if nothing of it is to outlive the robot.
    pub fn queue(&self) -> PathBuf {
        self.path.join(QUEUE)
    }

    /// The file of the secret of `config`'s robot and its own station.
    pub fn secret(config: &Config) -> Result<PathBuf> {
        let bus = config.bus()?;
        Ok(bus.place()?.folder_of(&bus.robot).join(SECRET))
    }

    /// The page for an emulated body's time. A page that a killed robot has left is removed, so
    /// that no process takes it for the new one.
    pub fn fresh_clock(&self) -> Result<PathBuf> {
        let path = self.path.join(CLOCK);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error)
                .with_context(|| format!("cannot remove the old clock page {}", path.display())),
            _ => Ok(path),
        }
    }

    /// The folder for the EEPROMs of emulated boards. It outlives the robot, as a board's EEPROM
    /// outlives its power, and lies with the bus: until the machine restarts. A longer life is
    /// `[chip] eeprom`'s.
    pub fn eeprom(&self) -> Result<PathBuf> {
        let path = self.path.join(EEPROM);
        fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))?;
        Ok(path)
    }

    /// Where the simulated port of the sensor board is linked.
    pub fn sensor_port(&self) -> PathBuf {
        self.path.join(SENSOR)
    }

    /// Where the simulated port of the steering board is linked.
    pub fn steering_port(&self) -> PathBuf {
        self.path.join(STEERING)
    }

    /// Writes the effective configuration for the children and returns its path.
    pub fn write_config(&self, config: &Config) -> Result<PathBuf> {
        let path = self.path.join(CONFIG);
        let whole = || -> Result<()> {
            let new = self.path.join("lager.toml.new");
            fs::write(&new, toml::to_string(config)?)?;
            // A process that reads it at this moment reads all of the old one or all of the new
            // one.
            Ok(fs::rename(&new, &path)?)
        };
        whole().with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }

    /// Takes the robot's name for this process until the guard is dropped.
    pub fn lock(&self) -> Result<NameLock> {
        Ok(NameLock {
            lock: Some(self.place.lock_name(&self.robot)?),
            place: self.place.clone(),
            folder: self.path.clone(),
            secret: None,
        })
    }
}

/// Held by the one supervisor of a robot.
#[derive(Debug)]
pub struct NameLock {
    lock: Option<Lock>,
    place: Place,
    folder: PathBuf,
    /// What is in the folder for a station of the robot's own.
    secret: Option<Secret>,
}

impl NameLock {
    /// Makes a new secret for the robot and its own station, which only this user can read. It
    /// lasts as long as the name is held.
    ///
    /// # Errors
    /// The system has no random bytes, or the folder does not take it.
    pub fn make_secret(&mut self) -> Result<Secret> {
        let secret = Secret::random().context("the system gives no random bytes")?;
        write_secret(&self.folder, &secret)?;
        self.secret = Some(secret.clone());
        Ok(secret)
    }

    /// Whether the folder is still there, and the lock in it that everybody meets is this one.
    pub fn is_held(&self) -> bool {
        self.lock.as_ref().is_some_and(Lock::is_in_place)
    }

    /// Sees to it that others find this robot by its lock.
    pub fn renew(&self) {
        if let Some(lock) = &self.lock {
            lock.renew();
        }
    }

    /// Makes a folder that was removed anew, with what `config` needs in it.
    ///
    /// # Errors
    /// It cannot be made, or somebody has taken the name meanwhile.
    pub fn restore(&mut self, config: &Config) -> Result<()> {
        let folder = RuntimeFolder::create(config)?;
        if !self.is_held() {
            let secret = self.secret.take();
            *self = folder.lock()?;
            self.secret = secret;
        }
        folder.write_config(config)?;
        if let Some(secret) = &self.secret {
            write_secret(&self.folder, secret)?;
        }
        if let Some(eeprom) = &config.chip.eeprom {
            fs::create_dir_all(eeprom)
                .with_context(|| format!("cannot make {}", eeprom.display()))?;
        }
        Ok(())
    }
}

impl Drop for NameLock {
    /// Leaves nothing of `up` behind after a clean stop but a stop that is set, and what boards
    /// have written into their EEPROM.
    fn drop(&mut self) {
        if self.is_held() {
            for name in [CONFIG, SENSOR, STEERING, CLOCK, GAG, QUEUE, SECRET] {
                let _ = fs::remove_file(self.folder.join(name));
            }
            // It stays when it has something in it.
            let _ = fs::remove_dir(self.folder.join(EEPROM));
            StopWord::tidy(&self.folder.join(StopPage::FILE));
            // A service that was killed has left its own.
            self.place.sweep_locks();
        }
        self.lock = None;
        // It stays while anything else is in it.
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Writes a file that only this user can read, whatever was there before.
fn write_secret(folder: &Path, secret: &Secret) -> Result<()> {
    let path = folder.join(SECRET);
    let new = folder.join("secret.new");
    let whole = || -> std::io::Result<()> {
        let _ = fs::remove_file(&new);
        let mut options = OpenOptions::new();
        let mut file = options
            .write(true)
            .create_new(true)
            .mode(0o600)
            .open(&new)?;
        writeln!(file, "{}", secret.as_str())?;
        fs::rename(&new, &path)
    };
    whole().with_context(|| format!("cannot write {}", path.display()))
}
