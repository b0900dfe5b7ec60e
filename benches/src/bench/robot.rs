//! The robot that `stop`, `command` and `link` measure from outside: a simulated one in real time
//! at 500 000 Bd, behind two ptys, with the services that `lager up` starts.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use lager_benches::{BenchError, Domain, FAMILY, heed_interrupts, interrupted};
use lager_ports::{Bus, Client};
use lager_rig::behind_ports;
use lager_stop::{Stop, StopPage, StopTold, StopWord};
use lager_topics::{Ask, AskKind, BridgeRequest, Role};
use rustix::process::{Pid, Signal, kill_process};

/// How long the measurement waits for any one thing before it fails.
pub(super) const PATIENCE: Duration = Duration::from_secs(30);
/// How long a process may take to end in order.
const END: Duration = Duration::from_secs(10);
/// How long the bridge may take to answer.
const ANSWER: Duration = Duration::from_millis(500);

/// A robot for one measurement, with its services. Dropping it ends everything.
pub(super) struct Robot {
    ask: Client<BridgeRequest>,
    pub(super) bus: Bus,
    pub(super) processes: Processes,
    /// The robot's folder on its bus.
    folder: PathBuf,
}

/// The processes. Dropping this ends the youngest first, and then removes their bus.
pub(super) struct Processes {
    children: Vec<Child>,
    domain: Domain,
}

impl Processes {
    /// Starts the `lager` beside this program with these arguments.
    pub(super) fn start(&mut self, arguments: &[&str]) -> Result<Pid> {
        let child = self.command(arguments)?.spawn();
        let child = child.context("cannot start the robot to be measured")?;
        let pid = Pid::from_child(&child);
        self.children.push(child);
        Ok(pid)
    }

    /// Ends the youngest process.
    pub(super) fn end_last(&mut self) {
        if let Some(mut child) = self.children.pop() {
            let _ = kill_process(Pid::from_child(&child), Signal::TERM);
            let asked = Instant::now();
            while matches!(child.try_wait(), Ok(None)) && asked.elapsed() < END {
                std::thread::sleep(Duration::from_millis(1));
            }
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    /// The bus's folder.
    pub(super) fn folder(&self) -> &Path {
        self.domain.folder()
    }

    pub(super) fn command(&self, arguments: &[&str]) -> Result<Command> {
        let lager = std::env::current_exe()?.with_file_name("lager");
        let built = "`cargo build --release` builds the robot's";
        ensure!(lager.is_file(), "there is no {}; {built}", lager.display());
        let mut command = Command::new(lager);
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

    /// Starts a robot with more flags for `up`.
    pub(super) fn start_with(flags: &[&str]) -> Result<Self> {
        heed_interrupts();
        let domain = Domain::new(FAMILY)?;
        let config = domain.config();
        let place = config.home()?;
        let [sensor, steering] = ["sensor", "steering"].map(|name| place.folder().join(name));
        let text = behind_ports(&sensor, &steering)?;
        let folder = place.folder_of(&config.unit);
        let mut processes = Processes {
            children: Vec::new(),
            domain,
        };
        fs::write(place.folder().join("robot.toml"), text)?;
        processes.start(&["simulator"])?;
        processes.start(&[&["up"], flags].concat())?;
        let bus = Bus::open(&config, Role::Operator)?;
        let robot = Self {
            ask: bus.client()?,
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

    /// Releases the stop with which the robot begins.
    pub(super) fn release(&self) -> Result<()> {
        self.wait("the stop to be released", || {
            let stop = self.told()?.and_then(|told| told.stop());
            let resume = Ask {
                kind: AskKind::Resume.into(),
                stop_word: stop.map_or(0, Stop::word),
                ..Ask::default()
            };
            let answer = self.ask.call(resume, ANSWER);
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
