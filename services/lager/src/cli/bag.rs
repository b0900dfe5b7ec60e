//! The command line of recordings.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::values;

/// `lager bag`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager bag record                            everything, into ROBOT-DATE.mcap, until Ctrl-C
  lager bag record tour.mcap --topic sensor/line --topic steering/command
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
    /// Print JSON, one value a line
    #[arg(long, global = true, help_heading = "Output")]
    pub json: bool,
}

/// What is done with recordings.
#[derive(Debug, Subcommand)]
pub enum BagCommand {
    /// Record topics into a file until Ctrl-C or SIGTERM
    Record(RecordArgs),
    /// Size, times, topics and losses, from the file's end if that says so
    Info {
        /// The recording
        file: PathBuf,
    },
    /// Read everything: every CRC, every number, every sum; 1 if anything is wrong
    Check {
        /// The recordings
        #[arg(required = true)]
        file: Vec<PathBuf>,
    },
    /// Copy what is whole of a file that was cut off or damaged, and read the copy again
    Recover {
        /// The recording, which stays as it is
        file: PathBuf,
        /// The copy [default: FILE.recovered.mcap beside it]
        #[arg(long, value_name = "COPY")]
        output: Option<PathBuf>,
    },
    /// Play a recording onto the bus of a robot that is not up; no robot moves by it
    Play(PlayArgs),
    /// Write a table for each topic
    Export {
        /// The recording
        file: PathBuf,
        /// Write TOPIC.csv for each topic into this folder
        #[arg(long, value_name = "FOLDER", required = true)]
        csv: PathBuf,
        /// Only this topic; may be given again [default: all]
        #[arg(long, value_name = "TOPIC")]
        topic: Vec<String>,
    },
}

/// `lager bag record`.
#[derive(Debug, Args)]
pub struct RecordArgs {
    /// The file, which must not be there yet [default: ROBOT-DATE.mcap, or -2 if that is there]
    pub file: Option<PathBuf>,
    /// Only this topic; may be given again [default: all, also those that come later]
    #[arg(long, value_name = "TOPIC", value_parser = values::TopicName, hide_possible_values = true)]
    pub topic: Vec<String>,
    /// Begin a new file, FILE-001.mcap, when one has so many MiB
    #[arg(long, value_name = "MIB", allow_negative_numbers = true, value_parser = values::split_size)]
    pub split_size: Option<u64>,
    /// Begin a new file when one has been written to for so many seconds
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::seconds)]
    pub split_time: Option<f64>,
    /// Samples that may wait for a slow disk; what comes above that is dropped and counted
    #[arg(long, value_name = "N", default_value_t = 20_000, allow_negative_numbers = true, value_parser = values::queue)]
    pub queue: usize,
    /// Wait for the robot if it is not up
    #[arg(long)]
    pub wait: bool,
}

/// `lager bag play`.
#[derive(Debug, Args)]
#[command(
    after_help = "It plays onto the robot that --name says, and refuses one that is up: while it plays, no robot of
that name can be started and nothing reaches a board. Start what shall see the recording, such as
`lager --name r2 topic echo nav/status --wait`, before or after it.

With --verify nothing is played. The navigator of this program is told in this process what the
recorded one was told (nav/inputs), at the same times, and what both did is compared: every order,
status and event byte by byte, all the rest by its proof. 0 if all is the same; 1 with the first
command that differs, or where the recording lacks inputs. A navigator is verified from its begin, so
record from before `lager up` (`lager bag record --wait`). Verify on the same kind of processor.

  lager bag play --verify tour.mcap
  lager bag play --verify tour.mcap --with tolerance=0.3    which command would be another one?"
)]
pub struct PlayArgs {
    /// The recording
    pub file: PathBuf,
    /// Only this topic; may be given again [default: all]
    #[arg(long, value_name = "TOPIC")]
    pub topic: Vec<String>,
    /// So many times as fast as it was recorded
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true, value_parser = values::rate)]
    pub rate: f64,
    /// Begin anew at the end, until Ctrl-C
    #[arg(long = "loop")]
    pub repeat: bool,
    /// Begin so many seconds after the recording's begin
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = values::moment)]
    pub from: f64,
    /// End so many seconds after the recording's begin
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::moment)]
    pub to: Option<f64>,
    /// Which stamps samples get
    #[arg(long, value_enum, default_value_t)]
    pub stamps: StampsArg,
    /// Tell the navigator again what it was told, and compare what it does with the recording
    #[arg(long, conflicts_with_all = ["topic", "rate", "repeat", "from", "to", "stamps"])]
    pub verify: bool,
    /// Another value of one of the navigator's constants, in JSON; may be given again
    #[arg(long, value_name = "NAME=VALUE", requires = "verify", value_parser = values::constant)]
    pub with: Vec<(String, String)>,
}

/// `--stamps`.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum StampsArg {
    /// The player's own, as of now
    #[default]
    New,
    /// Writer, number and times as recorded
    Recorded,
}
