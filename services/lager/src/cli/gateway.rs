//! The command line of `lager gateway`.

use std::net::SocketAddr;

use clap::Args;
use lager_gateway::{USUAL_FOXGLOVE, USUAL_METRICS, USUAL_ZENOH};
use lager_home::UnitName;
use lager_remote::Endpoint;

use super::{ServiceArgs, values};

/// `lager gateway`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager gateway                                  figures at http://127.0.0.1:7430/metrics
  lager gateway --metrics 192.168.1.4:7430       for a Prometheus on another machine
  lager gateway --foxglove                       live views at ws://127.0.0.1:8765
  lager gateway --zenoh                          samples for listeners of this machine
  lager gateway --zenoh tls/192.168.1.4:7447     for the network, with the certificates of [gateway.zenoh]
  lager up --metrics --foxglove --zenoh          all of it, started with the robot
  lager gateway --ros2                           a node of ROS 2, for programs of this machine
  lager gateway --ros2 --range subnet --operator    for the network, which may also order goods
  lager gateway --metrics --remote tls/192.168.1.4:7447    figures of a robot elsewhere, here
  lager gateway --router tls/192.168.1.9:7447 --robots r1,r2    where many robots bring their samples
  lager gateway --via tls/192.168.1.9:7447       brings them there

It only reads the bus. Everybody who reaches an address may read, without a password. Pages in a
browser of that machine may read the live views as well. Ask for figures by an address in digits, not
by a name: somebody else could have pointed a name to this machine. Import
services/gateway/grafana.json into Grafana, and services/gateway/foxglove.json as a layout into
Foxglove. --foxglove and --zenoh need a program that was built with `cargo build --release --features
foxglove,zenoh`. services/remote/README.md says what Zenoh's listeners get.

--ros2 becomes the program lager-ros2, which `services/ros2/build` builds. Everybody who reaches the
node may read, and stop the robot. services/ros2/README.md lists its topics and services.")]
pub struct GatewayArgs {
    /// Where Prometheus reads figures [default: from the configuration, or 127.0.0.1:7430]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_METRICS, value_parser = values::listens, help_heading = "Outside")]
    pub metrics: Option<SocketAddr>,
    /// Where Foxglove connects; without HOST:PORT at 127.0.0.1:8765 [default: from the
    /// configuration]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_FOXGLOVE, value_parser = values::listens, help_heading = "Outside")]
    pub foxglove: Option<SocketAddr>,
    /// Where listeners connect with Zenoh; without ENDPOINT at tcp/127.0.0.1:7447, for programs of
    /// this machine [default: from the configuration]
    #[arg(long, value_name = "ENDPOINT", num_args = 0..=1, default_missing_value = USUAL_ZENOH, help_heading = "Outside")]
    pub zenoh: Option<Endpoint>,
    /// Be a node of ROS 2, in a process beside the other gateways
    #[arg(long, conflicts_with_all = ["metrics", "foxglove", "zenoh"], help_heading = "ROS 2")]
    pub ros2: bool,
    /// Everybody who reaches the node may release a stop and order goods
    #[arg(long, requires = "ros2", help_heading = "ROS 2")]
    pub operator: bool,
    /// The node's domain [default: ROS_DOMAIN_ID, or 0]
    #[arg(long, value_name = "NUMBER", requires = "ros2", value_parser = clap::value_parser!(u16).range(0..=232), help_heading = "ROS 2")]
    pub domain: Option<u16>,
    /// How far the node is heard [default: ROS_AUTOMATIC_DISCOVERY_RANGE, or localhost]
    #[arg(long, value_name = "RANGE", requires = "ros2", value_parser = ["localhost", "subnet"], help_heading = "ROS 2")]
    pub range: Option<String>,
    /// Bring the samples to the `lager gateway --router` at this endpoint as well [default: from the
    /// configuration]
    #[arg(long, value_name = "ENDPOINT", help_heading = "Outside")]
    pub via: Option<Endpoint>,
    /// Show a robot on another computer, at this endpoint of its `lager gateway --zenoh`, to programs
    /// that reach this one
    #[arg(long, value_name = "ENDPOINT", conflicts_with_all = ["zenoh", "via"], help_heading = "Robot")]
    pub remote: Option<Endpoint>,
    /// Be no robot's gateway but a router, where robots bring their samples and listeners get them;
    /// without ENDPOINT at tcp/127.0.0.1:7447
    #[arg(long, value_name = "ENDPOINT", num_args = 0..=1, default_missing_value = USUAL_ZENOH, conflicts_with_all = ["metrics", "foxglove", "zenoh", "via", "remote"], help_heading = "Router")]
    pub router: Option<Endpoint>,
    /// The robots that a router with certificates lets tell of themselves; all others only listen
    #[arg(
        long,
        value_name = "NAME",
        value_delimiter = ',',
        requires = "router",
        help_heading = "Router"
    )]
    pub robots: Vec<UnitName>,
    /// What `up` tells every service
    #[command(flatten)]
    pub service: ServiceArgs,
}
