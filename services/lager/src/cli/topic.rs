//! The command line of the topic tools.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};
use lager_monitor::Limits;
use lager_remote::Endpoint;

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
  lager topic echo nav/status --remote tls/192.168.1.4:7447
  lager topic pub weather/now '{\"wind\": 3200}' --rate 10 --duration 60

--count is a number of samples everywhere, and --duration a number of seconds; what comes
first ends the tool. Your own topics are shown and written like those of the robot, while
a program that knows them has them open.")]
pub struct TopicArgs {
    /// What to do
    #[command(subcommand)]
    pub command: TopicCommand,
    /// Print JSON, one value in each line
    #[arg(long, global = true, help_heading = "Output")]
    pub json: bool,
    /// Look at a robot on another computer, at this endpoint of its `lager gateway --zenoh`; for all
    /// but pub
    #[arg(long, global = true, value_name = "ENDPOINT", help_heading = "Robot")]
    pub remote: Option<Endpoint>,
}

/// Which topic to watch, and for how long.
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
    /// The limits in the form of the tools.
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
    /// List the topics on the bus, of every robot; with --name, of one robot
    List,
    /// Describe one topic: its fields, its limits, its writers and readers
    Info {
        /// The topic's name, such as sensor/line
        #[arg(value_parser = values::TopicName, hide_possible_values = true)]
        topic: String,
    },
    /// Write the table of topics for programs in other languages
    Schema {
        /// Write layouts.py and its stub into this folder; bus/python has the same files
        #[arg(long, value_name = "FOLDER", required = true)]
        python: PathBuf,
    },
    /// Print each sample with its stamp, or some of its fields
    Echo {
        /// What and how long
        #[command(flatten)]
        watch: WatchArgs,
        /// Print only this field, such as sensor.bad_crc or orders.0.product; may be given several
        /// times
        #[arg(long, value_name = "PATH")]
        field: Vec<String>,
    },
    /// Measure rate, age and loss, once a second
    Hz {
        /// What and how long
        #[command(flatten)]
        watch: WatchArgs,
    },
    /// Measure bytes per second, once a second
    Bw {
        /// What and how long
        #[command(flatten)]
        watch: WatchArgs,
    },
    /// Measure how long samples take from their source to a reader, once a second
    #[command(
        after_help = "A writer wakes this tool when everybody else has the sample. `own wait` is the time from the
publication until the tool looks; it is not part of `publish -> receive`. Of a robot on another
computer the tool looks every millisecond."
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

Fields that you do not name have their blank value. The tool refuses a field that does not exist.
Enums are names or codes. Some program must have a topic of your own open, for example a reader.

While a robot is up, the tool does not publish what may move it; while the tool publishes, no robot
of that name can start. With --live it publishes beside the robot, if several programs may write
the topic (`lager topic info` shows whom it wakes). It never publishes what one service alone writes.")]
    Pub {
        /// The topic's name, such as weather/now
        #[arg(value_parser = values::TopicName, hide_possible_values = true)]
        topic: String,
        /// The payload [default: one payload for each JSON value on standard input]
        payload: Option<String>,
        /// How many samples per second [default: one sample, or each as it is read]
        #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = values::hz)]
        rate: Option<f64>,
        /// When it ends
        #[command(flatten)]
        until: LimitArgs,
        /// Publish although a robot is up, which may move by this, or although another program
        /// writes the topic
        #[arg(long)]
        live: bool,
    },
}
