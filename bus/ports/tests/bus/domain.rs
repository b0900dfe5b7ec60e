//! A bus of its own for each test.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use lager_home::{Home, UnitName};
use lager_ports::{
    Bus, BusConfig, Cause, NodeInfo, NodeState, Publisher, Subscriber, nodes, remove_stale_nodes,
};
use lager_topics::{LineFrame, Role, SensorLine};

/// A bus that nobody else uses. Dropping it checks that nothing of it is left.
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

    pub(crate) fn home(&self) -> Home {
        self.config.home().unwrap()
    }

    pub(crate) fn open(&self, role: Role) -> Bus {
        Bus::open(&self.config, role).unwrap()
    }

    pub(crate) fn open_robot(&self, robot: &str, role: Role) -> Bus {
        let config = BusConfig {
            unit: robot.parse::<UnitName>().unwrap(),
            ..self.config.clone()
        };
        Bus::open(&config, role).unwrap()
    }

    /// The names of the bus's files in shared memory.
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

/// Sweeps until no dead process is left or a minute has passed; returns whether none is left. A
/// sweep gives up on a dead process while another test's sweep in this process is removing it.
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

/// Sweeps until exactly `dead` processes have been removed.
#[track_caller]
pub(crate) fn sweep(bus: &Bus, dead: usize) {
    let mut removed = 0;
    until("the dead are swept", || {
        removed += bus.sweep();
        removed >= dead
    });
    assert_eq!(removed, dead);
}

/// Waits until `done`. Its time limit only keeps a test from hanging; it is no assertion about
/// time.
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

/// A line frame that `number` marks.
pub(crate) fn frame(number: u32) -> LineFrame {
    LineFrame {
        link_epoch: number,
        ..LineFrame::default()
    }
}

pub(crate) fn send(publisher: &Publisher<SensorLine>, number: u32) {
    publisher.send(Cause::OWN, frame(number)).unwrap();
}

/// Receives all waiting samples.
pub(crate) fn drain(subscriber: &mut Subscriber<SensorLine>) -> Vec<u32> {
    let mut numbers = Vec::new();
    while let Some(sample) = subscriber.receive().unwrap() {
        numbers.push(sample.link_epoch);
    }
    numbers
}
