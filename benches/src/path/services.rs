//! The processes of the path: the real bridge, the real logic, and their observers.
//!
//! Each process runs the service's own `run`, as under `lager up`, on a bus of the measurement. The
//! service is complete and unchanged.

use core::time::Duration;
use std::error::Error;
use std::path::PathBuf;

use lager_bridge::{BridgeConfig, Ports};
use lager_logic::LogicConfig;
use lager_ports::Bus;
use lager_rig::process::Main;
use lager_rig::schedule::Placement;
use lager_rig::{Parent, bus_at};
use lager_topics::{Role, SensorLine, SteeringCommand};
use lager_wake::Shutdown;
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

/// The period of an observer's looks: short enough for a person's eye.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// The parent's message to a process of the path.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Setup {
    pub(super) place: Placement,
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

/// Hears the parent's message, takes its core and priority, and opens the bus.
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
        ports: Ports::Named(setup.ports),
        waiting: setup.mode.policy(),
        ..BridgeConfig::default()
    };
    parent.say(&())?;
    // Runs until the parent ends the process.
    Ok(lager_bridge::run(&bus, &config, &Shutdown::new())?)
}

fn logic(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let (setup, bus) = told(parent, Role::Logic)?;
    let config = LogicConfig {
        // So every frame makes a new order: after a line frame the robot sees and drives. Any other
        // frame comes 1 ms later, when the line was not seen for too long, and lets it stand.
        blind_after: Duration::from_micros(400),
        waiting: setup.mode.policy(),
        ..LogicConfig::default()
    };
    parent.say(&())?;
    Ok(lager_logic::run(&bus, &config, &Shutdown::new())?)
}

/// An observer: ten times a second it reads all that has come. Nobody wakes it.
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
