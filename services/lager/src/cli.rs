//! The command line: every subcommand, flag and example. No behaviour lives here.

mod bag;
mod changes;
mod gateway;
pub mod help;
mod realtime;
mod simulate;
mod top;
mod topic;
mod values;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use lager_benches::{Mode, Regime};
use lager_gateway::{USUAL_FOXGLOVE, USUAL_METRICS};
use lager_lines::Called;
use lager_wire::OperatorCommand;

pub use bag::{BagArgs, BagCommand, PlayArgs, RecordArgs, StampsArg};
pub use changes::{MapChange, ObstacleChange, QueueChange};
pub use gateway::GatewayArgs;
pub use realtime::{ServiceArgs, UpRealtimeArgs};
pub use simulate::SimulateArgs;
pub use top::TopArgs;
pub use topic::{TopicArgs, TopicCommand};

pub use values::Fetch;

use crate::config::{Body, PickBy};
use crate::steer::Place;
use crate::supervisor::Parent;

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
    /// Configuration file, - for standard input [default: ./lager.toml if there is one]
    #[arg(long, global = true, value_name = "FILE", help_heading = "Robot")]
    pub config: Option<PathBuf>,
    /// The robot's name [default: r1]
    #[arg(long, global = true, value_name = "ROBOT", help_heading = "Robot", value_parser = values::robot)]
    pub name: Option<String>,
    /// Folder in which the bus lives [default: /run/lager if it is this user's, else
    /// /dev/shm/lager-UID]
    #[arg(long, global = true, value_name = "FOLDER", help_heading = "Bus")]
    pub bus: Option<PathBuf>,
    /// Folder that keeps the warehouse as it was saved and the orders that wait [default: .state in
    /// the folder of --bus, else $STATE_DIRECTORY, $XDG_STATE_HOME/lager or ~/.local/state/lager]
    #[arg(long, global = true, value_name = "FOLDER", help_heading = "Robot")]
    pub state: Option<PathBuf>,
    /// Append traces to this file: those RUST_LOG asks for, or `info`
    #[arg(long, global = true, value_name = "FILE", help_heading = "Output")]
    pub log: Option<PathBuf>,
    /// Write traces as JSON, one value a line: to the file of --log, else to standard error
    #[arg(long, global = true, help_heading = "Output")]
    pub log_json: bool,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run everything on this machine: the robot's body and all services, until Ctrl-C
    Up(Box<UpArgs>),
    /// Run the whole robot in one process in virtual time: deterministic, no bus
    Simulate(SimulateArgs),
    /// See the whole robot on one screen: its links, its mission, and every topic's rate and losses
    Top(TopArgs),
    /// Look at any topic of the bus, measure it, and publish on it
    Topic(TopicArgs),
    /// Record the bus, and look at recordings, mend and play them
    Bag(BagArgs),
    /// Measure the bus on this machine, beside its baselines in the same run
    Bench(BenchArgs),
    /// Steer by hand in manual mode, renewed until it is done or Ctrl-C
    #[command(
        after_help = "COMMAND is a name (stop, forward, follow-forward, backward, follow-backward, left, right, left-diag, right-diag) or a code 1..9 as 8 binary digits, decimal or 0x-hex."
    )]
    Drive {
        /// Name or code of the command
        #[arg(allow_negative_numbers = true, value_parser = values::wheel_command)]
        command: OperatorCommand,
        /// Let go after this many seconds instead of at Ctrl-C
        #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::seconds)]
        seconds: Option<f64>,
    },
    /// Move the arm one step
    #[command(
        after_help = "COMMAND is a name (clockwise, counter-clockwise, in, out, up, down, left, right, squeeze, release) or a code 0xF1..0xFA as 8 binary digits, decimal or 0x-hex."
    )]
    Arm {
        /// Name or code of the command
        #[arg(allow_negative_numbers = true, value_parser = values::arm_command)]
        command: OperatorCommand,
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
    #[command(after_help = "Examples:
  lager fetch 3               the product with this number
  lager fetch screws          the one with this name; `lager map` shows both")]
    Fetch {
        /// The product's number, or its name in the warehouse's file
        #[arg(allow_negative_numbers = true, value_parser = values::product)]
        product: Called,
    },
    /// Take an order back, as `queue cancel` does
    #[command(after_help = "Examples:
  lager queue                 the orders with their numbers
  lager cancel 4711           fetch order 4711 no more")]
    Cancel {
        /// The order's number
        #[arg(value_name = "ORDER", allow_negative_numbers = true, value_parser = values::order)]
        id: u32,
    },
    /// Show the warehouse, its goods and the ways that are blocked, or say that goods are back
    #[command(after_help = "Examples:
  lager map                   the floor, where each product stands, and what is in the way
  lager map back 3            product 3, which was delivered, is in its place again
  lager map back              so are all goods

The robot remembers which goods it has delivered or has not found in their place, and refuses to
fetch them until they are back.")]
    Map {
        /// What to change [default: nothing, show it]
        #[command(subcommand)]
        change: Option<MapChange>,
    },
    /// Show the orders, add one, take one back, or have one carried out earlier
    #[command(after_help = "Examples:
  lager queue                 the orders with their numbers, the next one first
  lager queue add 3           fetch product 3 after all the others, once the robot is autonomous
  lager queue up 4711         carry order 4711 out before the one that stands before it
  lager queue cancel 4711     take it back

The order that is under way can be taken back until the robot holds its goods; the others stay in
the queue. It then goes home, or for the next order.")]
    Queue {
        /// What to change [default: nothing, show it]
        #[command(subcommand)]
        change: Option<QueueChange>,
    },
    /// Tell the robot that the product has been picked up
    Picked {
        /// Believe it even if the claw feels nothing and the arm is not in its carry pose
        #[arg(long)]
        force: bool,
    },
    /// Choose who picks the next goods up: a person (`lager picked`) or the robot
    Pick {
        /// Who
        by: PickBy,
    },
    /// Tell the robot that it has been put on the delivery node, looking into the warehouse
    Reset,
    /// Press a button of the robot: `reset` as `lager reset`, `switch` for the other mode
    Press {
        /// Which
        button: Button,
    },
    /// Show what stands on the ways of the simulated floor, put a thing there, or take it away
    #[command(after_help = "Examples:
  lager obstacle                  what stands where
  lager obstacle put 1,0,right    a thing on the way from crossing 1,0 to 2,0
  lager obstacle take 2,0,left    the same one is gone

What stands there outlives a restart of the simulator.")]
    Obstacle {
        /// What to change [default: nothing, show them]
        #[command(subcommand)]
        change: Option<ObstacleChange>,
    },
    /// Put a simulated robot on a crossing and tell logic; a real one you have put there yourself
    #[command(after_help = "Examples:
  lager place                 a simulated robot, on the delivery node, looking into the warehouse
  lager place 2,1,up          on column 2, row 1, looking towards greater rows

The robot must stand: take the manual mode, or stop it. `lager reset` is the reset button of a
real robot that has been put on the delivery node.")]
    Place {
        /// Column, row and heading (left, up, right, down) [default: the delivery node of a
        /// simulated robot]
        #[arg(value_name = "X,Y,HEADING", allow_hyphen_values = true)]
        place: Option<Place>,
    },
    /// Set the gains of the line following (PD)
    Gains {
        /// Proportional gain, 2 unless set
        #[arg(allow_negative_numbers = true, value_parser = values::gain)]
        p: u8,
        /// Derivative gain over 10 ms, 2 unless set
        #[arg(allow_negative_numbers = true, value_parser = values::gain)]
        d: u8,
    },
    /// Calibrate the line sensors: move the robot over tape and floor by hand for five seconds
    Calibrate,
    /// Find out what is wrong with this machine and how to mend it
    Doctor {
        /// Remove what dead processes left on the bus
        #[arg(long)]
        fix: bool,
        /// Print one line of JSON
        #[arg(long, help_heading = "Output")]
        json: bool,
        /// What `lager up` is to be started with
        #[command(flatten)]
        realtime: UpRealtimeArgs,
    },
    /// Print the configuration in force, with every key
    Config {
        /// Print an iceoryx2.toml instead, with which other iceoryx2 programs join the bus
        #[arg(long)]
        iceoryx2: bool,
    },
    /// The service that talks to the external computer, and the only one with a socket to the
    /// network
    #[command(after_help = "Examples:
  lager comm --station 192.168.1.5:7420

It connects to a station for ever. In manual mode the robot carries out what the
station answers, and stands when the link is lost; in autonomous mode it fetches what
the station answers, and goes on without the link unless [comm] link_lost says otherwise.")]
    Comm(CommArgs),
    /// The external computer: answers robots by TCP, and lets a GaG answer them
    #[command(after_help = "Examples:
  lager station --warehouse warehouse.toml             robots of this machine
  lager station --listen 192.168.1.5:7420 --warehouse warehouse.toml
  lager gag                                            be its GaG: answer what it asks

It answers a robot from the warehouse file and by itself. While a GaG is connected to
its socket, that answers instead, in the words of the document's grammar, for the robot
that has been connected for longest; what it says of the warehouse is saved. Robots and
GaG are not asked who they are: let only those reach --listen who may drive. A panel that
others than this machine can reach asks for a token, which is printed once.")]
    Station(StationArgs),
    /// Show the robot to programs outside: figures for Prometheus, live views for Foxglove
    Gateway(GatewayArgs),
    /// Be the GaG of a station in this terminal: describe the warehouse, choose goods, drive
    #[command(after_help = "Examples:
  lager gag                                  at the station of the robot that is up, or of `lager station`
  lager gag --socket /tmp/somebody/gag       at somebody else's
  printf 'fetchprod 3\nfetchprod 1\n' | lager gag

It shows what the station asks and what the robot says, in the document's language. Answer with the
whole line or with what stands behind the word: to `fetchprod` with 3 or with `fetchprod 3`. What is
typed before it is asked for waits, but `styrcomm 1` stops at once and drops the commands that wait.
One GaG is connected at a time.")]
    Gag {
        /// The station's unix socket [default: that of the robot's own station, else gag in the
        /// folder of the bus]
        #[arg(long, value_name = "SOCKET", help_heading = "Station")]
        socket: Option<PathBuf>,
    },
    /// Print what makes a shell complete this command line
    #[command(after_help = "Examples:
  lager completions bash > ~/.local/share/bash-completion/completions/lager
  lager completions zsh > ~/.zfunc/_lager
  lager completions fish > ~/.config/fish/completions/lager.fish")]
    Completions {
        /// Which shell
        shell: clap_complete::Shell,
    },
    /// What `up` needs done on the bus; only `up` starts it
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

/// A button of the robot.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Button {
    /// It has been put on the delivery node, looking into the warehouse
    Reset,
    /// Who steers: a person or logic
    Switch,
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
  lager up --sensor /dev/ttyUSB0 --steering /dev/ttyUSB1  the boards, driven by a person
  lager up --sensor /dev/ttyUSB0 --steering /dev/ttyUSB1 --script --mission 1
                                                          the boards, driving by themselves
  lager up --body chip                                    their images in an emulator
  lager up --station 192.168.1.5:7420                     another machine is the external computer
  lager up --metrics                                      figures for Prometheus
  lager up --realtime 20 --lock-memory --core 1

Real time is for bridge and logic, the services between sensor and steering, and
for those that take their place after a crash. The supervisor keeps the normal
priority, and so does a simulated or emulated body, which stands for boards with
processors of their own. What is not granted is an error (5) that says how to get
it; `lager doctor` with the same flags tries it beforehand.

Whoever is farther along the path goes first: the bridge's main loop has the
priority, logic one below, and the threads that read the ports two below. On one
core (--core 1 binds bridge and logic to core 1) they wake each other sooner than
across two, of which one has to be woken from its rest. With waiting = \"adaptive\"
or \"spin\" in [bus] each needs a core of its own instead, and all have the priority.")]
pub struct UpArgs {
    /// What to drive [default: sim]
    #[arg(long, help_heading = "Body")]
    pub body: Option<Body>,
    /// Serial port of the sensor board (implies --body serial)
    #[arg(long, value_name = "PORT", conflicts_with_all = ["images", "emulator"], help_heading = "Body")]
    pub sensor: Option<PathBuf>,
    /// Serial port of the steering board (implies --body serial)
    #[arg(long, value_name = "PORT", conflicts_with_all = ["images", "emulator"], help_heading = "Body")]
    pub steering: Option<PathBuf>,
    /// Baud rate of both ports, which the boards' images are built for [default: 500000]
    #[arg(long, value_name = "BAUD", allow_negative_numbers = true, value_parser = values::baud, help_heading = "Body")]
    pub baud: Option<u32>,
    /// Folder of sensor.elf and steering.elf, what emulated boards run (implies --body chip)
    #[arg(long, value_name = "FOLDER", help_heading = "Body")]
    pub images: Option<PathBuf>,
    /// Program that emulates the boards (implies --body chip)
    #[arg(long, value_name = "FILE", help_heading = "Body")]
    pub emulator: Option<PathBuf>,
    /// Built-in warehouse or warehouse file [default: small]
    #[arg(long, value_name = "FILE", help_heading = "Mission")]
    pub warehouse: Option<String>,
    /// Seed of the simulated robot's noise [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = values::seed, help_heading = "Body")]
    pub seed: Option<u64>,
    /// So many things come and go on a simulated floor with squares of 50 cm or more [default: 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = values::obstacles, help_heading = "Body")]
    pub obstacles: Option<u32>,
    /// Run the clock of a simulated robot this many times as fast, that of an emulated one at most
    /// [default: 1]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = values::speed, help_heading = "Body")]
    pub speed: Option<f64>,
    /// The external computer that runs at this address, instead of one that `up` starts
    #[arg(long, value_name = "HOST:PORT", value_parser = values::calls, conflicts_with = "no_station", help_heading = "Station")]
    pub station: Option<String>,
    /// The file of the secret by which the robot and its external computer prove who they are; it
    /// has mode 0600 [default: one of their own for a station that `up` starts]
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with = "no_station",
        help_heading = "Station"
    )]
    pub secret: Option<PathBuf>,
    /// Do without an external computer; `up` tells the robot its warehouse
    #[arg(long, help_heading = "Station")]
    pub no_station: bool,
    /// Where robots connect to the station that `up` starts [default: 127.0.0.1:7420, or a free
    /// port]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::listens, conflicts_with_all = ["no_station", "station"], help_heading = "Station")]
    pub listen: Option<std::net::SocketAddr>,
    /// Where a GaG connects to it: the path of a unix socket [default: gag in the robot's folder of
    /// the bus]
    #[arg(long, value_name = "SOCKET", conflicts_with_all = ["no_station", "station"], help_heading = "Station")]
    pub gag: Option<PathBuf>,
    /// Where the operator panel answers browsers of this machine [default: 127.0.0.1:7410, or a
    /// free port]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::listens, conflicts_with_all = ["headless", "no_station", "station"], help_heading = "Station")]
    pub panel: Option<std::net::SocketAddr>,
    /// Do without a panel
    #[arg(long, help_heading = "Mission")]
    pub headless: bool,
    /// Show the robot's figures to Prometheus, there or at 127.0.0.1:7430
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_METRICS, value_parser = values::listens, help_heading = "Outside")]
    pub metrics: Option<std::net::SocketAddr>,
    /// Show the robot live to Foxglove, there or at 127.0.0.1:8765; `lager gateway --help` says
    /// more
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = USUAL_FOXGLOVE, value_parser = values::listens, help_heading = "Outside")]
    pub foxglove: Option<std::net::SocketAddr>,
    /// Let real boards carry out --mission by themselves, with nobody in their way; a simulated or
    /// emulated robot does so anyway
    #[arg(long, help_heading = "Mission")]
    pub script: bool,
    /// The products that wait to be fetched from the start, by number or name, in this order
    /// [default: the first of the warehouse; with the station of somebody else, none]
    #[arg(long, value_name = "GOODS", value_delimiter = ',', allow_negative_numbers = true, value_parser = values::product, help_heading = "Mission")]
    pub mission: Vec<Called>,
    /// End when the mission is delivered (0) or has failed (3)
    #[arg(long, help_heading = "Mission")]
    pub exit_when_done: bool,
    /// Print one line of JSON at the end; progress goes to standard error
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// What bridge and logic want of the machine
    #[command(flatten)]
    pub realtime: UpRealtimeArgs,
}

/// `lager comm`.
#[derive(Debug, Args)]
pub struct CommArgs {
    /// Where the external computer listens [default: as configured, or 127.0.0.1:7420]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::calls, help_heading = "Station")]
    pub station: Option<String>,
    /// The file of the secret by which both prove who they are; it has mode 0600 [default: as
    /// configured]
    #[arg(long, value_name = "FILE", help_heading = "Station")]
    pub secret: Option<PathBuf>,
    /// What every service is told
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
    /// The warehouse's file, in which changes are saved and which need not be there yet, or a
    /// built-in warehouse, whose changes are kept in the state folder [default: a GaG or the panel
    /// describes it, and it is kept in the state folder]
    #[arg(long, value_name = "FILE", help_heading = "Station")]
    pub warehouse: Option<String>,
    /// Products that a robot is to fetch after what waits for it already, by number or name, such
    /// as r1=3,screws; may be given several times
    #[arg(long, value_name = "ROBOT=GOODS,GOODS", value_parser = values::fetch, help_heading = "Station")]
    pub fetch: Vec<Fetch>,
    /// The file of the secrets by which robots prove who they are: a line `<name> <secret>` for each,
    /// or one secret for all; it has mode 0600 [default: none, and robots are believed]
    #[arg(long, value_name = "FILE", help_heading = "Station")]
    pub robots_secret: Option<PathBuf>,
    /// Where the operator panel answers browsers [default: 127.0.0.1:7410, or a free port]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::listens, help_heading = "Station")]
    pub panel: Option<std::net::SocketAddr>,
    /// Do without a panel
    #[arg(long, conflicts_with = "panel", help_heading = "Station")]
    pub no_panel: bool,
    /// Told to every service that is started again; a station goes on where the last one was anyway
    #[arg(long, hide = true)]
    pub resume: bool,
    /// End when the supervisor ends; standard output is then the socket for robots
    #[arg(long, value_name = "PID@NS", hide = true)]
    pub parent: Option<Parent>,
}

/// `lager bench`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager bench hop --quick                          a first look, in seconds
  lager bench hop --mode block --regime same-core  the software's share of a wake
  lager bench path --runs 9 --json > path.json     what a plot is drawn from
  lager bench fanout                               what observers cost the writer
  lager bench chip                                 the boards' images, in cycles: exact
  lager bench stop                                 200 stops at full speed; --runs N for N

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
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// How often to measure everything; every figure is the median over the runs (not `chip`)
    /// [default: 5]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = values::runs)]
    pub runs: Option<usize>,
    /// Take few samples, for a first look (not `chip`)
    #[arg(long)]
    pub quick: bool,
    /// How the receiver waits [default: all]
    #[arg(long, value_name = "MODE", value_delimiter = ',')]
    pub mode: Vec<Mode>,
    /// Where the processes run [default: all]
    #[arg(long, value_name = "REGIME", value_delimiter = ',')]
    pub regime: Vec<Regime>,
}

/// What `lager bench` can measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Scenario {
    /// One sample from a writer to a waiting reader in another process
    Hop,
    /// A sensor packet on one port until its steering command on the other, through bridge and
    /// logic
    Path,
    /// What publishing costs with 1 to 64 subscribers and observers
    Fanout,
    /// Cycles of the boards' real images, from tape to duty and to UART; `.ci/firmware` builds what
    /// it runs
    Chip,
    /// From the start of `lager stop` until a robot at full speed reports wheels at rest
    Stop,
    /// From a command that a GaG sends to the station until the motors of its robot obey
    Command,
    /// From a cut of the link to the station until a robot that is driven by hand stands
    Link,
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
