//! `--remote`: calls a robot's gateway for the tools.

use anyhow::Result;
use lager_remote::Endpoint;
use lager_wake::Shutdown;

use crate::config::Config;
use crate::exit;

/// This program can call none, so there is never one.
#[cfg(not(feature = "zenoh"))]
pub use lager_ports::Bus as Remote;
/// A robot elsewhere, as a place where samples come from.
#[cfg(feature = "zenoh")]
pub use lager_remote::Remote;

/// Connects to the gateway of the robot that the configuration names.
///
/// # Errors
/// It does not answer, or somebody ends the tool meanwhile.
#[cfg(feature = "zenoh")]
pub fn call(config: &Config, endpoint: &Endpoint, shutdown: &Shutdown) -> Result<Remote> {
    let (proof, robot) = (config.gateway.zenoh.proof()?, config.name.parse()?);
    Remote::open(endpoint, &robot, proof.as_ref(), shutdown).map_err(failed)
}

/// The same, and whoever calls says by himself that the gateway is silent.
///
/// # Errors
/// As [`call`].
#[cfg(feature = "zenoh")]
pub fn call_quietly(config: &Config, endpoint: &Endpoint, shutdown: &Shutdown) -> Result<Remote> {
    let remote = call(config, endpoint, shutdown)?;
    remote.be_quiet();
    Ok(remote)
}

/// The error of a call.
#[cfg(feature = "zenoh")]
pub fn failed(error: lager_remote::RemoteError) -> anyhow::Error {
    match error {
        lager_remote::RemoteError::Ended => exit::Interrupted.into(),
        error => error.into(),
    }
}

/// This program cannot.
///
/// # Errors
/// Always, as it was built without the feature `zenoh`.
#[cfg(not(feature = "zenoh"))]
pub fn call(_config: &Config, _endpoint: &Endpoint, _shutdown: &Shutdown) -> Result<Remote> {
    Err(without())
}

/// This program cannot.
///
/// # Errors
/// As [`call`].
#[cfg(not(feature = "zenoh"))]
pub fn call_quietly(config: &Config, endpoint: &Endpoint, shutdown: &Shutdown) -> Result<Remote> {
    call(config, endpoint, shutdown)
}

/// What a program says that was built without the feature `zenoh`.
#[cfg(not(feature = "zenoh"))]
pub fn without() -> anyhow::Error {
    exit::Usage(lager_gateway::GatewayError::NoZenoh.to_string()).into()
}
