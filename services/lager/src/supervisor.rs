//! The supervisor of the service processes: starts them, restarts them with back-off, ends them
//! in order.
//!
//! It knows processes, not services: what to hand over before a restart is its caller's business.
//! Children die with it. Each asks the kernel for SIGTERM at its parent's death ([`adopt`]), so
//! even `kill -9` of the supervisor leaves no child.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_ports::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open};

/// A child that lived this long was healthy: its restart does not wait.
const HEALTHY: Duration = Duration::from_secs(1);
/// The first wait of a child that ends at once, doubled at each further one.
const FIRST_WAIT: Duration = Duration::from_millis(50);
/// The longest wait between two starts.
const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// A child that lived this long has found all it needs.
const SETTLED: Duration = Duration::from_secs(30);
/// How often in a row a child may end by itself before it has settled.
const MOST_FAILURES: u32 = 5;
/// How long a service may take from its start until it has everything that others keep for it.
const INTRODUCTION: Duration = Duration::from_millis(500);
/// How often a child is looked at whose end the kernel does not tell.
const LOOK: Duration = Duration::from_millis(50);
/// How long a child may take to stop before it is killed.
pub const PATIENCE: Duration = Duration::from_secs(3);

/// All children of one robot, in the order in which they start.
pub struct Supervisor {
    program: PathBuf,
    config: PathBuf,
    services: Vec<Service>,
    restarts: u32,
}

/// One service as a child process.
///
/// ```text
///            start                    ended
/// waiting ----------> running ------------------> waiting (0, 50, 100 .. 5000 ms)
///    ^                                               |
///    +-----------------------------------------------+
/// ```
struct Service {
    name: &'static str,
    child: Option<Child>,
    started: Instant,
    start_at: Instant,
    wait: Duration,
    restarted: bool,
    /// How often in a row it has ended by itself before it had settled.
    failures: u32,
}

/// A child ended without being asked to.
#[derive(Debug)]
pub struct Ended {
    /// The service's name.
    pub service: &'static str,
    /// How it ended, in words.
    pub how: String,
}

impl Supervisor {
    /// A supervisor whose children run this very program with `config`.
    pub fn new(config: PathBuf) -> Result<Self> {
        Ok(Self {
            program: std::env::current_exe().context("cannot find this program's own file")?,
            config,
            services: Vec::new(),
            restarts: 0,
        })
    }

    /// Starts `name`, the subcommand of the service.
    pub fn start(&mut self, name: &'static str) -> Result<()> {
        let now = Instant::now();
        let mut service = Service {
            name,
            child: None,
            started: now,
            start_at: now,
            wait: Duration::ZERO,
            restarted: false,
            failures: 0,
        };
        service.spawn(&self.program, &self.config)?;
        self.services.push(service);
        Ok(())
    }

    /// Restarts what has ended and is due again; `hand_over` runs before each restart. A child
    /// that cannot be started counts as one that ended at once.
    ///
    /// Returns the children found ended by this call.
    pub fn poll(&mut self, mut hand_over: impl FnMut(&'static str)) -> Vec<Ended> {
        let now = Instant::now();
        let mut ended = Vec::new();
        for service in &mut self.services {
            let how = match service.child.as_mut().map(Child::try_wait) {
                // One that was killed may do better next time.
                Some(Ok(Some(status))) => Some((status.to_string(), status.code().is_some())),
                Some(Err(error)) => Some((error.to_string(), false)),
                Some(Ok(None)) | None => None,
            };
            if let Some((how, by_itself)) = how {
                service.child = None;
                service.back_off(now, by_itself);
                ended.push(Ended {
                    service: service.name,
                    how,
                });
            }
            if service.child.is_none() && now >= service.start_at {
                hand_over(service.name);
                service.restarted = true;
                self.restarts += 1;
                if let Err(error) = service.spawn(&self.program, &self.config) {
                    service.back_off(now, true);
                    ended.push(Ended {
                        service: service.name,
                        how: format!("{error:#}"),
                    });
                }
            }
        }
        ended
    }

    /// Waits until there is something for [`poll`](Self::poll) to do, but not longer than `at_most`.
    pub fn wait(&self, at_most: Duration) {
        let now = Instant::now();
        let stopped = self.services.iter().filter(|each| each.child.is_none());
        let due = stopped.map(|service| service.start_at.saturating_duration_since(now));
        let children = self.services.iter().filter_map(|each| each.child.as_ref());
        wait_for_an_end(children, due.fold(at_most, Duration::min));
    }

    /// Whether a service has started a moment ago, and may still wait for what others keep for it.
    pub fn has_newcomer(&self) -> bool {
        let mut running = self.services.iter().filter(|each| each.child.is_some());
        running.any(|service| service.started.elapsed() < INTRODUCTION)
    }

    /// A service that ends by itself at every start, if there is one: more starts will not help.
    pub fn hopeless(&self) -> Option<&'static str> {
        let mut services = self.services.iter();
        let service = services.find(|service| service.failures >= MOST_FAILURES)?;
        Some(service.name)
    }

    /// How many restarts there were in all.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Ends every child with SIGTERM, the last started first, each before the next.
    pub fn stop(&mut self) {
        while let Some(mut service) = self.services.pop() {
            let Some(mut child) = service.child.take() else {
                continue;
            };
            let _ = kill_process(pid_of(&child), Signal::TERM);
            if !ends_within(&mut child, PATIENCE) {
                tracing::warn!(service = service.name, "does not stop, killing it");
                let _ = child.kill();
                // Even a killed process has to run once more to end. One that real-time load keeps
                // from its core must not keep the others from being stopped.
                if !ends_within(&mut child, PATIENCE) {
                    tracing::error!(
                        service = service.name,
                        "is killed and gets no time to end; see which real-time process holds its core (ps -eLo pid,cls,rtprio,psr,args)"
                    );
                }
            }
        }
    }
}

impl Service {
    /// Sets the next start after an end found at `now`.
    fn back_off(&mut self, now: Instant, by_itself: bool) {
        let lived = now - self.started;
        self.wait = if lived >= HEALTHY {
            Duration::ZERO
        } else {
            (self.wait * 2).clamp(FIRST_WAIT, LONGEST_WAIT)
        };
        self.failures = match by_itself && lived < SETTLED {
            true => self.failures + 1,
            false => 0,
        };
        self.start_at = now + self.wait;
    }

    fn spawn(&mut self, program: &Path, config: &Path) -> Result<()> {
        let mut command = Command::new(program);
        command
            .arg("--config")
            .arg(config)
            .arg(self.name)
            .arg("--parent")
            .arg(std::process::id().to_string())
            .stdin(Stdio::null())
            // Standard output is the supervisor's: its JSON line must stay alone there.
            .stdout(Stdio::null())
            // An own group, so that Ctrl-C reaches the supervisor alone, which stops the
            // children in order.
            .process_group(0);
        if self.restarted {
            command.arg("--resume");
        }
        self.started = Instant::now();
        let child = command
            .spawn()
            .with_context(|| format!("cannot start the service `{}`", self.name))?;
        tracing::info!(service = self.name, pid = child.id(), "started");
        self.child = Some(child);
        Ok(())
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Whether `child` ends within `patience`.
pub fn ends_within(child: &mut Child, patience: Duration) -> bool {
    let give_up = Instant::now() + patience;
    while matches!(child.try_wait(), Ok(None)) {
        let left = give_up.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return false;
        }
        wait_for_an_end(core::iter::once(&*child), left.min(LOOK));
    }
    true
}

/// Waits until one of `children`, none of which has been waited for, has ended, a signal comes, or
/// `at_most` is over.
fn wait_for_an_end<'a>(children: impl Iterator<Item = &'a Child>, at_most: Duration) {
    // One that cannot be watched (before Linux 5.3) is looked at when the time is over.
    let ends: Vec<_> = children
        .filter_map(|child| pidfd_open(pid_of(child), PidfdFlags::empty()).ok())
        .collect();
    let mut ends: Vec<_> = ends
        .iter()
        .map(|end| PollFd::new(end, PollFlags::IN))
        .collect();
    let at_most = Timespec::try_from(at_most).expect("no wait is as long as the clock's range");
    let _ = poll(&mut ends, Some(&at_most));
}

fn pid_of(child: &Child) -> Pid {
    Pid::from_child(child)
}

/// Binds this process's life to its supervisor's: SIGTERM when that one dies, and an end for
/// certain once the shutdown has been asked for.
///
/// # Errors
/// When the supervisor was gone before the kernel could be asked.
pub fn adopt(parent: u32, shutdown: &Shutdown) -> Result<()> {
    rustix::process::set_parent_process_death_signal(Some(Signal::TERM))?;
    let actual = rustix::process::getppid().map_or(0, |pid| pid.as_raw_nonzero().get());
    if actual != i32::try_from(parent)? {
        bail!("the supervisor (process {parent}) is gone");
    }
    let shutdown = shutdown.clone();
    std::thread::Builder::new()
        .name("last-resort".into())
        .spawn(move || {
            while !shutdown.is_requested() {
                std::thread::sleep(Duration::from_millis(100));
            }
            std::thread::sleep(PATIENCE);
            std::process::exit(1);
        })?;
    Ok(())
}
