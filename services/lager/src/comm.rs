//! `lager comm`: what the communication unit is told when it starts.

use anyhow::{Context, Result};
use lager_comm::CommConfig;
use lager_lines::Name;

use crate::cli::CommArgs;
use crate::config::{Config, StationSection};
use crate::runtime::RuntimeFolder;

/// The configuration it runs with, and what it does. Started beside a robot that is up it takes
/// over that robot's clock, in which leases count.
///
/// # Errors
/// The robot's name is none that the external computer could call it by.
pub fn prepare(config: &Config, args: &CommArgs) -> Result<(Config, CommConfig)> {
    let mut joined = config.clone();
    if let Some(running) = RuntimeFolder::running(config)? {
        joined.speed = running.speed;
        joined.chip.clock = running.chip.clock;
    }
    let name = Name::new(joined.name.clone())
        .with_context(|| format!("the robot cannot be called {:?} by a station", joined.name))?;
    let wanted = CommConfig {
        station: (args.station.clone())
            .or_else(|| joined.station.address.clone())
            .unwrap_or_else(|| StationSection::USUAL.to_owned()),
        name,
        link_lost: joined.comm.link_lost.into(),
        resume: args.service.resume,
    };
    Ok((joined, wanted))
}
