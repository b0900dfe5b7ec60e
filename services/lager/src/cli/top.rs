//! The command line of `lager top`.

use std::path::PathBuf;

use clap::Args;

use super::values;

/// `lager top`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager top                           until q; ? shows the keys
  lager top --filter sensor/
  lager top --once --json             for a program
  lager top --bag tour.mcap           the same table over a recording

A topic that has lost samples in the last 30 seconds stands first, in red and with a !.
Only topics that are shown are read; of a closed one the bus is asked who writes and reads it.
It is an observer of each, and does not slow the robot.")]
pub struct TopArgs {
    /// Only topics whose names contain this
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub filter: String,
    /// Print one picture and end
    #[arg(long)]
    pub once: bool,
    /// How long that picture is measured [default: 2]
    #[arg(long, value_name = "SECONDS", requires = "once", allow_negative_numbers = true, value_parser = values::seconds)]
    pub duration: Option<f64>,
    /// Print that picture as one line of JSON
    #[arg(long, requires = "once", help_heading = "Output")]
    pub json: bool,
    /// Show a recording instead of a robot
    #[arg(long, value_name = "FILE", conflicts_with = "duration")]
    pub bag: Option<PathBuf>,
}
