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

It only reads. Whoever reaches an address may read, too, and is not asked who he is; the live views
also any page that a browser of that machine shows. Ask for figures by number, not by a name: a name
could be one that somebody else has pointed here. Import services/gateway/grafana.json into Grafana,
and services/gateway/foxglove.json as a layout into Foxglove. --foxglove needs a program that was
built with `cargo build --release --features foxglove`.")]
pub struct GatewayArgs {
    /// Where Prometheus reads figures [default: as configured, or 127.0.0.1:7430]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_METRICS, value_parser = values::listens, help_heading = "Outside")]
    pub metrics: Option<SocketAddr>,
    /// Where Foxglove looks on; without HOST:PORT at 127.0.0.1:8765 [default: as configured]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_FOXGLOVE, value_parser = values::listens, help_heading = "Outside")]
    pub foxglove: Option<SocketAddr>,
    /// What every service is told
    #[command(flatten)]
    pub service: ServiceArgs,
}
