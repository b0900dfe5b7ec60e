//! The command line of the topic tools.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};
use lager_monitor::Limits;

use super::values;

/// `lager topic`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager topic list
  lager topic echo link/health --count 1
  lager topic echo nav/status --field phase --field x --field y
  lager topic hz sensor/line --duration 10
  lager topic delay sensor/line
  lager topic bw truth/pose --json
  lager topic pub weather/now '{\"wind\": 3200}' --rate 10 --duration 60

--count is a number of samples everywhere, and --duration a number of seconds; what comes
first ends the tool. Your own topics are shown and written like those of the robot, while
a program that knows them has them open.")]
pub struct TopicArgs {
    /// What to do
    #[command(subcommand)]
    pub command: TopicCommand,
    /// Print JSON, one value a line
    #[arg(long, global = true, help_heading = "Output")]
    pub json: bool,
}

/// Which topic is watched, and for how long.
#[derive(Debug, Args)]
pub struct WatchArgs {
    /// The topic's name, such as sensor/line
    #[arg(value_parser = values::TopicName, hide_possible_values = true)]
    pub topic: String,
    /// When it ends
    #[command(flatten)]
    pub until: LimitArgs,
    /// Wait for the robot if it is not up
    #[arg(long)]
    pub wait: bool,
}

/// When a tool ends by itself.
#[derive(Debug, Args)]
pub struct LimitArgs {
    /// End after this many samples
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = values::count)]
    pub count: Option<u64>,
    /// End after this many seconds
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::seconds)]
    pub duration: Option<f64>,
}

impl LimitArgs {
    /// As the tools take it.
    pub fn limits(&self) -> Limits {
        Limits {
            duration: self.duration.map(Duration::from_secs_f64),
            count: self.count,
        }
    }
}

/// The topic tools.
#[derive(Debug, Subcommand)]
pub enum TopicCommand {
    /// Every topic on the bus: of every robot, or with --name of that one
    List,
    /// One topic: what it carries, its limits, who writes and reads it
    Info {
        /// The topic's name, such as sensor/line
        #[arg(value_parser = values::TopicName, hide_possible_values = true)]
        topic: String,
    },
    /// Write the table of topics for programs in another language
    Schema {
        /// Write layouts.py and its stub into this folder, as bus/python has them
        #[arg(long, value_name = "FOLDER", required = true)]
        python: PathBuf,
    },
    /// Print each sample with its stamp, or some of its fields
    Echo {
        /// What and how long
        #[command(flatten)]
        watch: WatchArgs,
        /// Print only this field, such as sensor.bad_crc or orders.0.product; may be given again
        #[arg(long, value_name = "PATH")]
        field: Vec<String>,
    },
    /// Measure rate, age and loss, once a second
    Hz {
        /// What and how long
        #[command(flatten)]
        watch: WatchArgs,
    },
    /// Measure bytes a second, once a second
    Bw {
        /// What and how long
        #[command(flatten)]
        watch: WatchArgs,
    },
    /// Measure how long samples take from their source to a reader, once a second
    #[command(
        after_help = "This tool is woken by nobody and looks every millisecond. How long samples waited for that look
is shown as `own wait` and is not part of `publish -> receive`."
    )]
    Delay {
        /// What and how long
        #[command(flatten)]
        watch: WatchArgs,
    },
    /// Publish samples from JSON
    #[command(after_help = "Examples:
  lager topic pub weather/now '{\"wind\": 3200, \"from\": 90}'    one sample
  lager topic pub weather/now '{\"wind\": 3200}' --rate 10       ten a second until Ctrl-C
  jq -c .payload samples.json | lager topic pub weather/now    one for each value that is read
  lager topic pub mission/order '{\"id\": 7, \"product\": 2}' --live

Fields that are not named have their blank value; a field that there is not is refused. Enums
are names or codes. A topic of your own has to be open somewhere, by whoever reads it.

What may move a robot is not published while one of that name is up, and none can start
meanwhile. With --live it is published beside the robot, if the table lets several write the
topic (`lager topic info` shows whom it wakes); what one service alone writes never is.")]
    Pub {
        /// The topic's name, such as weather/now
        #[arg(value_parser = values::TopicName, hide_possible_values = true)]
        topic: String,
        /// The payload [default: one for each JSON value on standard input]
        payload: Option<String>,
        /// So many samples a second [default: one sample, or each as it is read]
        #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = values::hz)]
        rate: Option<f64>,
        /// When it ends
        #[command(flatten)]
        until: LimitArgs,
        /// Publish beside a robot that is up, which may move by it, or beside another writer
        #[arg(long)]
        live: bool,
    },
}
