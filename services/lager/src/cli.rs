//! The command line: every subcommand, flag and example. No behaviour lives here.

mod realtime;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use lager_benches::{Mode, Regime};

pub use realtime::{ServiceArgs, UpRealtimeArgs};

use crate::config::Body;

/// The software of a small warehouse robot around a zero-copy shared-memory bus.
#[derive(Debug, Parser)]
#[command(
    name = "lager",
    version,
    after_help = "Examples:
  lager up                                     the simulated robot and all its services
  lager up --headless --mission 1 --exit-when-done --json
  lager up --sensor /dev/ttyUSB0 --steering /dev/ttyUSB1
  lager up --body chip                         the boards' real images in an emulator
  lager up --realtime 20 --lock-memory --core bridge=0 --core logic=1
  lager simulate --seeds 1..20 --warehouse large --mission 1,2
  lager topic hz sensor/line
  lager bench hop --quick
  lager drive follow-forward

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 the mission was not delivered,
4 a robot of this name is already up, 5 real time, locked memory or cores are
not granted as asked for."
)]
pub struct Cli {
    /// What every subcommand takes.
    #[command(flatten)]
    pub global: GlobalArgs,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Flags of every subcommand.
#[derive(Debug, Args)]
pub struct GlobalArgs {
    /// Configuration file [default: ./lager.toml if there is one]
    #[arg(long, global = true, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// The robot's name [default: r1]
    #[arg(long, global = true, value_name = "ROBOT")]
    pub name: Option<String>,
    /// Prefix of the bus's shared-memory files, to keep a bus apart
    #[arg(long, global = true, value_name = "PREFIX")]
    pub bus_prefix: Option<String>,
    /// Folder of the bus's bookkeeping files, to keep a bus apart
    #[arg(long, global = true, value_name = "FOLDER")]
    pub bus_root: Option<PathBuf>,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run everything on this machine: the robot's body and all services, until Ctrl-C
    Up(UpArgs),
    /// Run the whole robot in one process in virtual time: deterministic, no bus
    Simulate(SimulateArgs),
    /// Look at any topic of the bus
    Topic(TopicArgs),
    /// Measure the bus on this machine, beside its baselines in the same run
    Bench(BenchArgs),
    /// Steer by hand in manual mode, renewed until it is done or Ctrl-C
    #[command(
        after_help = "COMMAND is a name (stop, forward, follow-forward, backward, follow-backward, left, right, left-diag, right-diag) or a code 1..9 as 8 binary digits, decimal or 0x-hex."
    )]
    Drive {
        /// Name or code of the command
        command: String,
        /// Let go after this many seconds instead of at Ctrl-C
        #[arg(long, value_name = "SECONDS")]
        seconds: Option<f64>,
    },
    /// Move the arm one step
    #[command(
        after_help = "COMMAND is a name (clockwise, counter-clockwise, in, out, up, down, left, right, squeeze, release) or a code 0xF1..0xFA as 8 binary digits, decimal or 0x-hex."
    )]
    Arm {
        /// Name or code of the command
        command: String,
    },
    /// Stop the robot, in any mode; it stays stopped until `lager resume`
    Stop,
    /// Release a latched stop
    Resume,
    /// Choose who steers
    Mode {
        /// The mode
        mode: ModeName,
    },
    /// Order a product to be fetched and delivered
    Fetch {
        /// The product's number
        product: i32,
    },
    /// Tell the robot that the product has been picked up
    Picked,
    /// Tell the robot that it has been put on the delivery node, looking into the warehouse
    Reset,
    /// Set the gains of the line following (PD)
    Gains {
        /// Proportional gain, 2 unless set
        p: u8,
        /// Derivative gain over 10 ms, 2 unless set
        d: u8,
    },
    /// Calibrate the line sensors: move the robot over tape and floor by hand for five seconds
    Calibrate,
    /// Find out what is wrong with this machine and how to mend it
    Doctor {
        /// Remove what dead processes left on the bus
        #[arg(long)]
        fix: bool,
        /// What `lager up` is to be started with
        #[command(flatten)]
        realtime: UpRealtimeArgs,
    },
    /// Print the configuration in force, with every key
    Config,
    /// The service that owns the serial ports and decides who steers
    Bridge(ServiceArgs),
    /// The service that navigates
    Logic(ServiceArgs),
    /// The simulated robot behind two pseudo terminals
    Simulator(ServiceArgs),
    /// The boards' real images in their emulator, behind two pseudo terminals
    Emulator(ServiceArgs),
}

/// `lager mode`.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum ModeName {
    /// The operator steers
    Manual,
    /// Logic steers
    Autonomous,
}

/// `lager up`.
#[derive(Debug, Default, Args)]
#[command(after_help = "Examples:
  lager up                                                the simulated robot
  lager up --headless --mission 1,2 --speed 5 --exit-when-done --json
  lager up --sensor /dev/ttyUSB0 --steering /dev/ttyUSB1  the boards
  lager up --body chip                                    their images in an emulator
  lager up --realtime 20 --lock-memory --core bridge=2 --core logic=3

Real time is for bridge and logic, the services between sensor and steering, and
for those that take their place after a crash. The supervisor keeps the normal
priority, and so does a simulated or emulated body, which stands for boards with
processors of their own. What is not granted is an error (5) that says how to get
it; `lager doctor` with the same flags tries it beforehand.")]
pub struct UpArgs {
    /// What to drive [default: sim]
    #[arg(long)]
    pub body: Option<Body>,
    /// Serial port of the sensor board (implies --body serial)
    #[arg(long, value_name = "PORT", conflicts_with_all = ["images", "emulator"])]
    pub sensor: Option<PathBuf>,
    /// Serial port of the steering board (implies --body serial)
    #[arg(long, value_name = "PORT", conflicts_with_all = ["images", "emulator"])]
    pub steering: Option<PathBuf>,
    /// Baud rate of both ports, which the boards' images are built for [default: 500000]
    #[arg(long, value_name = "BAUD")]
    pub baud: Option<u32>,
    /// Folder of sensor.elf and steering.elf, what emulated boards run (implies --body chip)
    #[arg(long, value_name = "FOLDER")]
    pub images: Option<PathBuf>,
    /// Program that emulates the boards (implies --body chip)
    #[arg(long, value_name = "FILE")]
    pub emulator: Option<PathBuf>,
    /// Built-in warehouse or warehouse file [default: small]
    #[arg(long, value_name = "FILE")]
    pub warehouse: Option<String>,
    /// Seed of the simulated robot's noise [default: 1]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Run the clock of a simulated robot this many times as fast, that of an emulated one at most [default: 1]
    #[arg(long, value_name = "X")]
    pub speed: Option<f64>,
    /// Do without a person: a script orders, picks and signals
    #[arg(long)]
    pub headless: bool,
    /// The products to fetch, in this order [default: the first of the warehouse]
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    pub mission: Vec<i32>,
    /// End when the mission is delivered (0) or has failed (3)
    #[arg(long)]
    pub exit_when_done: bool,
    /// Print one line of JSON at the end; progress goes to standard error
    #[arg(long)]
    pub json: bool,
    /// What bridge and logic want of the machine
    #[command(flatten)]
    pub realtime: UpRealtimeArgs,
}

/// `lager simulate`.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Seeds to run, one run each: `7` or `1..20` (both ends run)
    #[arg(long, value_name = "A..B", default_value = "1")]
    pub seeds: String,
    /// Built-in warehouse or warehouse file; may be given several times
    #[arg(long, value_name = "FILE")]
    pub warehouse: Vec<String>,
    /// The products to fetch, in this order [default: the first of the warehouse]
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    pub mission: Vec<i32>,
    /// Give up after this much virtual time
    #[arg(long, value_name = "SECONDS", default_value_t = 3600)]
    pub limit: u64,
    /// One line of JSON a run
    #[arg(long)]
    pub json: bool,
}

/// `lager topic`.
#[derive(Debug, Args)]
pub struct TopicArgs {
    /// What to show
    #[command(subcommand)]
    pub command: TopicCommand,
    /// Print JSON, one value a line
    #[arg(long, global = true)]
    pub json: bool,
}

/// The topic tools.
#[derive(Debug, Subcommand)]
pub enum TopicCommand {
    /// Every topic on the bus, of every robot
    List,
    /// One topic: what it carries, its limits, who writes and reads it
    Info {
        /// The topic's name, such as sensor/line
        topic: String,
    },
    /// Print each sample with its stamp
    Echo {
        /// The topic's name, such as sensor/line
        topic: String,
        /// End after this many samples
        #[arg(long, value_name = "N")]
        count: Option<u64>,
    },
    /// Measure rate, age and loss, once a second
    Hz {
        /// The topic's name, such as sensor/line
        topic: String,
        /// End after this many seconds
        #[arg(long, value_name = "N")]
        count: Option<u64>,
    },
}

/// `lager bench`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager bench hop --quick                          a first look, in seconds
  lager bench hop --mode block --regime same-core  the software's share of a wake
  lager bench path --runs 9 --json > path.json     what a plot is drawn from
  lager bench fanout                               what observers cost the writer
  lager bench chip                                 the boards' images, in cycles: exact

Times are medians over the runs: of each run's median (p50) and of what 99 % and
99.9 % of its samples kept. Ratios compare with a baseline of the same run and
survive another machine; times do not. Measure on an otherwise idle machine, with
no robot up. A hop through Zenoh is measured beside the others only by
`cargo run --release -p lager --features zenoh -- bench hop`: Zenoh brings a
large tree of crates with it.")]
pub struct BenchArgs {
    /// What to measure
    pub scenario: Scenario,
    /// Print one line of JSON instead of a table
    #[arg(long)]
    pub json: bool,
    /// How often to measure everything; every figure is the median over the runs (not `chip`) [default: 5]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub runs: Option<usize>,
    /// Take few samples, for a first look (not `chip`)
    #[arg(long)]
    pub quick: bool,
    /// How the receiver waits: spin, adaptive or block [default: all]
    #[arg(long, value_name = "MODE", value_delimiter = ',')]
    pub mode: Vec<Mode>,
    /// Where the processes run: plain (a core each), same-core, or no-halt (a core each, kept awake) [default: all]
    #[arg(long, value_name = "REGIME", value_delimiter = ',')]
    pub regime: Vec<Regime>,
}

/// What `lager bench` can measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Scenario {
    /// One sample from a writer to a waiting reader in another process
    Hop,
    /// A sensor packet on one port until its steering command on the other, through bridge and logic
    Path,
    /// What publishing costs with 1 to 64 subscribers and observers
    Fanout,
    /// Cycles of the boards' real images, from tape to duty and to UART; `.ci/firmware` builds what it runs
    Chip,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("one run is the least".to_owned()),
        Ok(runs) => Ok(runs),
        Err(error) => Err(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
