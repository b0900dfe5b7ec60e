//! The service processes of a robot: starts them, starts them again after a wait, and ends them in
//! order.
//!
//! It knows processes, not their work, and never touches the bus. Its caller decides what to hand
//! over before a restart, and whether a silent process hangs. Children die with it: each asks the
//! kernel for SIGTERM at its parent's death ([`adopt`]), so even `kill -9` of the supervisor leaves
//! no child.
//!
//! A child reads its configuration from its standard input. That is a file in memory, so a restart
//! needs no file on disk.

use std::fmt;
use std::fs::File;
use std::io::{Seek, Write};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::str::FromStr;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_home::{ChanceClock, Clock, Watched};
use lager_wake::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{MemfdFlags, memfd_create};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open};

use crate::backoff::Backoff;
use crate::manager::VARIABLES;
use crate::service::Service;
use crate::signals::Signals;

/// How often to look at a child if the kernel does not report its end.
const LOOK: Duration = Duration::from_millis(50);
/// How long a child may take to stop before it is killed. Only time in which it could run counts,
/// and at most this many times as much real time.
pub const PATIENCE: Duration = Duration::from_secs(2);
const BUSY: u32 = 5;
/// The exit code of a service that could not join the bus and may succeed next time, from
/// `sysexits.h`. Only its supervisor sees it.
pub const TRY_AGAIN: i32 = 75;
/// How long a killed child may take to end. Even a killed process must run once more to end, and
/// real-time load can keep it from its core.
const LAST_PATIENCE: Duration = Duration::from_millis(500);

/// The supervisor's identity for its children: `PID@NS` on their command line.
///
/// It includes the time of its start, because the kernel knows only when its process was made:
/// `cargo run` compiles and then becomes this program in the same process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parent {
    /// Its process.
    pub pid: u32,
    /// When it began, in ns of `CLOCK_MONOTONIC`.
    pub started_ns: u64,
}

impl fmt::Display for Parent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.pid, self.started_ns)
    }
}

impl FromStr for Parent {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let usage = || format!("`{text}` is no supervisor; `lager up` writes PID@NS, as in 4711@0");
        let (pid, started_ns) = text.split_once('@').ok_or_else(usage)?;
        Ok(Self {
            pid: pid.parse().map_err(|_| usage())?,
            started_ns: started_ns.parse().map_err(|_| usage())?,
        })
    }
}

/// All children of one robot, in the order in which they start.
pub struct Children {
    program: PathBuf,
    config: String,
    parent: Parent,
    processes: Vec<Process>,
    /// The services that have ever been started, and how often each was started again.
    known: Vec<(Service, u32)>,
    /// The times of restarts count from here.
    began: Instant,
}

/// One service as a child process.
///
/// ```text
///            start                    ended
/// waiting ----------> running ------------------> waiting (0, 50, 100 .. 5000 ms)
///    ^                                               |
///    +-----------------------------------------------+
/// ```
struct Process {
    service: Service,
    running: Option<Running>,
    /// When it was started, or when it ended, in ns of `CLOCK_MONOTONIC`.
    since_ns: u64,
    backoff: Backoff,
}

struct Running {
    child: Child,
    /// Reports the child's end; `None` before Linux 5.3.
    end: Option<OwnedFd>,
    started: Instant,
}

/// How a service is started.
#[derive(Debug)]
pub struct Start {
    /// Whether it continues the work of an earlier process.
    pub resume: bool,
    /// Its standard output.
    pub output: Stdio,
    /// Its standard error.
    pub errors: Stdio,
}

/// A child that ended although nobody asked it to.
#[derive(Clone, Debug)]
pub struct Ended {
    /// The service.
    pub service: Service,
    /// How it ended, in words.
    pub how: String,
    /// Whether it ended by itself, and not by a signal.
    pub by_itself: bool,
    /// Whether its exit code says that another attempt may succeed.
    pub may_try_again: bool,
    /// Whether it died because memory that it had mapped was gone.
    pub lost_memory: bool,
}

impl Children {
    /// Children that run this very program with `config`, in TOML.
    ///
    /// # Errors
    /// This program's own file cannot be found.
    pub fn new(config: String) -> Result<Self> {
        let program = std::env::current_exe().context("cannot find this program's own file")?;
        Ok(Self::of(program, config))
    }

    /// Children that run `program` instead.
    fn of(program: PathBuf, config: String) -> Self {
        Self {
            program,
            config,
            parent: Parent {
                pid: std::process::id(),
                started_ns: Clock::monotonic_ns(),
            },
            processes: Vec::new(),
            known: Vec::new(),
            began: Instant::now(),
        }
    }

    /// From now on children start with this configuration, in TOML.
    pub fn configure(&mut self, config: String) {
        self.config = config;
    }

    /// Starts `service`, for the first time or again, and returns its process.
    pub fn start(&mut self, service: Service, start: Start) -> Result<u32> {
        match self.known.iter_mut().find(|(known, _)| *known == service) {
            Some((_, restarts)) => *restarts += 1,
            None => self.known.push((service, 0)),
        }
        let place = self
            .processes
            .iter()
            .position(|each| each.service == service);
        let place = place.unwrap_or_else(|| {
            self.processes.push(Process::new(service));
            self.processes.len() - 1
        });
        let process = &mut self.processes[place];
        let started = process.spawn(&self.program, &self.config, self.parent, start);
        if started.is_err() {
            process.ended(self.began.elapsed(), true);
        }
        started
    }

    /// The children that have ended since the last call. They start again after a wait.
    pub fn reap(&mut self) -> Vec<Ended> {
        let mut ended = Vec::new();
        for process in &mut self.processes {
            let status = process.running.as_mut().map(|each| each.child.try_wait());
            let service = process.service;
            let end = match status {
                Some(Ok(Some(status))) => Ended {
                    service,
                    how: status.to_string(),
                    by_itself: status.code().is_some(),
                    may_try_again: status.code() == Some(TRY_AGAIN),
                    lost_memory: faulted(status),
                },
                Some(Err(error)) => Ended {
                    service,
                    how: error.to_string(),
                    by_itself: false,
                    may_try_again: false,
                    lost_memory: false,
                },
                Some(Ok(None)) | None => continue,
            };
            // A killed one may do better next time.
            process.ended(self.began.elapsed(), end.by_itself);
            ended.push(end);
        }
        ended
    }

    /// The ended services that must start again now.
    pub fn due(&self) -> Vec<Service> {
        let now = self.began.elapsed();
        let due =
            |process: &&Process| process.running.is_none() && process.backoff.left(now).is_zero();
        self.processes
            .iter()
            .filter(due)
            .map(|process| process.service)
            .collect()
    }

    /// The process of `service`, if it runs.
    pub fn process(&self, service: Service) -> Option<u32> {
        let process = self.processes.iter().find(|each| each.service == service)?;
        Some(process.running.as_ref()?.child.id())
    }

    /// The services that run, and their processes.
    pub fn running(&self) -> impl Iterator<Item = (Service, u32)> {
        let id = |process: &Process| Some((process.service, process.running.as_ref()?.child.id()));
        self.processes.iter().filter_map(id)
    }

    /// How each service is, in the order in which they were first started.
    pub fn watched(&self) -> Vec<Watched> {
        let watched = |(service, restarts): &(Service, u32)| {
            let process = self.processes.iter().find(|each| each.service == *service);
            Watched {
                name: service.command().to_owned(),
                pid: self.process(*service),
                since_ns: process.map_or(0, |process| process.since_ns),
                restarts: *restarts,
            }
        };
        self.known.iter().map(watched).collect()
    }

    /// Kills a service that does not answer. The next [`reap`](Self::reap) finds its end.
    pub fn kill(&mut self, service: Service) {
        let mut processes = self.processes.iter_mut();
        if let Some(process) = processes.find(|each| each.service == service)
            && let Some(running) = &mut process.running
        {
            let _ = running.child.kill();
        }
    }

    /// Waits until a child has ended, a child must start, one of `others` can be read, or `at_most`
    /// is over.
    pub fn wait(&self, others: &[BorrowedFd<'_>], at_most: Duration) {
        let now = self.began.elapsed();
        let stopped = self.processes.iter().filter(|each| each.running.is_none());
        let due = stopped
            .map(|process| process.backoff.left(now))
            .filter(|due| !due.is_zero());
        let running = || {
            self.processes
                .iter()
                .filter_map(|each| each.running.as_ref())
        };
        let unseen = running().any(|each| each.end.is_none()).then_some(LOOK);
        let ends = running().filter_map(|each| each.end.as_ref().map(AsFd::as_fd));
        let sources: Vec<BorrowedFd<'_>> = ends.chain(others.iter().copied()).collect();
        wait_for(&sources, due.chain(unseen).fold(at_most, Duration::min));
    }

    /// A service that ends by itself at every start, if there is one: more starts will not help.
    pub fn hopeless(&self) -> Option<Service> {
        let mut processes = self.processes.iter();
        let process = processes.find(|process| process.backoff.is_hopeless())?;
        Some(process.service)
    }

    /// When this supervisor began, in ns of `CLOCK_MONOTONIC`.
    pub fn started_ns(&self) -> u64 {
        self.parent.started_ns
    }

    /// How many restarts there were in all.
    pub fn restarts(&self) -> u32 {
        self.known.iter().map(|(_, restarts)| restarts).sum()
    }

    /// Ends every child with SIGTERM, one after the other, the last started first, and forgets
    /// them. A child that does not end in time is killed, and another Ctrl-C kills all that are
    /// left. Returns what people should know of it.
    pub fn stop(&mut self, patience: Duration, signals: &mut Signals) -> Vec<String> {
        signals.forget_interrupt();
        let mut told = Vec::new();
        let mut hurry = false;
        while let Some(process) = self.processes.pop() {
            let Some(mut running) = process.running else {
                continue;
            };
            let _ = kill_process(Pid::from_child(&running.child), Signal::TERM);
            if !hurry && running.ends_within(patience, Some(signals)) {
                continue;
            }
            if !hurry && signals.interrupted() {
                hurry = true;
                let mut rest = self.processes.iter_mut();
                while let Some(rest) = rest.find_map(|each| each.running.as_mut()) {
                    let _ = rest.child.kill();
                }
            }
            if !hurry {
                told.push(format!(
                    "the {} does not stop and is killed",
                    process.service
                ));
            }
            let _ = running.child.kill();
            if !running.ends_within(LAST_PATIENCE, None) {
                told.push(format!(
                    "the {} is killed and gets no time to end; see which real-time process holds its core (ps -eLo pid,cls,rtprio,psr,args)",
                    process.service
                ));
            }
        }
        told
    }

    /// Ends every child at once.
    fn kill_all(&mut self) {
        let mut running: Vec<_> = self
            .processes
            .drain(..)
            .filter_map(|each| each.running)
            .collect();
        for each in &mut running {
            let _ = each.child.kill();
        }
        for each in &mut running {
            each.ends_within(LAST_PATIENCE, None);
        }
    }
}

impl Drop for Children {
    /// Kills the children that are left; after an end in order there are none.
    fn drop(&mut self) {
        self.kill_all();
    }
}

impl Process {
    fn new(service: Service) -> Self {
        Self {
            service,
            running: None,
            since_ns: Clock::monotonic_ns(),
            backoff: Backoff::default(),
        }
    }

    /// A child has just ended.
    fn ended(&mut self, now: Duration, by_itself: bool) {
        let running = self.running.take();
        self.since_ns = Clock::monotonic_ns();
        let lived = running.map_or(Duration::ZERO, |running| running.started.elapsed());
        self.backoff.ended(now, lived, by_itself);
    }

    fn spawn(&mut self, program: &Path, config: &str, parent: Parent, start: Start) -> Result<u32> {
        let name = self.service.command();
        let attempt = || -> Result<Child> {
            let mut command = Command::new(program);
            command
                .args(["--config", "-", name, "--parent"])
                .arg(parent.to_string())
                .stdin(in_memory(config)?)
                .stdout(start.output)
                .stderr(start.errors)
                // A process group of its own, so that Ctrl-C reaches only the supervisor, which
                // then stops the children in order.
                .process_group(0);
            for variable in VARIABLES {
                command.env_remove(variable);
            }
            if start.resume {
                command.arg("--resume");
            }
            Ok(command.spawn()?)
        };
        let child = attempt().with_context(|| format!("cannot start the service `{name}`"))?;
        let pid = child.id();
        tracing::info!(service = name, pid, "started");
        self.since_ns = Clock::monotonic_ns();
        self.running = Some(Running {
            end: pidfd_open(Pid::from_child(&child), PidfdFlags::empty()).ok(),
            child,
            started: Instant::now(),
        });
        Ok(pid)
    }
}

impl Running {
    /// Whether it ends within `patience`, and before a Ctrl-C.
    fn ends_within(&mut self, patience: Duration, signals: Option<&mut Signals>) -> bool {
        ends_within(&mut self.child, self.end.as_ref(), patience, signals)
    }
}

/// Whether `child` ends before it could have run for `patience`, and before a Ctrl-C if somebody
/// listens for that. `end` reports the child's end.
pub fn ends_within(
    child: &mut Child,
    end: Option<&OwnedFd>,
    patience: Duration,
    mut signals: Option<&mut Signals>,
) -> bool {
    let mut could_run = ChanceClock::of_process(child.id());
    let give_up = Instant::now() + patience * BUSY;
    while matches!(child.try_wait(), Ok(None)) {
        let left = patience.saturating_sub(could_run.look(patience));
        let left = left.min(give_up.saturating_duration_since(Instant::now()));
        let interrupted = signals
            .as_mut()
            .is_some_and(|signals| signals.interrupted());
        if left.is_zero() || interrupted {
            return false;
        }
        let sources: Vec<BorrowedFd<'_>> = (end.map(AsFd::as_fd).into_iter())
            .chain(signals.as_ref().map(|signals| signals.as_fd()))
            .collect();
        wait_for(&sources, left.min(LOOK));
    }
    true
}

/// Waits until one of `sources` can be read, a signal comes, or `at_most` is over.
fn wait_for(sources: &[BorrowedFd<'_>], at_most: Duration) {
    let mut sources: Vec<_> = sources
        .iter()
        .map(|source| PollFd::from_borrowed_fd(*source, PollFlags::IN))
        .collect();
    let at_most = Timespec::try_from(at_most).expect("no wait is as long as the clock's range");
    let _ = poll(&mut sources, Some(&at_most));
}

/// Whether a process died because memory was gone or could not be allocated.
fn faulted(status: ExitStatus) -> bool {
    let signals = [Signal::BUS, Signal::SEGV].map(Signal::as_raw);
    status
        .signal()
        .is_some_and(|signal| signals.contains(&signal))
}

/// A text as a file in memory, which nobody can remove.
fn in_memory(text: &str) -> Result<Stdio> {
    let mut file = File::from(memfd_create("lager.toml", MemfdFlags::CLOEXEC)?);
    file.write_all(text.as_bytes())?;
    file.rewind()?;
    Ok(Stdio::from(file))
}

/// Ties this process's life to its supervisor's: it gets SIGTERM when the supervisor dies, and it
/// certainly ends after its shutdown was requested.
///
/// # Errors
/// The supervisor has gone already.
pub fn adopt(parent: Parent, shutdown: &Shutdown) -> Result<()> {
    rustix::process::set_parent_process_death_signal(Some(Signal::TERM))?;
    let actual = rustix::process::getppid().map_or(0, |pid| pid.as_raw_nonzero().get());
    if actual != i32::try_from(parent.pid)? {
        bail!("the supervisor (process {}) is gone", parent.pid);
    }
    let shutdown = shutdown.clone();
    std::thread::Builder::new()
        .name("last-resort".into())
        .spawn(move || {
            const LOOK: Duration = Duration::from_millis(100);
            while !shutdown.is_requested() {
                std::thread::sleep(LOOK);
            }
            let mut could_run = ChanceClock::of_process(std::process::id());
            while could_run.look(LOOK) < PATIENCE {
                std::thread::sleep(LOOK);
            }
            std::process::exit(1);
        })?;
    Ok(())
}

#[cfg(test)]
mod tests;
