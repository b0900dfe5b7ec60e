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

use super::Beside;
use crate::error::{BenchError, no_bus};
use crate::report::Mode;
use crate::sample::drain;

/// The names of the processes.
pub(super) const BRIDGE: &str = "path, bridge";
pub(super) const LOGIC: &str = "path, logic";
const OBSERVER: &str = "path, observer";
const WATCHER: &str = "path, watcher";
#[cfg(feature = "zenoh")]
const GATEWAY: &str = "path, gateway";
#[cfg(feature = "zenoh")]
const LISTENER: &str = "path, listener";

pub(crate) const PROCESSES: &[(&str, Main)] = &[
    (BRIDGE, bridge),
    (LOGIC, logic),
    (OBSERVER, observer),
    (WATCHER, watcher),
    #[cfg(feature = "zenoh")]
    (GATEWAY, gateway),
    #[cfg(feature = "zenoh")]
    (LISTENER, listener),
];

/// The processes beside a path, in the order of their start: those of each list together.
pub(super) fn processes_of(beside: Beside) -> Vec<Vec<&'static str>> {
    match beside {
        Beside::Nobody => Vec::new(),
        Beside::Observers(count) => vec![vec![OBSERVER; count]],
        Beside::Watchers(count) => vec![vec![WATCHER; count]],
        #[cfg(feature = "zenoh")]
        Beside::Listeners(count) => vec![vec![GATEWAY], vec![LISTENER; count]],
    }
}

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
    /// Where a gateway's listeners find it.
    pub(super) socket: PathBuf,
}

impl Setup {
    pub(super) fn open(&self, role: Role) -> Result<Bus, BenchError> {
        Bus::open(&bus_at(&self.folder), role).map_err(no_bus)
    }
}

/// Hears the parent's message, takes its core and priority if it is on the path, and opens the bus.
fn told(parent: &mut Parent, role: Role) -> Result<(Setup, Bus), Box<dyn Error>> {
    let setup: Setup = parent.told()?;
    if matches!(role, Role::Bridge | Role::Logic) {
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

/// A watcher: every sample wakes it.
fn watcher(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let (_, bus) = told(parent, Role::Observer)?;
    let mut line = bus.subscriber::<SensorLine>()?;
    let mut commands = bus.subscriber::<SteeringCommand>()?;
    let mut watcher = bus.watcher()?;
    line.wakes(&mut watcher);
    commands.wakes(&mut watcher);
    parent.say(&())?;
    loop {
        drain(&mut line)?;
        drain(&mut commands)?;
        watcher.wait(LOOK_EVERY);
    }
}

/// The robot's gateway, as `lager gateway --zenoh` runs it.
#[cfg(feature = "zenoh")]
fn gateway(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    use lager_gateway::{Addresses, Gateway};
    use lager_remote::{Allowed, Endpoint, Settings};

    let (setup, bus) = told(parent, Role::Gateway)?;
    let every = Allowed::new(&["*".to_owned()], &std::collections::BTreeMap::new());
    let endpoint = Endpoint::Unix(setup.socket);
    let settings = Settings::new(Some(endpoint), None, every?, None)?;
    let addresses = Addresses {
        zenoh: Some(settings),
        ..Addresses::default()
    };
    let gateway = Gateway::open(addresses, bus.unit())?;
    parent.say(&())?;
    let never = Shutdown::new();
    Ok(gateway.run(&bus, None, &lager_wake::Watchdog::default(), &never)?)
}

/// A listener: it gets every sample of every topic. Its processor time would be another machine's,
/// so it takes only what nobody else of this one wants.
#[cfg(feature = "zenoh")]
fn listener(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    use lager_remote::{Endpoint, Remote};
    use lager_rig::schedule::schedule;

    /// As the tools look.
    const LOOK: Duration = Duration::from_millis(5);

    let setup: Setup = parent.told()?;
    // Zenoh's threads inherit it.
    schedule(libc::SCHED_IDLE)?;
    let robot = bus_at(&setup.folder).unit;
    let endpoint = Endpoint::Unix(setup.socket);
    let start = std::time::Instant::now();
    let remote = loop {
        // The gateway opens its topics one after the other.
        match Remote::open(&endpoint, &robot, None, &Shutdown::new()) {
            Err(_) if start.elapsed() < Duration::from_secs(5) => std::thread::sleep(LOOK),
            opened => break opened?,
        }
    };
    let topics = remote.topics()?.into_keys();
    let topics = topics.map(|topic| remote.listen(&topic));
    let mut topics = topics.collect::<Result<Vec<_>, _>>()?;
    parent.say(&())?;
    loop {
        for topic in &mut topics {
            while topic.receive().is_some() {}
        }
        std::thread::sleep(LOOK);
    }
}
