//! How long a tool waits for the bus, and how it ends when that is in vain.
//!
//! A tool has nothing to put in order before it ends: what it leaves on the bus is swept like that
//! of any dead process. So one Ctrl-C ends it whatever it is doing, and it ends by itself, with a
//! sentence, when the bus does not answer.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use lager_ports::{CallError, GivenUp, Shutdown, Watchdog};

use crate::config::Config;
use crate::voice::{self, Speaker};
use crate::{cut_short, diagnose, exit, overload};

/// How long one call into the bus may take, in real time, and a command that waits for the robot as
/// a whole. The tool ends within three seconds.
const CALL: Duration = Duration::from_millis(2_800);
/// How long a command waits for the robot in all its steps together, in real time, so that it can
/// say which of them was in vain.
const ANSWER: Duration = Duration::from_millis(2_500);
/// How often the wish to end is looked at in a pause.
const LOOK: Duration = Duration::from_millis(10);

/// Whether this process has waited for the robot in vain.
static IN_VAIN: AtomicBool = AtomicBool::new(false);

/// Whether an error comes of a wait that was in vain: then a busy machine may be the cause.
pub fn was_in_vain(error: &anyhow::Error) -> bool {
    IN_VAIN.load(Ordering::Relaxed) || error.chain().any(|cause| cause.is::<CallError>())
}

/// What ends a tool that is given up.
type End = Box<dyn FnOnce(GivenUp) + Send>;

/// What one tool needs in order not to hang.
#[derive(Clone, Debug)]
pub struct Patience {
    /// What watches over its calls into the bus.
    pub watchdog: Watchdog,
    /// The wish to end.
    pub shutdown: Shutdown,
    give_up: Instant,
}

impl Patience {
    /// Watches from now on, and ends this process when it is given up.
    pub fn new(config: &Config, shutdown: &Shutdown) -> Result<Self> {
        Self::with(config, shutdown, Watchdog::start)
    }

    /// The same for a tool that ends in order, however long the disk takes: only a call into the
    /// bus is cut short by the wish to end.
    pub fn in_order(config: &Config, shutdown: &Shutdown) -> Result<Self> {
        Self::with(config, shutdown, Watchdog::start_in_order)
    }

    fn with(
        config: &Config,
        shutdown: &Shutdown,
        start: impl FnOnce(Duration, &Shutdown, End) -> io::Result<Watchdog>,
    ) -> Result<Self> {
        cut_short::say_so()?;
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

    /// Whether the command has waited for the robot for long enough.
    pub fn is_over(&self) -> bool {
        let is_over = Instant::now() >= self.give_up;
        IN_VAIN.fetch_or(is_over, Ordering::Relaxed);
        is_over
    }

    /// How long the command may wait yet.
    pub fn left(&self) -> Duration {
        self.give_up.saturating_duration_since(Instant::now())
    }

    /// Whether a robot that was last heard then has been silent for too long. A command that has
    /// just begun waits no longer than for its first answer.
    pub fn is_silent(&self, heard: Option<Instant>) -> bool {
        let is_silent = heard.map_or_else(|| self.is_over(), |heard| heard.elapsed() >= ANSWER);
        IN_VAIN.fetch_or(is_silent, Ordering::Relaxed);
        is_silent
    }

    /// Waits that long, outside the watch over the bus, and then goes on under it with a new call:
    /// for commands that last.
    ///
    /// # Errors
    /// [`exit::Interrupted`] when the end is wished for.
    pub fn rest(&self, pause: Duration) -> Result<()> {
        self.watchdog.leave();
        self.pause(pause)?;
        self.watchdog.enter("waiting for the robot");
        Ok(())
    }

    /// Waits that long within the one call that the command is.
    ///
    /// # Errors
    /// [`exit::Interrupted`] when the end is wished for.
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

/// Ends the process; what hangs cannot be called back.
fn give_up(config: &Config, why: GivenUp) {
    lager_monitor::leave_screen();
    let what = match why {
        GivenUp::Interrupted => std::process::exit(exit::INTERRUPTED),
        GivenUp::Hung { what } => what,
    };
    voice::say(&Speaker::Tool.line(&format!(
        "the bus of the robot `{}` does not answer: {what} has taken {:.1} s",
        config.name,
        CALL.as_secs_f64()
    )));
    let mut causes = diagnose::causes(config);
    causes.extend(overload::cause());
    if causes.is_empty() {
        voice::say(&Speaker::Tool.line(
            "a process that was killed while it made a shared file leaves such a bus; \
             `lager doctor --fix` mends it",
        ));
    }
    for cause in causes {
        voice::say(&Speaker::Tool.line(&cause));
    }
    std::process::exit(1);
}
