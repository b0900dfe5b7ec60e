//! The files of a running robot, in its folder of the bus ([`Home`]): the lock of its `up`, the
//! effective configuration, the links to the simulated or emulated ports, an emulated body's clock,
//! the boards' EEPROMs, the files of a station of its own, and the secret of its link.
//! `state_folder.rs` has the files that outlive `up`.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use lager_home::{Home, Life, Lock, UnitName, Watched};
use lager_lines::secret::Secret;
use lager_ports::BusConfig;
use lager_stop::{StopPage, StopWord};
use lager_topics::{LAGER, Role, StopCause};
use rustix::process::{Pid, Signal, kill_process};

use crate::service::Service;

/// The effective configuration's file.
const CONFIG: &str = "lager.toml";
/// The links to the ports of a simulated or emulated body.
const SENSOR: &str = "sensor.tty";
const STEERING: &str = "steering.tty";
/// An emulated body's clock page, and the folder of its boards' EEPROMs.
const CLOCK: &str = "clock";
const EEPROM: &str = "eeprom";
/// The EEPROMs of a simulated body's boards.
const EEPROMS: [&str; 2] = ["sensor.eeprom", "steering.eeprom"];
/// The socket for a GaG of the robot's own station; one in the bus's folder is a shared station's.
pub const GAG: &str = "gag";
/// The station's queue while a script runs.
const QUEUE: &str = "queue.toml";
/// The secret by which the robot and its own station recognise each other.
const SECRET: &str = "secret";

/// The folder of one robot on one bus.
#[derive(Clone, Debug)]
pub struct RuntimeFolder {
    place: Home,
    robot: UnitName,
    path: PathBuf,
}

impl RuntimeFolder {
    /// Makes the folder, for this user alone.
    ///
    /// # Errors
    /// The folder of the bus cannot be found.
    pub fn create(bus: &BusConfig) -> Result<Self> {
        let place = bus.home()?;
        Ok(Self {
            path: place.unit(&bus.unit),
            robot: bus.unit.clone(),
            place,
        })
    }

    /// The file with the configuration with which the robot of `bus` was started; `None` if none
    /// was started here.
    ///
    /// # Errors
    /// The folder of the bus cannot be found.
    pub fn running(bus: &BusConfig) -> Result<Option<PathBuf>> {
        let file = file(bus, CONFIG)?;
        Ok(file.is_file().then_some(file))
    }

    /// Asks the `up` of the robot of `bus` to stop it and to start it again with what is saved now.
    /// Returns at once.
    ///
    /// # Errors
    /// No `up` runs the robot, or it is another user's.
    pub fn ask_to_start_again(bus: &BusConfig) -> Result<()> {
        let mut up = bus.home()?.up();
        let holders = up.remove(&bus.unit).unwrap_or_default();
        let supervisor = holders.iter().find(|holder| holder.what == "up");
        let supervisor = supervisor
            .and_then(|holder| Pid::from_raw(holder.pid.cast_signed()))
            .with_context(|| {
                format!(
                    "the robot `{}` was not started by `lager up`, which alone can start it again",
                    bus.unit
                )
            })?;
        kill_process(supervisor, Signal::USR1)
            .with_context(|| format!("process {supervisor}, which runs the robot, cannot be asked"))
    }

    /// Another one each time the robot of `bus` starts again as a whole; `None` if none was started
    /// here.
    ///
    /// # Errors
    /// The folder of the bus cannot be found.
    pub fn start_of(bus: &BusConfig) -> Result<Option<impl PartialEq + use<>>> {
        let written = fs::metadata(file(bus, CONFIG)?).ok();
        Ok(written.map(|file| (file.ino(), file.mtime(), file.mtime_nsec())))
    }

    /// Begins to give signs of life as this service of the robot of `bus`.
    ///
    /// # Errors
    /// The folder cannot be written, or another process is that service.
    pub fn live_as(bus: &BusConfig, service: Service) -> Result<Life> {
        Ok(Life::begin(&bus.home()?, &bus.unit, service.command())?)
    }

    /// Where the own station of the robot of `bus` listens for a GaG.
    ///
    /// # Errors
    /// The folder of the bus cannot be found.
    pub fn gag(bus: &BusConfig) -> Result<PathBuf> {
        file(bus, GAG)
    }

    /// Where the own station keeps its queue if that must not outlive the robot.
    pub fn queue(&self) -> PathBuf {
        self.path.join(QUEUE)
    }

    /// The file of the secret of the robot of `bus` and its own station.
    ///
    /// # Errors
    /// The folder of the bus cannot be found.
    pub fn secret(bus: &BusConfig) -> Result<PathBuf> {
        file(bus, SECRET)
    }

    /// The page for an emulated body's time. Removes the page of a killed robot, so that no process
    /// takes it for the new one.
    ///
    /// # Errors
    /// The old one cannot be removed.
    pub fn fresh_clock(&self) -> Result<PathBuf> {
        self.without(CLOCK)?;
        Ok(self.path.join(CLOCK))
    }

    /// Makes sure that a file of an earlier robot is not there.
    fn without(&self, file: &str) -> Result<()> {
        let path = self.path.join(file);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(error).with_context(|| format!("cannot remove the old {}", path.display()))
            }
            _ => Ok(()),
        }
    }

    /// The folder for the EEPROMs of emulated boards. It outlives the robot, as a board's EEPROM
    /// outlives its power, but not a restart of the machine. `[chip] eeprom` names a folder that
    /// lasts.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn eeprom(&self) -> Result<PathBuf> {
        let path = self.path.join(EEPROM);
        fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))?;
        Ok(path)
    }

    /// The folder for the EEPROMs of simulated boards: this one. They outlive the simulator, and
    /// go with the robot. Removes those of a killed robot, so that the new one's are erased.
    ///
    /// # Errors
    /// The old ones cannot be removed.
    pub fn fresh_eeproms(&self) -> Result<PathBuf> {
        EEPROMS.iter().try_for_each(|file| self.without(file))?;
        Ok(self.path.clone())
    }

    /// The link to the simulated port of the sensor board.
    pub fn sensor_port(&self) -> PathBuf {
        self.path.join(SENSOR)
    }

    /// The link to the simulated port of the steering board.
    pub fn steering_port(&self) -> PathBuf {
        self.path.join(STEERING)
    }

    /// Writes the configuration with which the robot starts, in TOML.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn write_config(&self, config: &str) -> Result<()> {
        let path = self.path.join(CONFIG);
        let whole = || -> std::io::Result<()> {
            let new = self.path.join("lager.toml.new");
            fs::write(&new, config)?;
            // A process that reads it meanwhile reads either the whole old one or the whole new
            // one.
            fs::rename(&new, &path)
        };
        whole().with_context(|| format!("cannot write {}", path.display()))
    }

    /// Takes the robot's name for this process until the guard is dropped.
    ///
    /// # Errors
    /// Another process has it, or the lock cannot be written.
    pub fn lock(&self) -> Result<NameLock> {
        Ok(NameLock {
            lock: Some(self.place.lock_name(&self.robot)?),
            place: self.place.clone(),
            robot: self.robot.clone(),
            folder: self.path.clone(),
            secret: None,
        })
    }
}

/// The one supervisor of a robot holds this.
#[derive(Debug)]
pub struct NameLock {
    lock: Option<Lock>,
    place: Home,
    robot: UnitName,
    folder: PathBuf,
    /// The files for a station of the robot's own.
    secret: Option<Secret>,
}

impl NameLock {
    /// Makes a new secret for the robot and its own station, which only this user can read. It
    /// exists as long as this process has the robot's name.
    ///
    /// # Errors
    /// The system has no random bytes, or the folder cannot be written.
    pub fn make_secret(&mut self) -> Result<Secret> {
        let secret = Secret::random().context("the system gives no random bytes")?;
        write_secret(&self.folder, &secret)?;
        self.secret = Some(secret.clone());
        Ok(secret)
    }

    /// Whether the folder still exists, with this very lock in it.
    pub fn is_held(&self) -> bool {
        self.lock.as_ref().is_some_and(Lock::is_in_place)
    }

    /// Stops the robot, and replaces a stop that is set: who releases the earlier one does not
    /// know of this one.
    ///
    /// # Errors
    /// The word cannot be written.
    pub fn stop(&self) -> Result<()> {
        StopWord::set(
            &self.folder.join(StopPage::FILE),
            Role::Supervisor,
            StopCause::Ordered,
        )?;
        Ok(())
    }

    /// Stops the robot unless a stop is set.
    ///
    /// # Errors
    /// The word cannot be read or written.
    pub fn hold(&self) -> Result<()> {
        let told = StopWord::read(&self.folder.join(StopPage::FILE))?;
        match told.and_then(|told| told.stop()) {
            Some(_) => Ok(()),
            None => self.stop(),
        }
    }

    /// Makes sure that others find this robot by its lock.
    pub fn renew(&self) {
        if let Some(lock) = &self.lock {
            lock.renew();
        }
    }

    /// Tells others how the services are. If a write fails, they read the next one.
    pub fn tell(&self, services: &[Watched]) {
        if self.is_held() {
            let _ = self.place.write_watched(&self.robot, services);
        }
    }

    /// Makes a removed folder again, with the configuration, and the folder of the EEPROMs of
    /// emulated boards.
    ///
    /// # Errors
    /// The folder cannot be made, or another process has taken the name meanwhile.
    pub fn restore(&mut self, bus: &BusConfig, config: &str, eeprom: Option<&Path>) -> Result<()> {
        let folder = RuntimeFolder::create(bus)?;
        if !self.is_held() {
            let secret = self.secret.take();
            *self = folder.lock()?;
            self.secret = secret;
        }
        folder.write_config(config)?;
        if let Some(secret) = &self.secret {
            write_secret(&self.folder, secret)?;
        }
        if let Some(eeprom) = eeprom {
            fs::create_dir_all(eeprom)
                .with_context(|| format!("cannot make {}", eeprom.display()))?;
        }
        Ok(())
    }
}

impl Drop for NameLock {
    /// Removes everything of `up` after a clean end, except a stop that is set and the EEPROM of
    /// emulated boards.
    fn drop(&mut self) {
        if self.is_held() {
            self.place.forget(&self.robot, LAGER.kept);
            // It stays if there is something in it.
            let _ = fs::remove_dir(self.folder.join(EEPROM));
            StopWord::tidy(&self.folder.join(StopPage::FILE));
            // A killed service has left its sign of life.
            self.place.sweep_locks();
        }
        self.lock = None;
        // It stays if there is something else in it.
        let _ = fs::remove_dir(&self.folder);
    }
}

/// A file in the folder of the robot of `bus`.
fn file(bus: &BusConfig, name: &str) -> Result<PathBuf> {
    Ok(bus.home()?.folder_of(&bus.unit).join(name))
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

#[cfg(test)]
mod tests {
    use std::process;

    use super::*;

    /// A file that this list lacks would stay for ever in the folder of a robot that was killed.
    #[test]
    fn all_that_a_robot_keeps_is_known_to_the_application() {
        let mut known = vec![CONFIG, SENSOR, STEERING, CLOCK, EEPROM, GAG, QUEUE, SECRET];
        known.extend(EEPROMS);
        for name in &known {
            assert!(LAGER.kept.contains(name), "{name}");
        }
        assert_eq!(LAGER.kept.len(), known.len(), "{:?}", LAGER.kept);
    }

    #[test]
    fn of_what_is_told_and_half_written_nothing_stays() {
        let at = PathBuf::from(format!("/dev/shm/lpkept{}", process::id()));
        let place = Home::open("lager", Some(&at)).expect("a folder");
        let robot = UnitName::default();
        let folder = place.unit(&robot);
        for name in LAGER.kept {
            fs::write(folder.join(name), "").expect("a file");
            fs::write(folder.join(format!("{name}.new")), "").expect("a file");
        }
        place.write_watched(&robot, &[]).expect("a file");
        fs::write(folder.join("services.new"), "").expect("a file");
        place.listen_asked(&robot).expect("a file");
        fs::write(folder.join("own.notes"), "").expect("a file");
        place.forget(&robot, LAGER.kept);
        let left = fs::read_dir(&folder).expect("a folder").flatten();
        let left: Vec<_> = left.map(|entry| entry.file_name()).collect();
        assert_eq!(left, ["own.notes"]);
        place.remove();
    }
}
