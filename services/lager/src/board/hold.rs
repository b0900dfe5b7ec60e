//! [`Hold`]: nobody else has the boards while it lives.
//!
//! If the robot is down, it is the robot's name, so that nobody starts it. If the robot is up, it is
//! the loan of the bridge's ports (`lager_bridge::loan`): the robot is stopped, and the bridge lets
//! go of them. Only one `lager board` works on the boards of a robot.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use lager_bridge::loan::BORROWER;
use lager_bridge::serial::OpenPortError;
use lager_home::{Home, Lock, LockError, UnitName};
use lager_sample::Part;
use lager_supervisor::console;
use lager_topics::{Role, StopCause};
use lager_wake::Shutdown;

use super::{BoardLine, find, open};
use crate::config::Config;
use crate::exit::{InItsPlace, InUse};
use crate::stop;

/// How long a bridge may take to let go of its ports, in real time.
const LETS_GO: Duration = Duration::from_secs(5);
const LOOK: Duration = Duration::from_millis(20);

/// What makes this process the only one that has the boards. Fields are dropped in their order.
pub struct Hold {
    _borrowed: Lock,
    taken: Option<Taken>,
    name: String,
}

impl Hold {
    /// Gets the boards of the robot in `config`. Stops the robot if it is up.
    ///
    /// # Errors
    /// Somebody else works on them, or the robot cannot be stopped.
    pub fn get(config: &Config) -> Result<Self> {
        let bus = config.bus()?;
        let home = bus.home()?;
        let taken = match take_robot(config) {
            Ok(taken) => Some(taken),
            // Others take the name for a moment as well.
            Err(error) if error.is::<InUse>() && home.is_held(&bus.unit, Role::Bridge) => None,
            Err(error) => return Err(error),
        };
        // If somebody works on the boards already, the robot stands, and this fails below.
        if taken.is_none() && !home.is_held(&bus.unit, BORROWER) {
            stop_for_work(config, bus.unit.as_str())?;
        }
        match home.lock(&bus.unit, BORROWER) {
            Ok(borrowed) => Ok(Self {
                _borrowed: borrowed,
                taken,
                name: bus.unit.to_string(),
            }),
            Err(LockError::Service { unit, pid, .. }) => Err(InUse { name: unit, pid }.into()),
            Err(error) => Err(error.into()),
        }
    }

    /// Opens the port of a board, as soon as the bridge has let go of it.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(
        &self,
        config: &Config,
        path: &Path,
        baud: Option<u32>,
        shutdown: &Shutdown,
    ) -> Result<BoardLine> {
        let start = Instant::now();
        loop {
            let opened = open(config, path, baud, shutdown);
            let Err(error) = &opened else {
                return opened;
            };
            let is_busy = matches!(error.downcast_ref(), Some(OpenPortError::Busy { .. }));
            let waits = self.taken.is_none() && is_busy && start.elapsed() < LETS_GO;
            if !waits || shutdown.is_requested() {
                return opened;
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Finds the ports of both boards, as soon as the bridge has let go of them.
    ///
    /// # Errors
    /// A board was not found.
    pub fn find(
        &self,
        config: &Config,
        baud: Option<u32>,
        shutdown: &Shutdown,
    ) -> Result<Vec<PathBuf>> {
        let start = Instant::now();
        loop {
            let [sensor, steering] = find(config, baud, shutdown)?;
            let found = sensor.and_then(|sensor| Ok(vec![sensor, steering?]));
            let waits = self.taken.is_none() && found.is_err() && start.elapsed() < LETS_GO;
            if !waits || shutdown.is_requested() {
                return found.context("name the ports of the boards with --port");
            }
            std::thread::sleep(LOOK);
        }
    }

    /// What people have to know when the work is done and the robot is up.
    pub fn end(self) -> Result<()> {
        match self.taken {
            Some(_) => Ok(()),
            None => console::print(&format!(
                "the robot `{}` has its boards again and stands; `lager resume` lets it go on",
                self.name
            )),
        }
    }

    /// What they have to know when it has failed.
    pub fn explained<T>(&self, done: Result<T>) -> Result<T> {
        match self.taken {
            Some(_) => done,
            None => done.with_context(|| {
                format!(
                    "the robot `{}` has its boards again and stands until `lager resume`",
                    self.name
                )
            }),
        }
    }
}

/// Stops the robot that is up, and says whether it stands. A bridge lends its ports only after it has
/// obeyed, so a board that cannot tell whether it stands hinders nobody.
fn stop_for_work(config: &Config, name: &str) -> Result<()> {
    let stopped = stop::run(config, StopCause::BoardWork);
    if stop::current(config)?.is_none() {
        stopped?;
        return Ok(());
    }
    let said = stopped.unwrap_or_else(|why| format!("stopped, but {why:#}"));
    console::print(&format!("the robot `{name}` is up: {said}"))
}

/// The robot's name, for this process alone. What a robot has left in its folder stays there.
pub struct Taken {
    lock: Option<Lock>,
    folder: PathBuf,
}

impl Drop for Taken {
    fn drop(&mut self) {
        self.lock = None;
        // It stays if there is something in it.
        let _ = std::fs::remove_dir(&self.folder);
    }
}

/// Takes the robot's name. No robot of this name starts while the guard lives.
///
/// # Errors
/// The robot is up, somebody writes in its place, or somebody else has taken its name.
pub fn take_robot(config: &Config) -> Result<Taken> {
    let bus = config.bus()?;
    let home = bus.home()?;
    match home.lock_name(&bus.unit) {
        Ok(lock) => Ok(Taken {
            lock: Some(lock),
            folder: home.folder_of(&bus.unit),
        }),
        Err(LockError::Up { unit, pid }) => Err(match in_its_place(&home, &bus.unit) {
            Some(writer) => writer.into(),
            None => InUse { name: unit, pid }.into(),
        }),
        Err(error) => Err(error.into()),
    }
}

/// The process that writes in the place of a robot. It holds the locks of name and bridge alone; of a
/// robot that is up they belong to two processes.
fn in_its_place(home: &Home, unit: &UnitName) -> Option<InItsPlace> {
    let holders = home.up().remove(unit)?;
    let pid = |what: &str| holders.iter().find(|it| it.what == what).map(|it| it.pid);
    let bridge = Part::from(Role::Bridge).name();
    let writer = pid("up").filter(|own| pid(bridge) == Some(*own))?;
    let command = std::fs::read(format!("/proc/{writer}/cmdline")).ok()?;
    let words = command
        .split(|byte| *byte == 0)
        .map(String::from_utf8_lossy);
    Some(InItsPlace {
        name: unit.to_string(),
        pid: writer,
        command: words.collect::<Vec<_>>().join(" ").trim_end().to_owned(),
    })
}
