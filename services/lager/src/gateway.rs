//! `lager gateway`: shows the robot to programs outside, until somebody ends it.

use anyhow::{Context, Result};
use lager_gateway::{Addresses, Gateway, GatewayError, USUAL_METRICS};
use lager_ports::Bus;
use lager_stop::StopPage;
use lager_supervisor::Service;
use lager_supervisor::console;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_wake::{Shutdown, Watchdog};

use crate::afar;
use crate::cli::GatewayArgs;
use crate::config::Config;
#[cfg(feature = "zenoh")]
use crate::config::ZenohSection;
use crate::exit;
use crate::reach;
use crate::time_limit::TimeLimit;

/// How often a router looks whether somebody ends it.
#[cfg(feature = "zenoh")]
const LOOK: std::time::Duration = std::time::Duration::from_millis(20);

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
    let zenoh = configured
        .zenoh
        .settings(args.zenoh.clone(), args.via.clone());
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
    let stop_word = bus.home().folder_of(bus.unit()).join(StopPage::FILE);
    Ok(gateway.run(bus, Some(stop_word), &watchdog, shutdown)?)
}

/// Shows figures and views of a robot elsewhere, from its own gateway.
///
/// # Errors
/// An address is not free, or that gateway does not answer.
pub fn run_from_afar(config: &Config, args: &GatewayArgs, shutdown: &Shutdown) -> Result<()> {
    let endpoint = args.remote.as_ref().context("clap demands it")?;
    let mut wanted = Addresses {
        metrics: args.metrics,
        foxglove: args.foxglove,
        zenoh: None,
    };
    if wanted == Addresses::default() {
        wanted.metrics = Some(USUAL_METRICS.parse().context("the usual address")?);
    }
    let robot = config.name.parse()?;
    wanted.may_be_had(&robot).map_err(refused)?;
    let remote = afar::call(config, endpoint, shutdown)?;
    let gateway = Gateway::open(wanted, &robot)?;
    for line in told(gateway.addresses()) {
        console::print(&line)?;
    }
    // Nothing of a link can hang.
    Ok(gateway.run(&remote, None, &Watchdog::default(), shutdown)?)
}

/// Runs a router until somebody ends it.
///
/// # Errors
/// It cannot listen there.
#[cfg(feature = "zenoh")]
pub fn route(config: &Config, args: &GatewayArgs, shutdown: &Shutdown) -> Result<()> {
    let endpoint = args.router.as_ref().context("clap demands it")?;
    let usage = |error: lager_remote::SettingsError| exit::Usage(error.to_string());
    let zenoh = ZenohSection {
        router: None,
        ..config.gateway.zenoh.clone()
    };
    let settings = zenoh
        .settings(Some(endpoint.clone()), None)
        .map_err(usage)?;
    let proof = settings.and_then(|settings| settings.proof);
    let _router = lager_remote::Router::open(endpoint, &args.robots, proof.as_ref())?;
    console::print(&format!(
        "robots and listeners with Zenoh connect to {endpoint}"
    ))?;
    while !shutdown.is_requested() {
        std::thread::sleep(LOOK);
    }
    Ok(())
}

/// This program cannot.
///
/// # Errors
/// Always, as it was built without the feature `zenoh`.
#[cfg(not(feature = "zenoh"))]
pub fn route(_config: &Config, _args: &GatewayArgs, _shutdown: &Shutdown) -> Result<()> {
    Err(refused(GatewayError::NoZenoh))
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
    let zenoh = at.zenoh.as_ref();
    let listens = zenoh.and_then(|settings| settings.endpoint.as_ref());
    let listens = listens.map(|at| format!("listeners with Zenoh connect to {at}"));
    let router = zenoh.and_then(|settings| settings.router.as_ref());
    let router = router.map(|at| format!("samples go to the router at {at}"));
    let all = [metrics, foxglove, listens, router];
    all.into_iter().flatten().collect()
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
