//! The command line: every subcommand, flag and example. No behaviour lives here.

mod bag;
mod board;
mod commission;
mod gateway;
pub mod help;
mod keys;
mod ordered;
mod realtime;
mod report;
mod simulate;
mod top;
mod topic;
mod values;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use lager_gateway::{USUAL_FOXGLOVE, USUAL_METRICS, USUAL_ZENOH};
use lager_lines::Called;
use lager_supervisor::Parent;
use lager_wire::{OperatorCommand, Speed};

pub use bag::{BagArgs, BagCommand, PlayArgs, RecordArgs, StampsArg};
pub use board::{BoardArgs, BoardCommand, FlashArgs, PortArgs, ResetArgs, UpdateArgs};
pub use commission::CommissionArgs;
pub use gateway::GatewayArgs;
pub use keys::KeysArgs;
#[cfg(feature = "zenoh")]
pub use keys::KeysCommand;
pub use ordered::{Button, MapChange, ObstacleChange, Ordered, Plain, QueueChange};
pub use realtime::{ServiceArgs, UpRealtimeArgs};
pub use report::ReportArgs;
pub use simulate::SimulateArgs;
pub use top::TopArgs;
pub use topic::{TopicArgs, TopicCommand};
pub use values::{Fetch, at_speed};

use crate::config::{Body, flag};

/// The software of a small warehouse robot around a zero-copy shared-memory bus.
#[derive(Debug, Parser)]
#[command(
    name = "lager",
    version,
    after_help = "Examples:
  lager up                                     the simulated robot and all its services
  lager up --headless --mission 1 --exit-when-done --json
  lager up --body serial                       the real boards, wherever they are plugged in
  lager up --body chip                         the boards' real images in an emulator
  lager up --realtime 20 --lock-memory --core 1
  lager simulate --seeds 1..20 --warehouse large --mission 1,2 --obstacles 4
  lager topic echo link/health
  lager bag record
  lager bench hop --quick
  lager drive follow-forward

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 the mission was not delivered,
4 a robot of this name is already up, 5 real time, locked memory or cores are
not granted as asked for, 130 interrupted before it was done."
)]
pub struct Cli {
    /// Flags of every subcommand, and the subcommand.
    #[command(flatten)]
    pub global: GlobalArgs,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Flags of every subcommand.
#[derive(Debug, Args)]
pub struct GlobalArgs {
    /// Configuration file, - for standard input [default: ./lager.toml if there is one]
    #[arg(long, global = true, value_name = "FILE", help_heading = "Robot")]
    pub config: Option<PathBuf>,
    #[arg(
        long,
        global = true,
        value_name = "ROBOT",
        help_heading = "Robot",
        value_parser = values::robot,
        help = flag("", "name")
    )]
    pub name: Option<String>,
    #[arg(
        long,
        global = true,
        value_name = "FOLDER",
        help_heading = "Bus",
        help = flag("bus", "folder")
    )]
    pub bus: Option<PathBuf>,
    #[arg(
        long,
        global = true,
        value_name = "FOLDER",
        help_heading = "Robot",
        help = flag("", "state")
    )]
    pub state: Option<PathBuf>,
    #[arg(
        long,
        global = true,
        value_name = "FILE",
        help_heading = "Output",
        help = flag("log", "file")
    )]
    pub log: Option<PathBuf>,
    #[arg(long, global = true, help_heading = "Output", help = flag("log", "json"))]
    pub log_json: bool,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run everything on this machine: the robot's body and all services, until Ctrl-C
    Up(Box<UpArgs>),
    /// Run the whole robot in one process, in virtual time and without a bus
    Simulate(SimulateArgs),
    /// See the whole robot on one screen: its links, its mission, and every topic's rate and losses
    Top(TopArgs),
    /// Look at any topic of the bus, measure it, and publish on it
    Topic(TopicArgs),
    /// Record the bus; inspect, repair and play recordings
    Bag(BagArgs),
    /// Measure the bus on this machine, beside its baselines in the same run
    #[command(disable_help_flag = true)]
    Bench {
        /// The arguments of the program `lager-bench`: `lager bench --help` shows them
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Drive the wheels in manual mode, until the command is done or until Ctrl-C
    #[command(
        after_help = "COMMAND is a name (stop, forward, follow-forward, backward, follow-backward, left, right, left-diag, right-diag) or a code 1..9 as 8 binary digits, decimal or 0x-hex."
    )]
    Drive {
        /// Name or code of the command
        #[arg(allow_negative_numbers = true, value_parser = values::wheel_command)]
        command: OperatorCommand,
        /// How fast to drive forward or backward, or to turn left or right: at full speed if it is
        /// left out, as the robot does by itself, at half of it (middle) or a quarter (slow)
        #[arg(long, value_parser = values::driving_speed())]
        speed: Option<Speed>,
        /// Stop driving after this many seconds, not at Ctrl-C
        #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::seconds)]
        seconds: Option<f64>,
    },
    /// Stop the robot, in any mode; it stays stopped until `lager resume`
    Stop,
    /// Release a stop
    Resume,
    /// What a person orders.
    #[command(flatten)]
    Ordered(Ordered),
    /// Find out what is wrong with this machine and how to mend it
    Doctor {
        /// Remove what dead processes left on the bus, and restart a board that answers and does not work
        #[arg(long)]
        fix: bool,
        /// Print one line of JSON
        #[arg(long, help_heading = "Output")]
        json: bool,
        /// Do this for the configuration with which `lager up` will start
        #[command(flatten)]
        realtime: UpRealtimeArgs,
    },
    /// Give the boards new images, restart them, or set up a new chip
    Board(BoardArgs),
    /// Find out how a robot is built, by questions to a person who looks at it
    Commission(CommissionArgs),
    /// Pack logs, configuration and versions into one file for a bug report, without secrets
    Report(ReportArgs),
    /// Print the configuration in force, with every key
    Config {
        /// Print an iceoryx2.toml instead, with which other iceoryx2 programs can join the bus
        #[arg(long)]
        iceoryx2: bool,
        /// Print only how the robot is built: a robot.toml for another machine
        #[arg(long, conflicts_with = "iceoryx2")]
        robot: bool,
    },
    /// The service that talks to the external computer, and the only one with a socket to the
    /// network
    #[command(after_help = "Examples:
  lager comm --station 192.168.1.5:7420

It connects to a station, and connects again whenever the link is lost. In manual mode the robot
carries out the station's commands, and stands when the link is lost. In autonomous mode it fetches
the goods that the station names, and goes on without the link, unless [comm] link_lost is \"stand\".")]
    Comm(CommArgs),
    /// Run the external computer (the station), to which robots connect
    #[command(after_help = "Examples:
  lager station --warehouse warehouse.toml             robots of this machine
  lager station --listen 192.168.1.5:7420 --warehouse warehouse.toml
  lager gag                                            be its GaG: answer what it asks

The station answers robots from the warehouse file and from its queue of orders. A GaG is a program
in which a person describes the warehouse and orders goods. While one is connected to the socket, it
answers for the robot that has been connected for longest, and the station saves what it says of the
warehouse. Without --robots-secret the station believes every robot, so let only your robots reach
--listen. The panel asks for a token; the station prints the addresses that contain it.")]
    Station(StationArgs),
    /// Show the robot to other programs: to Prometheus, Foxglove, and listeners with Zenoh
    Gateway(GatewayArgs),
    /// Make certificates for listeners on other computers
    Keys(KeysArgs),
    /// Answer a station from this terminal (as a GaG): describe the warehouse, choose goods, drive
    #[command(after_help = "Examples:
  lager gag                                  at the station of the robot that is up, or of `lager station`
  lager gag --socket /tmp/somebody/gag       at somebody else's
  printf 'fetchprod 3\nfetchprod 1\n' | lager gag

It shows the station's questions and the robot's words, in the original robot's language. Answer with
the whole line or with the part behind the word: to `fetchprod` with `3` or with `fetchprod 3`. An
answer that you type before the question waits. But `styrcomm 1` stops the robot at once and drops the
commands that wait. Only one GaG can be connected at a time.")]
    Gag {
        /// The station's unix socket [default: that of the robot's own station, else gag in the
        /// folder of the bus]
        #[arg(long, value_name = "SOCKET", help_heading = "Station")]
        socket: Option<PathBuf>,
    },
    /// Print a script with which your shell completes this command line
    #[command(after_help = "Examples:
  lager completions bash > ~/.local/share/bash-completion/completions/lager
  lager completions zsh > ~/.zfunc/_lager
  lager completions fish > ~/.config/fish/completions/lager.fish")]
    Completions {
        /// Which shell
        shell: clap_complete::Shell,
    },
    /// Write the manual pages of this command line into a folder
    #[command(after_help = "Examples:
  lager manual ~/.local/share/man/man1")]
    Manual {
        /// The folder, which is made if it is not there
        folder: PathBuf,
    },
    /// Does what `up` needs on the bus; only `up` starts it
    #[command(hide = true)]
    Attend(ServiceArgs),
    /// The service that owns the serial ports and decides who steers
    Bridge(ServiceArgs),
    /// The service that navigates
    Logic(ServiceArgs),
    /// The simulated robot behind two pseudo terminals
    Simulator(ServiceArgs),
    /// The boards' real images in their emulator, behind two pseudo terminals
    Emulator(ServiceArgs),
}

/// `lager up`.
#[derive(Debug, Default, Args)]
#[command(after_help = "Examples:
  lager up                                                the simulated robot
  lager up --headless --mission 1,2 --speed 5 --exit-when-done --json
  lager up --body serial                                  the boards, driven by a person
  lager up --sensor /dev/ttyUSB0 --steering /dev/ttyUSB1 --script --mission 1
                                                          the boards, driving by themselves
  lager up --body chip                                    their images in an emulator
  lager up --station 192.168.1.5:7420                     another machine is the external computer
  lager up --metrics                                      figures for Prometheus
  lager up --realtime 20 --lock-memory --core 1

Real time is for bridge and logic, the services between sensor and steering, and for the processes
that replace them after a crash. The supervisor keeps the normal priority, and so does a simulated
or emulated body, because real boards have processors of their own. If this machine refuses real
time, `up` ends with 5 and says how to get it; `lager doctor` with the same flags tries it before.

The bridge's main loop has the priority that you give, logic has one less, and the threads that read
the ports have two less. On one core (--core 1 binds bridge and logic to core 1) they wake each other
sooner than on two, because an idle core needs time to wake. With waiting = \"adaptive\" or \"spin\" in
[bus], give each of them a core of its own; then all have the same priority.")]
pub struct UpArgs {
    /// The body that the robot has [default: sim]
    #[arg(long, help_heading = "Body")]
    pub body: Option<Body>,
    /// Serial port of the sensor board (implies --body serial)
    #[arg(long, value_name = "PORT", conflicts_with_all = ["images", "emulator"], help_heading = "Body")]
    pub sensor: Option<PathBuf>,
    /// Serial port of the steering board (implies --body serial)
    #[arg(long, value_name = "PORT", conflicts_with_all = ["images", "emulator"], help_heading = "Body")]
    pub steering: Option<PathBuf>,
    #[arg(
        long,
        value_name = "BAUD",
        allow_negative_numbers = true,
        value_parser = values::baud,
        help_heading = "Body",
        help = flag("serial", "baud")
    )]
    pub baud: Option<u32>,
    /// Folder with sensor.elf and steering.elf, the programs of emulated boards (implies --body
    /// chip)
    #[arg(long, value_name = "FOLDER", help_heading = "Body")]
    pub images: Option<PathBuf>,
    /// Program that emulates the boards (implies --body chip)
    #[arg(long, value_name = "FILE", help_heading = "Body")]
    pub emulator: Option<PathBuf>,
    #[arg(long, value_name = "FILE", help_heading = "Mission", help = flag("", "warehouse"))]
    pub warehouse: Option<String>,
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = values::seed,
        help_heading = "Body",
        help = flag("simulator", "seed")
    )]
    pub seed: Option<u64>,
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = values::obstacles,
        help_heading = "Body",
        help = flag("simulator", "obstacles")
    )]
    pub obstacles: Option<u32>,
    #[arg(
        long,
        value_name = "X",
        allow_negative_numbers = true,
        value_parser = values::speed,
        help_heading = "Body",
        help = flag("", "speed")
    )]
    pub speed: Option<f64>,
    /// Use the external computer at this address; `up` then starts none
    #[arg(long, value_name = "HOST:PORT", value_parser = values::calls, conflicts_with = "no_station", help_heading = "Station")]
    pub station: Option<String>,
    /// The file of the secret by which the robot and its external computer recognise each other; it
    /// has mode 0600 [default: a new secret for a station that `up` starts]
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with = "no_station",
        help_heading = "Station"
    )]
    pub secret: Option<PathBuf>,
    /// Start no external computer; `up` tells the robot its warehouse
    #[arg(long, help_heading = "Station")]
    pub no_station: bool,
    /// Where robots connect to the station that `up` starts [default: 127.0.0.1:7420, or a free
    /// port]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::listens, conflicts_with_all = ["no_station", "station"], help_heading = "Station")]
    pub listen: Option<std::net::SocketAddr>,
    /// Where a GaG connects to that station: the path of a unix socket [default: gag in the robot's
    /// folder of the bus]
    #[arg(long, value_name = "SOCKET", conflicts_with_all = ["no_station", "station"], help_heading = "Station")]
    pub gag: Option<PathBuf>,
    /// Where the operator panel answers browsers of this machine [default: 127.0.0.1:7410, or a
    /// free port]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::listens, conflicts_with_all = ["headless", "no_station", "station"], help_heading = "Station")]
    pub panel: Option<std::net::SocketAddr>,
    /// Start no panel
    #[arg(long, help_heading = "Mission")]
    pub headless: bool,
    /// Give the robot's figures to Prometheus, at this address [default: 127.0.0.1:7430]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_METRICS, value_parser = values::listens, help_heading = "Outside")]
    pub metrics: Option<std::net::SocketAddr>,
    /// Give live views to Foxglove, at this address [default: 127.0.0.1:8765]; see `lager gateway
    /// --help`
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_FOXGLOVE, value_parser = values::listens, help_heading = "Outside")]
    pub foxglove: Option<std::net::SocketAddr>,
    /// Give samples to listeners with Zenoh, at this endpoint [default: tcp/127.0.0.1:7447]; see
    /// `lager gateway --help`
    #[arg(long, value_name = "ENDPOINT", num_args = 0..=1, default_missing_value = USUAL_ZENOH, help_heading = "Outside")]
    pub zenoh: Option<lager_remote::Endpoint>,
    /// Let a real robot drive --mission by itself; keep people out of its way. A simulated or
    /// emulated robot needs no --script
    #[arg(long, help_heading = "Mission")]
    pub script: bool,
    /// The goods that the robot fetches first, by number or name, in this order [default: the
    /// warehouse's first goods; at a station of somebody else, none]
    #[arg(long, value_name = "GOODS", value_delimiter = ',', allow_negative_numbers = true, value_parser = values::product, help_heading = "Mission")]
    pub mission: Vec<Called>,
    /// End when the mission is delivered (0) or has failed (3)
    #[arg(long, help_heading = "Mission")]
    pub exit_when_done: bool,
    /// Print one line of JSON at the end; progress goes to standard error
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// How the machine treats bridge and logic
    #[command(flatten)]
    pub realtime: UpRealtimeArgs,
}

/// `lager comm`.
#[derive(Debug, Args)]
pub struct CommArgs {
    /// Where the external computer listens [default: from the configuration, or 127.0.0.1:7420]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::calls, help_heading = "Station")]
    pub station: Option<String>,
    /// The file of the secret by which the robot and its external computer recognise each other; it
    /// has mode 0600 [default: from the configuration]
    #[arg(long, value_name = "FILE", help_heading = "Station")]
    pub secret: Option<PathBuf>,
    /// What `up` tells every service
    #[command(flatten)]
    pub service: ServiceArgs,
}

/// `lager station`.
#[derive(Debug, Args)]
pub struct StationArgs {
    /// Where robots connect
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:7420", value_parser = values::listens, help_heading = "Station")]
    pub listen: std::net::SocketAddr,
    /// Where a GaG connects: the path of a unix socket [default: gag in the folder of the bus]
    #[arg(long, value_name = "SOCKET", help_heading = "Station")]
    pub gag: Option<PathBuf>,
    /// The warehouse's file, which also keeps changes and need not exist yet; or a built-in
    /// warehouse, whose changes are kept in the state folder [default: a GaG or the panel describes
    /// the warehouse, and it is kept in the state folder]
    #[arg(long, value_name = "FILE", help_heading = "Station")]
    pub warehouse: Option<String>,
    /// Products that a robot fetches after those that wait already, by number or name, such as
    /// r1=3,screws; may be given several times
    #[arg(long, value_name = "ROBOT=GOODS,GOODS", value_parser = values::fetch, help_heading = "Station")]
    pub fetch: Vec<Fetch>,
    /// The file of the secrets by which robots prove their names: a line `<name> <secret>` for
    /// each, or one secret for all; it has mode 0600 [default: none; the station believes every
    /// robot]
    #[arg(long, value_name = "FILE", help_heading = "Station")]
    pub robots_secret: Option<PathBuf>,
    /// Where the operator panel answers browsers [default: 127.0.0.1:7410, or a free port]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::listens, help_heading = "Station")]
    pub panel: Option<std::net::SocketAddr>,
    /// Start no panel
    #[arg(long, conflicts_with = "panel", help_heading = "Station")]
    pub no_panel: bool,
    /// Keep no history of the robots; otherwise it lies beside the warehouse's file, in
    /// FILE.history
    #[arg(long, help_heading = "Station")]
    pub no_history: bool,
    /// `up` gives this to every service that it starts again; a station continues without it as
    /// well
    #[arg(long, hide = true)]
    pub resume: bool,
    /// End when the supervisor ends; robots then connect at the socket on standard output
    #[arg(long, value_name = "PID@NS", hide = true)]
    pub parent: Option<Parent>,
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;

    use super::*;
    use crate::config::StationSection;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn a_station_alone_and_one_of_a_robot_take_the_same_places() {
        type Places = (Option<SocketAddr>, Option<PathBuf>, Option<SocketAddr>);
        let of = |words: &[&str]| -> Places {
            let cli = Cli::try_parse_from(["lager"].iter().chain(words)).expect("right usage");
            match cli.command {
                Command::Station(args) => (Some(args.listen), args.gag, args.panel),
                Command::Up(args) => (args.listen, args.gag, args.panel),
                _ => panic!("{words:?}"),
            }
        };
        let usual = StationSection::USUAL.parse().ok();
        assert_eq!(of(&["station"]), (usual, None, None));
        assert_eq!(of(&["up"]), (None, None, None));
        let places = [
            "--listen",
            "127.0.0.1:1",
            "--gag",
            "g",
            "--panel",
            "[::1]:2",
        ];
        let wanted = (
            "127.0.0.1:1".parse().ok(),
            Some("g".into()),
            "[::1]:2".parse().ok(),
        );
        for command in ["station", "up"] {
            assert_eq!(of(&[&[command][..], &places].concat()), wanted);
        }
    }
}
