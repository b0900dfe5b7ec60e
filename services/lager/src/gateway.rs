//! `lager gateway`: what the robot shows to programs outside, until it is told to end.

use std::net::{SocketAddr, TcpListener};

use anyhow::{Context, Result};
use lager_gateway::{Gateway, USUAL_METRICS};
use lager_ports::{Bus, Shutdown};

use crate::cli::GatewayArgs;
use crate::config::Config;
use crate::patience::Patience;
use crate::runtime::RuntimeFolder;

/// The configuration it runs with, and where it answers. Started beside a robot that is up it takes
/// over that robot's clock, in which the boards' silence counts.
///
/// # Errors
/// The robot's folder cannot be read.
pub fn prepare(config: &Config, args: &GatewayArgs) -> Result<(Config, SocketAddr)> {
    let mut joined = config.clone();
    if let Some(running) = RuntimeFolder::running(config)? {
        joined.speed = running.speed;
        joined.chip.clock = running.chip.clock;
    }
    let usual = || USUAL_METRICS.parse().context("the usual address");
    let metrics = match args.metrics.or(joined.gateway.metrics) {
        Some(metrics) => metrics,
        None => usual()?,
    };
    Ok((joined, metrics))
}

/// Runs it. A call into the bus that hangs ends the process, and it is started again.
///
/// # Errors
/// The address cannot be had, or the bus cannot be read.
pub fn run(bus: &Bus, config: &Config, metrics: SocketAddr, shutdown: &Shutdown) -> Result<()> {
    let gateway = Gateway::open(metrics)?;
    if config.gateway.metrics != Some(metrics) {
        // Nobody else has said where it is.
        crate::say(&told(gateway.address()?))?;
    }
    // The wish to end is heeded here and not by the watch: there is nothing to wait for.
    let patience = Patience::new(config, &Shutdown::new())?;
    Ok(gateway.run(bus, &patience.watchdog, shutdown)?)
}

/// Refuses an address that a gateway of `up` could not have, before anything runs, and says where
/// the figures will be.
///
/// # Errors
/// The address cannot be had.
pub fn promise(config: &Config) -> Result<Option<String>> {
    let Some(metrics) = config.gateway.metrics else {
        return Ok(None);
    };
    // It is opened again in a moment, by the gateway.
    TcpListener::bind(metrics)
        .with_context(|| format!("--metrics: {metrics} cannot be had; choose another address"))?;
    Ok(Some(told(metrics)))
}

fn told(metrics: SocketAddr) -> String {
    format!("figures for Prometheus are at http://{metrics}/metrics")
}
