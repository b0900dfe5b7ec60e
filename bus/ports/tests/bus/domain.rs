//! A bus of its own for each test.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use lager_ports::{
    Bus, BusConfig, Cause, NodeInfo, NodeState, Place, Publisher, RobotName, Subscriber, nodes,
    remove_stale_nodes,
};
use lager_topics::{LineFrame, Role, SensorLine};

/// A bus nobody else is on. Dropping it proves that nothing of it is left.
pub(crate) struct Domain {
    pub(crate) config: BusConfig,
    own: lager_rig::Domain,
}

impl Domain {
    pub(crate) fn new() -> Self {
        Self::of(lager_rig::Domain::new("lager-ports").unwrap())
    }

    pub(crate) fn at(folder: PathBuf) -> Self {
        Self::of(lager_rig::Domain::at(folder))
    }

    fn of(own: lager_rig::Domain) -> Self {
        Self {
            config: own.config(),
            own,
        }
    }

    pub(crate) fn place(&self) -> Place {
        self.config.place().unwrap()
    }

    pub(crate) fn open(&self, role: Role) -> Bus {
        Bus::open(&self.config, role).unwrap()
    }

    pub(crate) fn open_robot(&self, robot: &str, role: Role) -> Bus {
        let config = BusConfig {
            robot: robot.parse::<RobotName>().unwrap(),
            ..self.config.clone()
        };
        Bus::open(&config, role).unwrap()
    }

    /// What processes have in shared memory on this bus.
    pub(crate) fn in_shared_memory(&self) -> Vec<String> {
        let of_memory = |path: &&PathBuf| !path.starts_with(self.own.folder());
        let left = self.own.left();
        let name = |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
        left.iter().filter(of_memory).map(name).collect()
    }

    /// Files (not folders) in the bus's folder.
    pub(crate) fn left_in_folder(&self) -> Vec<PathBuf> {
        let mut left = self.own.left();
        left.retain(|path| path.starts_with(self.own.folder()));
        left
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        let swept = remove_all_stale_nodes(&self.config);
        let left = self.in_shared_memory();
        let files = self.left_in_folder();
        if !std::thread::panicking() {
            assert!(swept, "a killed process could not be swept");
            assert_eq!(left, Vec::<String>::new());
            assert_eq!(files, Vec::<PathBuf>::new());
        }
    }
}

/// Sweeps until nobody dead is left or a minute has passed; says which. A sweep gives up on a dead
/// process when another one in this process, which other tests make, lasts long.
fn remove_all_stale_nodes(config: &BusConfig) -> bool {
    let start = Instant::now();
    loop {
        remove_stale_nodes(config).unwrap();
        let stale = |node: &NodeInfo| node.state == NodeState::Stale;
        if !nodes(config).unwrap().iter().any(stale) {
            return true;
        }
        if start.elapsed() > Duration::from_secs(60) {
            return false;
        }
    }
}

/// Sweeps until `dead` processes have been removed, and not one more.
#[track_caller]
pub(crate) fn sweep(bus: &Bus, dead: usize) {
    let mut removed = 0;
    until("the dead are swept", || {
        removed += bus.sweep();
        removed >= dead
    });
    assert_eq!(removed, dead);
}

/// Waits until `done`; the watchdog against hanging for ever, not an assertion about time.
#[track_caller]
pub(crate) fn until(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "gave up waiting until {what}"
        );
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A line frame that can be told from others.
pub(crate) fn frame(number: u32) -> LineFrame {
    LineFrame {
        link_epoch: number,
        ..LineFrame::default()
    }
}

pub(crate) fn send(publisher: &Publisher<SensorLine>, number: u32) {
    publisher.send(Cause::OWN, frame(number)).unwrap();
}

/// Everything there is to receive.
pub(crate) fn drain(subscriber: &mut Subscriber<SensorLine>) -> Vec<u32> {
    let mut numbers = Vec::new();
    while let Some(sample) = subscriber.receive().unwrap() {
        numbers.push(sample.link_epoch);
    }
    numbers
}
