//! `lager gateway`: shows the robot to programs outside, until somebody ends it.

use anyhow::{Context, Result};
use lager_gateway::{Addresses, Gateway, GatewayError, USUAL_METRICS};
use lager_ports::Bus;
use lager_supervisor::Service;
use lager_supervisor::console;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_wake::Shutdown;

use crate::cli::GatewayArgs;
use crate::config::Config;
use crate::exit;
use crate::reach;
use crate::time_limit::TimeLimit;

/// The configuration that it runs with, and where it answers. If it starts beside a robot that is
/// up, it takes over that robot's clock, because the boards' silence counts in that time.
///
/// # Errors
/// The robot's folder cannot be read, or this program cannot do what is wanted.
pub fn prepare(config: &Config, args: &GatewayArgs) -> Result<(Config, Addresses)> {
    let mut joined = config.clone();
    if let Some(running) = config.of_running_robot()? {
        joined.speed = running.speed;
        joined.chip.clock = running.chip.clock;
    }
    let configured = &joined.gateway;
    let zenoh = configured.zenoh.settings(args.zenoh.clone());
    let mut wanted = Addresses {
        metrics: args.metrics.or(configured.metrics),
        foxglove: args.foxglove.or(configured.foxglove),
        zenoh: zenoh.map_err(|error| exit::Usage(error.to_string()))?,
    };
    if wanted == Addresses::default() {
        wanted.metrics = Some(USUAL_METRICS.parse().context("the usual address")?);
    }
    wanted.may_be_had(&joined.name.parse()?).map_err(refused)?;
    Ok((joined, wanted))
}

/// Runs it. If a call into the bus hangs, the process ends, and `up` starts another one.
///
/// # Errors
/// An address is not free, or the bus cannot be read.
pub fn run(bus: &Bus, config: &Config, wanted: Addresses, shutdown: &Shutdown) -> Result<()> {
    let is_known = config.gateway.addresses()? == wanted;
    let gateway = Gateway::open(wanted, bus.unit())?;
    if !is_known {
        // Nobody else has said where it answers.
        for line in told(gateway.addresses()) {
            console::print(&line)?;
        }
    }
    // The gateway itself ends when asked, without the watchdog: it has nothing to wait for.
    let patience = TimeLimit::new(config, &Shutdown::new())?;
    let signs = RuntimeFolder::live_as(&config.bus()?, Service::Gateway)?;
    let watchdog = patience.watchdog.showing(signs);
    Ok(gateway.run(bus, &watchdog, shutdown)?)
}

/// Checks, before anything runs, whether a gateway of `up` could work. Returns where it will
/// answer.
///
/// # Errors
/// An address is not free, or this program cannot do what is wanted.
pub fn promise(config: &Config) -> Result<Vec<String>> {
    let wanted = config.gateway.addresses()?;
    // The gateway opens each of them again in a moment.
    wanted.may_be_had(&config.name.parse()?).map_err(refused)?;
    Ok(told(&wanted))
}

/// Refuses what this program was not built for.
fn refused(error: GatewayError) -> anyhow::Error {
    match error {
        GatewayError::NoFoxglove | GatewayError::NoZenoh => exit::Usage(error.to_string()).into(),
        other => other.into(),
    }
}

fn told(at: &Addresses) -> Vec<String> {
    let metrics = at
        .metrics
        .map(|at| reach::listed(at, |at| format!("http://{at}/metrics")))
        .map(|at| format!("figures for Prometheus are at {at}"));
    let foxglove = at
        .foxglove
        .map(|at| reach::listed(at, |at| format!("ws://{at}")))
        .map(|at| format!("Foxglove opens a connection to {at}"));
    let zenoh = at.zenoh.as_ref().map(|settings| {
        let endpoint = &settings.endpoint;
        format!("listeners with Zenoh connect to {endpoint}")
    });
    metrics.into_iter().chain(foxglove).chain(zenoh).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_without_zenoh_says_how_to_build_one_that_has_it() {
        let mut config = Config::default();
        config.gateway.zenoh.endpoint = Some("unixsock-stream/zenoh".parse().expect("an endpoint"));
        let promised = promise(&config);
        if lager_gateway::HAS_ZENOH {
            assert_eq!(
                promised.expect("an endpoint").as_slice(),
                ["listeners with Zenoh connect to unixsock-stream/zenoh"]
            );
        } else {
            let refused = promised.expect_err("it cannot");
            assert!(refused.is::<exit::Usage>());
            assert!(
                refused.to_string().contains("--features zenoh`"),
                "{refused}"
            );
        }
    }

    #[test]
    fn a_program_without_foxglove_says_how_to_build_one_that_has_it() {
        let mut config = Config::default();
        config.gateway.foxglove = Some("127.0.0.1:0".parse().expect("an address"));
        let promised = promise(&config);
        if lager_gateway::HAS_FOXGLOVE {
            assert_eq!(
                promised.expect("an address").as_slice(),
                ["Foxglove opens a connection to ws://127.0.0.1:0"]
            );
        } else {
            let refused = promised.expect_err("it cannot");
            assert!(refused.is::<exit::Usage>());
            let how = "`cargo build --release --features foxglove`";
            assert!(refused.to_string().contains(how), "{refused}");
        }
    }
}
