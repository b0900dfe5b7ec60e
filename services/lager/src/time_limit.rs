//! How long a tool waits for the bus, and how it ends if the bus does not answer.
//!
//! A tool has nothing to clean up before it ends: other processes remove what it leaves on the bus,
//! as for any dead process. So one Ctrl-C ends it whatever it is doing. It ends by itself, with a
//! sentence, when the bus does not answer.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use lager_ports::CallError;
use lager_supervisor::console;
use lager_supervisor::signals;
use lager_wake::{GivenUp, Shutdown, Watchdog};

use crate::config::Config;
use crate::traces::Speaker;
use crate::{diagnose, exit, overload, sigbus};

/// How long one call into the bus may take, in real time. A command that waits for the robot may
/// take as long in all. The tool ends within three seconds.
const CALL: Duration = Duration::from_millis(2_800);
/// How long a command waits for the robot in all its steps together, in real time. It is shorter,
/// so that the command can still say which step failed.
const ANSWER: Duration = Duration::from_millis(2_500);
/// How often a pause checks whether somebody ends the tool.
const LOOK: Duration = Duration::from_millis(10);

/// Whether this process has waited for the robot in vain.
static IN_VAIN: AtomicBool = AtomicBool::new(false);

/// Whether an error comes from a wait in vain. Then a busy machine may be the cause.
pub fn was_in_vain(error: &anyhow::Error) -> bool {
    IN_VAIN.load(Ordering::Relaxed) || error.chain().any(|cause| cause.is::<CallError>())
}

/// What ends a tool that is given up.
type End = Box<dyn FnOnce(GivenUp) + Send>;

/// What a tool needs so that it never hangs.
#[derive(Clone, Debug)]
pub struct TimeLimit {
    /// Guards its calls into the bus.
    pub watchdog: Watchdog,
    /// The request to end.
    pub shutdown: Shutdown,
    give_up: Instant,
}

impl TimeLimit {
    /// Starts the guard. It ends this process when somebody ends the tool.
    pub fn new(config: &Config, shutdown: &Shutdown) -> Result<Self> {
        Self::with(config, shutdown, Watchdog::start)
    }

    /// The same for a tool that finishes its work in order, however long the disk takes. A request
    /// to end only cuts short a call into the bus.
    pub fn in_order(config: &Config, shutdown: &Shutdown) -> Result<Self> {
        Self::with(config, shutdown, Watchdog::start_in_order)
    }

    fn with(
        config: &Config,
        shutdown: &Shutdown,
        start: impl FnOnce(Duration, &Shutdown, End) -> io::Result<Watchdog>,
    ) -> Result<Self> {
        sigbus::say_so()?;
        let looked_at = config.clone();
        let end = Box::new(move |why| give_up(&looked_at, why));
        let watchdog =
            start(CALL, shutdown, end).context("there is no thread for the watch over the bus")?;
        Ok(Self {
            watchdog,
            shutdown: shutdown.clone(),
            give_up: Instant::now() + ANSWER,
        })
    }

    /// The same with at most this time from now on.
    pub fn at_most(&self, most: Duration) -> Self {
        Self {
            give_up: self.give_up.min(Instant::now() + most),
            ..self.clone()
        }
    }

    /// Whether the command has waited long enough for the robot.
    pub fn is_over(&self) -> bool {
        let is_over = Instant::now() >= self.give_up;
        IN_VAIN.fetch_or(is_over, Ordering::Relaxed);
        is_over
    }

    /// How much longer the command may wait.
    pub fn left(&self) -> Duration {
        self.give_up.saturating_duration_since(Instant::now())
    }

    /// Whether a robot that was last heard at that time has been silent for too long. A command
    /// that has just begun waits only for its first answer.
    pub fn is_silent(&self, heard: Option<Instant>) -> bool {
        let is_silent = heard.map_or_else(|| self.is_over(), |heard| heard.elapsed() >= ANSWER);
        IN_VAIN.fetch_or(is_silent, Ordering::Relaxed);
        is_silent
    }

    /// Waits for this time without the guard, and then begins a new call with it. For commands that
    /// last.
    ///
    /// # Errors
    /// [`exit::Interrupted`] when somebody ends the tool.
    pub fn rest(&self, pause: Duration) -> Result<()> {
        self.watchdog.leave();
        self.pause(pause)?;
        self.watchdog.enter("waiting for the robot");
        Ok(())
    }

    /// Waits for this time within the present call.
    ///
    /// # Errors
    /// [`exit::Interrupted`] when somebody ends the tool.
    pub fn pause(&self, pause: Duration) -> Result<()> {
        let end = Instant::now() + pause;
        loop {
            if self.shutdown.is_requested() {
                return Err(exit::Interrupted.into());
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            std::thread::sleep(left.min(LOOK));
        }
    }
}

/// Ends the process: a call that hangs cannot be stopped.
fn give_up(config: &Config, why: GivenUp) {
    lager_monitor::leave_screen();
    let what = match why {
        GivenUp::Interrupted => std::process::exit(signals::INTERRUPTED),
        GivenUp::Hung { what } => what,
    };
    console::complain(&Speaker::Tool.line(&format!(
        "the bus of the robot `{}` does not answer: {what} has taken {:.1} s",
        config.name,
        CALL.as_secs_f64()
    )));
    let mut causes = diagnose::causes(config);
    causes.extend(overload::cause());
    if causes.is_empty() {
        console::complain(&Speaker::Tool.line(
            "a process that was killed while it made a shared file leaves such a bus; \
             `lager doctor --fix` mends it",
        ));
    }
    for cause in causes {
        console::complain(&Speaker::Tool.line(&cause));
    }
    std::process::exit(1);
}
