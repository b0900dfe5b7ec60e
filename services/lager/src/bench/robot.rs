//! The robot that is measured from outside, as people run it: the simulated one in real time at
//! 500 000 Bd, behind two ptys, with the services that `lager up` starts.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use lager_benches::{BenchError, Domain, FAMILY, heed_interrupts, interrupted};
use lager_ports::{Bus, Stop, StopPage, StopTold, StopWord};
use lager_topics::{Ask, AskKind, Role};
use rustix::process::{Pid, Signal, kill_process};

use crate::hands::Hands;
use crate::supervisor::ends_within;

/// How long anything may take before the measurement is given up.
pub(super) const PATIENCE: Duration = Duration::from_secs(30);

/// A robot of the measurement's own, with its services. Everything ends when it is dropped.
pub(super) struct Robot {
    pub(super) hands: Hands,
    pub(super) bus: Bus,
    pub(super) processes: Processes,
    /// The robot's own folder of the bus.
    folder: PathBuf,
}

/// Ended last first, and then their bus is removed.
pub(super) struct Processes {
    children: Vec<Child>,
    domain: Domain,
}

impl Processes {
    /// Starts `lager` with these arguments.
    pub(super) fn start(&mut self, arguments: &[&str]) -> Result<Pid> {
        let child = self.command(arguments)?.spawn();
        let child = child.context("cannot start the robot to be measured")?;
        let pid = Pid::from_child(&child);
        self.children.push(child);
        Ok(pid)
    }

    /// Ends the one that was started last.
    pub(super) fn end_last(&mut self) {
        if let Some(mut child) = self.children.pop() {
            let _ = kill_process(Pid::from_child(&child), Signal::TERM);
            if !ends_within(&mut child, None, Duration::from_secs(10), None) {
                let _ = child.kill();
                let _ = child.wait();
            }
        }
    }

    /// Where the bus lives.
    pub(super) fn folder(&self) -> &Path {
        self.domain.folder()
    }

    pub(super) fn command(&self, arguments: &[&str]) -> Result<Command> {
        let mut command = Command::new(std::env::current_exe()?);
        command
            .arg("--config")
            .arg(self.domain.folder().join("robot.toml"))
            .arg("--bus")
            .arg(self.domain.folder())
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        Ok(command)
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        while !self.children.is_empty() {
            self.end_last();
        }
    }
}

impl Robot {
    pub(super) fn start() -> Result<Self> {
        Self::start_with(&[])
    }

    /// With more flags for `up`.
    pub(super) fn start_with(flags: &[&str]) -> Result<Self> {
        heed_interrupts();
        let domain = Domain::new(FAMILY)?;
        let config = domain.config();
        let place = config.place()?;
        let [sensor, steering] = ["sensor", "steering"].map(|name| place.folder().join(name));
        let text =
            format!("body = \"serial\"\n[serial]\nsensor = {sensor:?}\nsteering = {steering:?}\n");
        let folder = place.folder_of(&config.robot);
        let mut processes = Processes {
            children: Vec::new(),
            domain,
        };
        fs::write(place.folder().join("robot.toml"), text)?;
        processes.start(&["simulator"])?;
        processes.start(&[&["up"], flags].concat())?;
        let bus = Bus::open(&config, Role::Operator)?;
        let hands = Hands::new(&bus)?;
        let robot = Self {
            hands,
            bus,
            processes,
            folder,
        };
        robot.wait("both boards to be connected", || {
            let told = robot.told()?;
            Ok(told.is_some_and(|told| told.sensor().is_some() && told.steering().is_some()))
        })?;
        Ok(robot)
    }

    pub(super) fn told(&self) -> Result<Option<StopTold>> {
        Ok(StopWord::read(&self.folder.join(StopPage::FILE))?)
    }

    /// Where a GaG connects to the robot's station.
    pub(super) fn gag(&self) -> PathBuf {
        self.folder.join("gag")
    }

    /// Releases the stop that it has.
    pub(super) fn release(&self) -> Result<()> {
        self.wait("the stop to be released", || {
            let stop = self.told()?.and_then(|told| told.stop());
            let answer = self.hands.ask(Ask {
                kind: AskKind::Resume.into(),
                stop_word: stop.map_or(0, Stop::word),
                ..Ask::default()
            });
            Ok(answer.is_ok_and(|answer| answer.stopped == 0))
        })
    }

    pub(super) fn wait(&self, what: &str, mut done: impl FnMut() -> Result<bool>) -> Result<()> {
        let start = Instant::now();
        while !done()? {
            ensure!(!interrupted(), BenchError::Interrupted);
            ensure!(start.elapsed() < PATIENCE, "waited in vain for {what}");
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }
}
