//! `lager bench topic`: how late the samples of a topic come on a bus that runs.

use std::path::PathBuf;

use anyhow::Result;
use lager_benches::{Mode, Options, at_least_one, heed_interrupts, topic};
use lager_ports::BusConfig;
use lager_topics::LAGER;

/// Measure a topic of a robot that is up, or of your own, as one that only reads: the time from the
/// source and from the publication until the sample is received
#[derive(Clone, Debug, clap::Args)]
#[command(
    args_override_self = true,
    after_help = "Examples:
  lager bench topic sensor/line                 as who only watches, and looks every millisecond
  lager bench topic sensor/line --wait block    as who acts: its writers ring one process more
  lager bench topic weather/now --samples 9000  a topic of your own

The first line of a row counts from the source of a sample, `from its sending` from its
publication. It writes nothing to the bus."
)]
pub(crate) struct Args {
    /// The topic, as `lager topic list` shows it
    name: String,
    /// How it waits: `poll` as an observer, the others as an actor, which the topic wakes
    #[arg(
        long,
        value_name = "MODE",
        value_delimiter = ',',
        default_value = "poll"
    )]
    wait: Vec<Mode>,
    /// How often to measure everything
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = at_least_one)]
    runs: Option<usize>,
    /// Samples of each run [default: 1000]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = at_least_one)]
    samples: Option<usize>,
    /// Take few samples, for a first look
    #[arg(long)]
    quick: bool,
    /// Save everything in NAME.json and NAME.hlog
    #[arg(long, value_name = "NAME")]
    out: Option<PathBuf>,
    /// Print one line of JSON instead of a table
    #[arg(long)]
    json: bool,
    /// The folder of the bus, if it is not the usual one
    #[arg(long, value_name = "FOLDER")]
    bus: Option<PathBuf>,
    /// The robot
    #[arg(long = "name", value_name = "ROBOT", default_value = "r1")]
    robot: String,
}

/// Measures, saves the result if that is asked for, and returns the text to print.
pub(super) fn measure(args: &Args) -> Result<String> {
    heed_interrupts();
    let config = BusConfig {
        unit: args.robot.parse()?,
        folder: args.bus.clone(),
        ..BusConfig::of(&LAGER)
    };
    let mut modes = args.wait.clone();
    modes.sort_by_key(|mode| *mode as usize);
    modes.dedup();
    let options = Options {
        runs: args.runs.unwrap_or(Options::default().runs),
        quick: args.quick,
        samples: args.samples,
        modes,
        ..Options::default()
    };
    let report = topic::measure(&config, &args.name, &options)?;
    super::saved(&report, args.out.as_deref())?;
    super::printed(args.json, &report)
}
