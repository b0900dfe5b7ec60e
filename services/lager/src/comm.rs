//! `lager comm`: starts the communication unit, and guards its calls into the bus.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};
use lager_comm::{CommConfig, Commissioner};
use lager_lines::Name;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_supervisor::signals;
use lager_wake::{GivenUp, Shutdown, Watchdog};

use crate::cli::CommArgs;
use crate::config::{Config, StationSection};
use crate::doctor;

/// How long one call into the bus may take, in real time.
const CALL: Duration = Duration::from_secs(3);

/// The configuration that it runs with, and what it does. If it starts beside a robot that is up,
/// it takes over that robot's clock, because leases count in that time.
///
/// # Errors
/// A station cannot use the robot's name.
pub fn prepare(config: &Config, args: &CommArgs) -> Result<(Config, CommConfig)> {
    let mut joined = config.clone();
    if let Some(running) = config.of_running_robot()? {
        joined.speed = running.speed;
        joined.chip.clock = running.chip.clock;
        joined.comm.secret = joined.comm.secret.or(running.comm.secret);
    }
    let name = Name::new(joined.name.clone())
        .with_context(|| format!("the robot cannot be called {:?} by a station", joined.name))?;
    let wanted = CommConfig {
        station: (args.station.clone())
            .or_else(|| joined.station.address.clone())
            .unwrap_or_else(|| StationSection::USUAL.to_owned()),
        name,
        secret: args.secret.clone().or_else(|| joined.comm.secret.clone()),
        link_lost: joined.comm.link_lost,
        pack: joined.pack(),
        resume: args.service.resume,
        commissioner: commissioner(&joined)?,
        machine: doctor::soon::machine,
    };
    Ok((joined, wanted))
}

/// This very program, with the lines of a station; `None` beside no robot.
fn commissioner(config: &Config) -> Result<Option<Commissioner>> {
    let Some(running) = RuntimeFolder::running(&config.bus()?)? else {
        return Ok(None);
    };
    let words = ["commission", "--lines"].map(OsString::from);
    Ok(Some(Commissioner {
        // Also when its file has been replaced meanwhile.
        program: PathBuf::from("/proc/self/exe"),
        arguments: [OsString::from("--config"), running.into()]
            .into_iter()
            .chain(words)
            .collect(),
    }))
}

/// Ends this process when a call into the bus hangs, with a sentence that names the call. `up`
/// starts another one.
///
/// # Errors
/// The system gives no thread for it.
pub fn watch(shutdown: &Shutdown) -> Result<Watchdog> {
    let end = |why| match why {
        GivenUp::Interrupted => std::process::exit(signals::INTERRUPTED),
        GivenUp::Hung { what } => {
            tracing::error!("{what} has taken {} s; it hangs", CALL.as_secs());
            std::process::exit(1);
        }
    };
    Watchdog::start(CALL, shutdown, end).context("there is no thread for the watch over the bus")
}
