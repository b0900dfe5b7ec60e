//! `lager stop`: sets the robot's stop word and prints whether the wheels stand.
//!
//! It opens nothing of the bus. So it works when the bus is full, when the bus's files are gone or
//! damaged, and when the bridge is frozen. It reads the bridge's answers in the file of the stop
//! word, and asks the kernel about the bridge's process.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_home::Clock;
use lager_stop::{Stop, StopPage, StopWord, Verdict, judge, process_state};
use lager_topics::{Role, StopCause};

use crate::config::{Body, Config};

/// How long the robot may take to stand, in real time.
const PATIENCE: Duration = Duration::from_millis(2_500);

/// How long to wait for a bridge that has not been seen yet.
const SHORT: Duration = Duration::from_millis(300);

/// How often the answer is checked.
const LOOK: Duration = Duration::from_millis(1);

/// Every failure begins with this.
const MOVING: &str = "the robot may still be moving";

/// The stop word of the robot in `config`.
pub fn path(config: &Config) -> Result<PathBuf> {
    let bus = config.bus()?;
    Ok(bus.home()?.folder_of(&bus.unit).join(StopPage::FILE))
}

/// The stop that is set, if there is one.
pub fn current(config: &Config) -> Result<Option<Stop>> {
    Ok(StopWord::read(&path(config)?)?.and_then(|told| told.stop()))
}

/// Stops the robot for this cause and waits until its wheels stand.
pub fn run(config: &Config, cause: StopCause) -> Result<String> {
    let path = path(config).context(MOVING)?;
    let folder = path.parent().unwrap_or(&path);
    let was_there = folder.exists();
    let start = Instant::now();
    let ordered_ns = Clock::monotonic_ns();
    let set = || StopWord::set(&path, Role::Operator, cause).context(MOVING);
    set()?;
    loop {
        let Some(told) = StopWord::read(&path).context(MOVING)? else {
            // Somebody has removed the file meanwhile.
            set()?;
            continue;
        };
        let now_ns = Clock::monotonic_ns();
        let bridge = told
            .bridge()
            .map(|process| (process, process_state(process)));
        let why = match judge(&told, ordered_ns, now_ns, bridge) {
            Verdict::Stands(said) => return Ok(said),
            Verdict::Never(why) => bail!("{MOVING}: {why}"),
            Verdict::NotYet(why) => why,
        };
        let is_known = was_there && (told.bridge().is_some() || folder.join("up.lock").exists());
        let patience = if is_known { PATIENCE } else { SHORT };
        if start.elapsed() >= patience {
            if !was_there {
                bail!(
                    "no robot `{}` has ever been up in {}; one that starts there now is stopped until `lager resume`",
                    config.name,
                    folder.parent().unwrap_or(folder).display()
                );
            }
            bail!("{MOVING}: {why}");
        }
        std::thread::sleep(LOOK);
    }
}

/// Stops real boards before the robot starts. A stop that is already set stays.
pub fn at_start(config: &Config) -> Result<()> {
    if config.body == Body::Serial && current(config)?.is_none() {
        StopWord::set(&path(config)?, Role::Supervisor, StopCause::FreshStart)?;
    }
    Ok(())
}
