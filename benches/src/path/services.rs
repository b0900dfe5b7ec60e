//! The processes of the path: the real bridge, the real logic, and those who watch them.
//!
//! Each is the service's own `run` on a bus of the measurement's own, in a process of its own, as
//! `lager up` starts it; nothing of a service is left out or put in.

use core::time::Duration;
use std::error::Error;
use std::path::PathBuf;

use lager_bridge::BridgeConfig;
use lager_logic::LogicConfig;
use lager_ports::{Bus, Shutdown, Subscriber};
use lager_rig::process::Main;
use lager_rig::schedule::schedule;
use lager_rig::{Parent, bus_at};
use lager_topics::{Role, SensorLine, SteeringCommand, Topic};
use serde::{Deserialize, Serialize};

use crate::error::BenchError;
use crate::machine;
use crate::report::Mode;

/// The names of the processes.
pub(super) const BRIDGE: &str = "path, bridge";
pub(super) const LOGIC: &str = "path, logic";
pub(super) const OBSERVER: &str = "path, observer";

pub(crate) const PROCESSES: &[(&str, Main)] =
    &[(BRIDGE, bridge), (LOGIC, logic), (OBSERVER, observer)];

/// How often an observer looks: often enough for a person's eye.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Where and how a process runs.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Place {
    /// The core it is bound to; `None` = any.
    pub(super) core: Option<usize>,
    /// Its SCHED_FIFO priority; `None` = as any process.
    pub(super) priority: Option<i32>,
}

impl Place {
    /// Takes the place, with all threads that this one starts later.
    pub(super) fn take(self) -> Result<(), BenchError> {
        if let Some(core) = self.core {
            machine::pin(core)?;
        }
        if let Some(priority) = self.priority {
            // For the rest of the process's life.
            core::mem::forget(RealTime::begin(priority)?);
        }
        Ok(())
    }
}

/// What a process of the path is told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Setup {
    pub(super) place: Place,
    pub(super) folder: PathBuf,
    /// How bridge and logic wait.
    pub(super) mode: Mode,
    /// The bridge's serial ports.
    pub(super) ports: [PathBuf; 2],
}

impl Setup {
    pub(super) fn open(&self, role: Role) -> Result<Bus, BenchError> {
        Bus::open(&bus_at(&self.folder), role).map_err(bus_error("joining the bus"))
    }
}

/// The bus's own sentence, as the measurement's.
pub(super) fn bus_error<E: core::fmt::Display>(what: &'static str) -> impl FnOnce(E) -> BenchError {
    move |error| BenchError::Bus {
        what,
        detail: error.to_string(),
    }
}

fn bridge(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let Some(setup) = parent.hear::<Setup>()? else {
        return Ok(());
    };
    setup.place.take()?;
    let bus = setup.open(Role::Bridge)?;
    let config = BridgeConfig {
        ports: setup.ports.clone(),
        waiting: setup.mode.policy(),
        ..BridgeConfig::default()
    };
    parent.say(&())?;
    // Ends with the process, which the parent ends.
    lager_bridge::run(&bus, &config, &Shutdown::new()).map_err(bus_error("running the bridge"))?;
    Ok(())
}

fn logic(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let Some(setup) = parent.hear::<Setup>()? else {
        return Ok(());
    };
    setup.place.take()?;
    let bus = setup.open(Role::Logic)?;
    let config = LogicConfig {
        // With it every frame makes a new order: a line frame lets the robot see and drive, any
        // other frame, a millisecond later, finds the line long unseen and lets it stand.
        blind_after: Duration::from_micros(400),
        waiting: setup.mode.policy(),
        ..LogicConfig::default()
    };
    parent.say(&())?;
    lager_logic::run(&bus, &config, &Shutdown::new()).map_err(bus_error("running logic"))?;
    Ok(())
}

/// An observer: reads ten times a second all that has come, and is never woken.
fn observer(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let Some(setup) = parent.hear::<Setup>()? else {
        return Ok(());
    };
    setup.place.take()?;
    let bus = setup.open(Role::Observer)?;
    let mut line = bus
        .subscriber::<SensorLine>()
        .map_err(bus_error("observing"))?;
    let mut commands = bus
        .subscriber::<SteeringCommand>()
        .map_err(bus_error("observing"))?;
    parent.say(&())?;
    loop {
        drain(&mut line)?;
        drain(&mut commands)?;
        std::thread::sleep(LOOK_EVERY);
    }
}

fn drain<T: Topic>(subscriber: &mut Subscriber<T>) -> Result<(), BenchError> {
    while subscriber
        .receive()
        .map_err(bus_error("observing"))?
        .is_some()
    {}
    Ok(())
}

/// The calling thread comes before all that is not real time, as long as this lives; so do the
/// threads and processes that it starts meanwhile.
#[derive(Debug)]
pub(super) struct RealTime(());

impl RealTime {
    pub(super) fn begin(priority: i32) -> Result<Self, BenchError> {
        schedule(libc::SCHED_FIFO, priority).map_err(|error| BenchError::RealTime {
            detail: error.to_string(),
        })?;
        Ok(Self(()))
    }
}

impl Drop for RealTime {
    fn drop(&mut self) {
        // Anybody may become less urgent.
        let _ = schedule(libc::SCHED_OTHER, 0);
    }
}
