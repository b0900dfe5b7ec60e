//! The command line of `lager gateway`.

use std::net::SocketAddr;

use clap::Args;
use lager_gateway::{USUAL_FOXGLOVE, USUAL_METRICS};

use super::{ServiceArgs, values};

/// `lager gateway`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager gateway                                  figures at http://127.0.0.1:7430/metrics
  lager gateway --metrics 192.168.1.4:7430       for a Prometheus on another machine
  lager gateway --foxglove                       live views at ws://127.0.0.1:8765
  lager up --metrics --foxglove                  both, started with the robot

It only reads the bus. Everybody who reaches an address may read, without a password. Pages in a
browser of that machine may read the live views as well. Ask for figures by an address in digits, not
by a name: somebody else could have pointed a name to this machine. Import
services/gateway/grafana.json into Grafana, and services/gateway/foxglove.json as a layout into
Foxglove. --foxglove needs a program that was built with `cargo build --release --features foxglove`.")]
pub struct GatewayArgs {
    /// Where Prometheus reads figures [default: from the configuration, or 127.0.0.1:7430]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_METRICS, value_parser = values::listens, help_heading = "Outside")]
    pub metrics: Option<SocketAddr>,
    /// Where Foxglove connects; without HOST:PORT at 127.0.0.1:8765 [default: from the
    /// configuration]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_FOXGLOVE, value_parser = values::listens, help_heading = "Outside")]
    pub foxglove: Option<SocketAddr>,
    /// What `up` tells every service
    #[command(flatten)]
    pub service: ServiceArgs,
}
