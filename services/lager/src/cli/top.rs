//! The command line of `lager top`.

use std::path::PathBuf;

use clap::Args;
use lager_remote::Endpoint;

use super::values;

/// `lager top`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager top                           until q; ? shows the keys
  lager top --filter sensor/
  lager top --once --json             for a program
  lager top --bag tour.mcap           the same table over a recording
  lager top --remote tls/192.168.1.4:7447    a robot on another computer

A topic that has lost samples in the last 30 seconds stands first, in red and with a `!`. The tool
reads only the topics that it shows. Of a closed topic it shows writers and readers. It is an
observer and does not slow the robot.")]
pub struct TopArgs {
    /// Only topics whose names contain this
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub filter: String,
    /// Print one picture and end
    #[arg(long)]
    pub once: bool,
    /// How many seconds to measure for that picture [default: 2]
    #[arg(long, value_name = "SECONDS", requires = "once", allow_negative_numbers = true, value_parser = values::seconds)]
    pub duration: Option<f64>,
    /// Print that picture as one line of JSON
    #[arg(long, requires = "once", help_heading = "Output")]
    pub json: bool,
    /// Show a recording instead of a robot
    #[arg(long, value_name = "FILE", conflicts_with = "duration")]
    pub bag: Option<PathBuf>,
    /// Look at a robot on another computer, at this endpoint of its `lager gateway --zenoh`
    #[arg(
        long,
        value_name = "ENDPOINT",
        conflicts_with = "bag",
        help_heading = "Robot"
    )]
    pub remote: Option<Endpoint>,
}
