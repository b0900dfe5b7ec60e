//! The processes of the path: the real bridge, the real logic, and those who watch them.
//!
//! Each is the service's own `run` on a bus of the measurement's own, in a process of its own, as
//! `lager up` starts it; nothing of a service is left out or put in.

use core::time::Duration;
use std::error::Error;
use std::path::PathBuf;

use lager_bridge::BridgeConfig;
use lager_logic::LogicConfig;
use lager_ports::{Bus, Shutdown};
use lager_rig::process::Main;
use lager_rig::schedule::Place;
use lager_rig::{Parent, bus_at};
use lager_topics::{Role, SensorLine, SteeringCommand};
use serde::{Deserialize, Serialize};

use crate::error::{BenchError, no_bus};
use crate::report::Mode;
use crate::sample::drain;

/// The names of the processes.
pub(super) const BRIDGE: &str = "path, bridge";
pub(super) const LOGIC: &str = "path, logic";
pub(super) const OBSERVER: &str = "path, observer";

pub(crate) const PROCESSES: &[(&str, Main)] =
    &[(BRIDGE, bridge), (LOGIC, logic), (OBSERVER, observer)];

/// How often an observer looks: often enough for a person's eye.
const LOOK_EVERY: Duration = Duration::from_millis(100);

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
        Bus::open(&bus_at(&self.folder), role).map_err(no_bus)
    }
}

/// What the parent says, and the bus; a service has taken its place.
fn told(parent: &mut Parent, role: Role) -> Result<(Setup, Bus), Box<dyn Error>> {
    let setup: Setup = parent.told()?;
    if role != Role::Observer {
        setup.place.take()?;
    }
    let bus = setup.open(role)?;
    Ok((setup, bus))
}

fn bridge(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let (setup, bus) = told(parent, Role::Bridge)?;
    let config = BridgeConfig {
        ports: setup.ports,
        waiting: setup.mode.policy(),
        ..BridgeConfig::default()
    };
    parent.say(&())?;
    // Ends with the process, which the parent ends.
    Ok(lager_bridge::run(&bus, &config, &Shutdown::new())?)
}

fn logic(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let (setup, bus) = told(parent, Role::Logic)?;
    let config = LogicConfig {
        // With it every frame makes a new order: a line frame lets the robot see and drive, any
        // other frame, a millisecond later, finds the line long unseen and lets it stand.
        blind_after: Duration::from_micros(400),
        waiting: setup.mode.policy(),
        ..LogicConfig::default()
    };
    parent.say(&())?;
    Ok(lager_logic::run(&bus, &config, &Shutdown::new())?)
}

/// An observer: reads ten times a second all that has come, and is never woken.
fn observer(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let (_, bus) = told(parent, Role::Observer)?;
    let mut line = bus.subscriber::<SensorLine>()?;
    let mut commands = bus.subscriber::<SteeringCommand>()?;
    parent.say(&())?;
    loop {
        drain(&mut line)?;
        drain(&mut commands)?;
        std::thread::sleep(LOOK_EVERY);
    }
}
