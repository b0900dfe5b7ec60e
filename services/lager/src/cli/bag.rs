//! The command line of recordings.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use lager_remote::Endpoint;

use super::values;

/// `lager bag`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager bag record                            everything, into ROBOT-DATE.mcap, until Ctrl-C
  lager bag record tour.mcap --topic sensor/line --topic steering/command
  lager bag record --remote tls/192.168.1.4:7447                    a robot on another computer
  lager bag record tours --remote tls/192.168.1.9:7447 --every-robot    all robots of a router
  lager bag info tour.mcap
  lager bag check tour.mcap
  lager bag recover tour.mcap                 what is whole of it, into tour.recovered.mcap
  lager bag --name r2 play tour.mcap --rate 2
  lager bag play --verify tour.mcap           does this navigator do the same again?
  lager bag export tour.mcap --csv tables

A recording is MCAP with JSON, for Foxglove and every other reader of MCAP.")]
pub struct BagArgs {
    /// What to do
    #[command(subcommand)]
    pub command: BagCommand,
    /// Print JSON, one value in each line
    #[arg(long, global = true, help_heading = "Output")]
    pub json: bool,
}

/// What to do with recordings.
#[derive(Debug, Subcommand)]
pub enum BagCommand {
    /// Record topics into a file until Ctrl-C or SIGTERM
    Record(RecordArgs),
    /// Print size, times, topics and losses of a recording
    Info {
        /// The recording
        file: PathBuf,
    },
    /// Check every CRC, every number and every sum; exits with 1 if anything is wrong
    Check {
        /// The recordings
        #[arg(required = true)]
        file: Vec<PathBuf>,
    },
    /// Copy the undamaged parts of a damaged file, and check the copy
    Recover {
        /// The recording, which stays as it is
        file: PathBuf,
        /// The copy [default: FILE.recovered.mcap beside it]
        #[arg(long, value_name = "COPY")]
        output: Option<PathBuf>,
    },
    /// Play a recording onto the bus of a robot that is not up; this moves no robot
    Play(PlayArgs),
    /// Write a table for each topic
    Export {
        /// The recording
        file: PathBuf,
        /// Write TOPIC.csv for each topic into this folder
        #[arg(long, value_name = "FOLDER", required = true)]
        csv: PathBuf,
        /// Only this topic; may be given several times [default: all]
        #[arg(long, value_name = "TOPIC")]
        topic: Vec<String>,
    },
}

/// `lager bag record`.
#[derive(Debug, Args)]
pub struct RecordArgs {
    /// The new file [default: ROBOT-DATE.mcap, or ROBOT-DATE-2.mcap if that exists]; with
    /// --every-robot the folder in which each robot gets such a file
    pub file: Option<PathBuf>,
    /// Only this topic; may be given several times [default: all, also those that come later]
    #[arg(long, value_name = "TOPIC", value_parser = values::TopicName, hide_possible_values = true)]
    pub topic: Vec<String>,
    /// Begin a new file (FILE-001.mcap, ...) when a file has this many MiB
    #[arg(long, value_name = "MIB", allow_negative_numbers = true, value_parser = values::split_size)]
    pub split_size: Option<u64>,
    /// Begin a new file after this many seconds
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::seconds)]
    pub split_time: Option<f64>,
    /// How many samples may wait for a slow disk; more are dropped and counted
    #[arg(long, value_name = "N", default_value_t = 20_000, allow_negative_numbers = true, value_parser = values::queue)]
    pub queue: usize,
    /// Wait for the robot if it is not up
    #[arg(long)]
    pub wait: bool,
    /// Record a robot on another computer, at this endpoint of its `lager gateway --zenoh`
    #[arg(
        long,
        value_name = "ENDPOINT",
        conflicts_with = "wait",
        help_heading = "Robot"
    )]
    pub remote: Option<Endpoint>,
    /// Record every robot whose gateway is at that endpoint of a `lager gateway --router`, also those
    /// that come later
    #[arg(long, requires = "remote", help_heading = "Robot")]
    pub every_robot: bool,
}

/// `lager bag play`.
#[derive(Debug, Args)]
#[command(
    after_help = "It plays onto the robot that --name says, and refuses a robot that is up. While it plays, no robot
of that name can start and nothing reaches a board. Start the programs that look, such as `lager
--name r2 topic echo nav/status --wait`, before or after it.

With --verify it plays nothing. It gives the recorded inputs (nav/inputs) to the navigator of this
program and compares the answers: every order, status and event byte by byte, all the rest by a check
value. It exits with 0 if all is the same, and with 1 at the first command that differs or where
inputs are missing. It needs a navigator's begin, so start `lager bag record --wait` before `lager
up`. Verify on the same kind of processor.

  lager bag play --verify tour.mcap
  lager bag play --verify tour.mcap --with tolerance=0.3    which command would change?"
)]
pub struct PlayArgs {
    /// The recording
    pub file: PathBuf,
    /// Only this topic; may be given several times [default: all]
    #[arg(long, value_name = "TOPIC")]
    pub topic: Vec<String>,
    /// The speed; 1 is that of the recording
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true, value_parser = values::rate)]
    pub rate: f64,
    /// Play it again and again, until Ctrl-C
    #[arg(long = "loop")]
    pub repeat: bool,
    /// Begin this many seconds after the beginning of the recording
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = values::moment)]
    pub from: f64,
    /// End this many seconds after the beginning of the recording
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::moment)]
    pub to: Option<f64>,
    /// The stamps that the samples get
    #[arg(long, value_enum, default_value_t)]
    pub stamps: StampsArg,
    /// Give the recorded inputs to a navigator, and compare its answers with the recording
    #[arg(long, conflicts_with_all = ["topic", "rate", "repeat", "from", "to", "stamps"])]
    pub verify: bool,
    /// Change one of the navigator's constants (a value in JSON); may be given several times
    #[arg(long, value_name = "NAME=VALUE", requires = "verify", value_parser = values::constant)]
    pub with: Vec<(String, String)>,
}

/// `--stamps`.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum StampsArg {
    /// New ones, of this moment
    #[default]
    New,
    /// The recorded ones: writer, number and times
    Recorded,
}
