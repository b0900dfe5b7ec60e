//! `lager commission`: a person finds out how the robot is built, at a terminal or at the page of a
//! station.
//!
//! [`Commissioning`](lager_commission::Commissioning) decides everything. `bench.rs` is its bus, and
//! who asks the person is apart from it: `terminal.rs`, and `lines.rs` for comm, which starts this
//! program for a page.

mod bench;
mod lines;
mod open;
mod terminal;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_commission::{Built, Said};
use lager_ports::{Bus, BusConfig};
use lager_station::files::Hold;
use lager_supervisor::console;
use lager_supervisor::hands::Hands;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_topics::{Outcome, Role, ThoughtKind};
use lager_wake::Shutdown;

use crate::cli::CommissionArgs;
use crate::config::Config;
use crate::diagnose;
use crate::exit;
use crate::time_limit::TimeLimit;
use bench::Bench;
#[cfg(test)]
pub use bench::uncalibrate;
use open::OpenCalibration;

/// How long `up` may take to begin to start the robot again, and how often this looks.
const AGAIN: Duration = Duration::from_secs(20);
const LOOK: Duration = Duration::from_millis(20);

/// Runs it. `configured` is the configuration without the description of the robot.
///
/// # Errors
/// The robot is not up, or the description cannot be written.
pub fn run(configured: &Config, args: &CommissionArgs, shutdown: &Shutdown) -> Result<ExitCode> {
    if args.lines {
        return lines::run(configured, args, shutdown);
    }
    if args.restart {
        tell(&restart(configured, shutdown)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let robot = Robot::new(configured)?;
    if args.undo {
        tell(&robot.undo(shutdown)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let (mut bench, patience) = robot.bench(shutdown)?;
    let Some(built) = terminal::converse(&mut bench, &patience, shutdown)? else {
        tell(&Said::nothing())?;
        return match shutdown.is_requested() {
            true => Err(exit::Interrupted.into()),
            false => Ok(ExitCode::SUCCESS),
        };
    };
    patience.watchdog.leave();
    let new = robot.with(&built);
    let path = robot.keep(&new, &bench).with_context(|| {
        // A quarter of an hour's work must not be lost.
        let _ = console::print(new.described().trim_end());
        "the description above is not saved"
    })?;
    patience.watchdog.enter("waiting for the robot");
    bench.settle(&built, ThoughtKind::SetUpInTerminal);
    tell(&Said::kept(&path))?;
    Ok(ExitCode::SUCCESS)
}

/// Prints how it ended.
fn tell(said: &Said) -> Result<()> {
    let text = said.text(terminal::language());
    match terminal::hint(said) {
        Some(command) => console::print(&format!("{text} (`{command}`)")),
        None => console::print(&text),
    }
}

/// Has the robot started again, so that all of it uses the description that is saved.
///
/// # Errors
/// It is not up, or its `up` does not start it again.
fn restart(configured: &Config, shutdown: &Shutdown) -> Result<Said> {
    diagnose::must_be_up(configured)?;
    let bus = configured.bus()?;
    let before = RuntimeFolder::start_of(&bus)?;
    RuntimeFolder::ask_to_start_again(&bus)?;
    let asked = Instant::now();
    while RuntimeFolder::start_of(&bus)? == before {
        if shutdown.is_requested() {
            return Err(exit::Interrupted.into());
        }
        if asked.elapsed() > AGAIN {
            bail!(
                "the robot is asked to start again, and has not within {} s; what `lager up` says tells why",
                AGAIN.as_secs()
            );
        }
        std::thread::sleep(LOOK);
    }
    Ok(Said::restarted())
}

/// The robot that is commissioned by this process alone.
struct Robot {
    /// What the configuration says without the description.
    configured: Config,
    /// The same with the description, as the robot runs with it.
    running: Config,
    /// Two people would try two descriptions on one robot.
    _only_one: Option<Hold>,
}

impl Robot {
    /// # Errors
    /// Somebody commissions it already, or there is no place for a description: a person would work
    /// for a quarter of an hour in vain.
    fn new(configured: &Config) -> Result<Self> {
        let running = configured.of_running_robot()?;
        let running = running.unwrap_or_else(|| configured.clone());
        Ok(Self {
            _only_one: Hold::of(&running.place_of_description()?)?,
            configured: configured.clone(),
            running,
        })
    }

    /// Puts the former description back, and the former thresholds of the line sensors if they have
    /// others since. Only their board knows those, so the robot must be up for that.
    fn undo(&self, shutdown: &Shutdown) -> Result<Said> {
        let open = self.calibration()?;
        let was_killed = open.is_there();
        if was_killed {
            // A commissioning was killed after it had calibrated. There may be no description of
            // before it.
            if !self.uncalibrate(shutdown) {
                return Ok(Said::undone_but_thresholds(
                    &self.running.place_of_description()?,
                ));
            }
            open.end()?;
            if !self.running.has_former_description()? {
                return Ok(Said::undone(&self.running.place_of_description()?));
            }
        }
        let (path, has_calibrated) = self.running.forget_description()?;
        if !has_calibrated {
            return Ok(Said::undone(&path));
        }
        // The board knows only what was in force before its last calibration.
        if was_killed || !self.uncalibrate(shutdown) {
            return Ok(Said::undone_but_thresholds(&path));
        }
        self.running.forget_calibration()?;
        Ok(Said::undone(&path))
    }

    /// The note of a calibration that was neither saved nor taken back.
    fn calibration(&self) -> Result<OpenCalibration> {
        let path = self.running.place_of_description()?;
        Ok(OpenCalibration::beside(&path))
    }

    /// Asks the bridge to have the former thresholds put back. Returns whether they are.
    fn uncalibrate(&self, shutdown: &Shutdown) -> bool {
        let ask = || -> Result<Option<Outcome>> {
            let (bus, _patience) = self.bus(shutdown)?;
            let answer = Hands::new(&bus)?.ask(bench::uncalibrate())?;
            Ok(answer.outcome.get())
        };
        let outcome = ask();
        let are_back = matches!(outcome, Ok(Some(Outcome::Done)));
        if !are_back {
            tracing::warn!("the former thresholds are not back: {outcome:?}");
        }
        are_back
    }

    /// The robot on its bus, which is used only under the watch.
    ///
    /// # Errors
    /// The robot is not up, or its bus cannot be joined.
    fn bench(&self, shutdown: &Shutdown) -> Result<(Bench, TimeLimit)> {
        let (bus, patience) = self.bus(shutdown)?;
        let built = self.running.commissioned();
        let bench = Bench::new(&self.configured, bus, built, self.calibration()?)?;
        Ok((bench, patience))
    }

    fn bus(&self, shutdown: &Shutdown) -> Result<(Bus, TimeLimit)> {
        diagnose::must_be_up(&self.configured)?;
        let patience = TimeLimit::in_order(&self.configured, shutdown)?;
        let BusConfig { speed, clock, .. } = self.running.bus()?;
        let bus = BusConfig {
            speed,
            clock,
            ..self.configured.bus()?
        };
        patience.watchdog.enter("joining the bus");
        Ok((Bus::open(&bus, Role::Operator)?, patience))
    }

    /// The robot as it was found out.
    fn with(&self, built: &Built) -> Config {
        let mut new = self.running.clone();
        new.take_commissioned(built);
        new
    }

    /// Writes what was found out. Returns the file.
    fn keep(&self, new: &Config, bench: &Bench) -> Result<PathBuf> {
        let path = new.keep_description(&self.configured, bench.machine.has_calibrated())?;
        // From now on the text of before says it.
        self.calibration()?.end()?;
        Ok(path)
    }
}
