//! How long a tool waits for the bus, and how it ends when that is in vain.
//!
//! A tool has nothing to put in order before it ends: what it leaves on the bus is swept like that
//! of any dead process. So one Ctrl-C ends it whatever it is doing, and it ends by itself, with a
//! sentence, when the bus does not answer.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use lager_ports::{GivenUp, Shutdown, Watchdog};

use crate::config::Config;
use crate::voice::{self, Speaker};
use crate::{cut_short, diagnose, exit};

/// How long one call into the bus may take, in real time. The tool ends within three seconds.
const CALL: Duration = Duration::from_millis(2_800);
/// How often the wish to end is looked at in a pause.
const LOOK: Duration = Duration::from_millis(10);

/// What one tool needs in order not to hang.
#[derive(Clone, Debug)]
pub struct Patience {
    /// What watches over its calls into the bus.
    pub watchdog: Watchdog,
    /// The wish to end.
    pub shutdown: Shutdown,
}

impl Patience {
    /// Watches from now on, and ends this process when it is given up.
    pub fn new(config: &Config, shutdown: &Shutdown) -> Result<Self> {
        cut_short::say_so()?;
        let looked_at = config.clone();
        let watchdog = Watchdog::start(CALL, shutdown, move |why| give_up(&looked_at, why))
            .context("there is no thread for the watch over the bus")?;
        Ok(Self {
            watchdog,
            shutdown: shutdown.clone(),
        })
    }

    /// Waits that long, outside the watch over the bus, and then goes on under it.
    ///
    /// # Errors
    /// [`exit::Interrupted`] when the end is wished for.
    pub fn pause(&self, pause: Duration) -> Result<()> {
        self.watchdog.leave();
        let end = Instant::now() + pause;
        loop {
            if self.shutdown.is_requested() {
                return Err(exit::Interrupted.into());
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            std::thread::sleep(left.min(LOOK));
        }
        self.watchdog.enter("waiting for the robot");
        Ok(())
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
    let causes = diagnose::causes(config);
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
