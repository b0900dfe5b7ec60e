//! `lager-ros2`: the robot as a node of ROS 2. `lager gateway --ros2` starts it.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use lager_battery::Pack;
use lager_home::UnitName;
use lager_ports::{Bus, BusConfig};
use lager_ros2::place::{Place, Reach, node_name};
use lager_ros2::reading::{ROLE, RunError, Settings, run};
use lager_ros2::told::Measures;
use lager_topics::LAGER;
use lager_wake::{GivenUp, Shutdown, Watchdog};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

mod voice;

/// How long a call into the bus may take.
const CALL: Duration = Duration::from_secs(3);

/// The robot as a node of ROS 2.
///
/// `lager gateway --ros2` starts it with the robot's configuration; README.md beside its sources says
/// which topics and services it has.
#[derive(Debug, Parser)]
#[command(version)]
struct Args {
    /// The robot
    #[arg(long, default_value = "r1")]
    name: UnitName,
    /// The folder in which the bus lives
    #[arg(long)]
    bus: Option<PathBuf>,
    /// The page on which an emulated robot shows its time
    #[arg(long)]
    clock: Option<PathBuf>,
    /// How many times as fast as real time the robot's clock runs
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// The domain of ROS 2 [default: ROS_DOMAIN_ID, or 0]
    #[arg(long)]
    domain: Option<u16>,
    /// How far it is heard [default: ROS_AUTOMATIC_DISCOVERY_RANGE, or localhost]
    #[arg(long, value_enum)]
    range: Option<Reach>,
    /// Least distance that the ranger tells, in cm
    #[arg(long, default_value_t = 10)]
    ranger_least_cm: u8,
    /// Greatest distance that the ranger tells, in cm
    #[arg(long, default_value_t = 80)]
    ranger_most_cm: u8,
    /// How far the ranger is ahead of the axle, in mm
    #[arg(long, default_value_t = lager_plant::body::IR_AHEAD as f32)]
    ranger_ahead_mm: f32,
    /// How far the line sensors are ahead of the axle, in mm
    #[arg(long, default_value_t = lager_plant::body::LINE_SENSOR_AHEAD as f32)]
    line_ahead_mm: f32,
    /// Lithium cells of the battery in series; 0: not known
    #[arg(long, default_value_t = 3)]
    cells: u8,
    /// Everybody who reaches the node may release a stop and order goods; after it, the command that
    /// is `lager` for this robot, with its flags
    #[arg(long, num_args = 1.., allow_hyphen_values = true, value_name = "LAGER")]
    operator: Option<Vec<OsString>>,
}

fn main() -> ExitCode {
    voice::begin();
    let args = Args::parse();
    match begin(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Usage(why)) => {
            voice::complain(&why);
            ExitCode::from(2)
        }
        Err(Failure::Run(error)) => {
            voice::complain(&error.to_string());
            match *error {
                RunError::Lock(_) => ExitCode::from(4),
                _ => ExitCode::FAILURE,
            }
        }
    }
}

/// Why the program ends.
enum Failure {
    /// What was asked for makes no sense.
    Usage(String),
    /// It cannot run, or not any more.
    Run(Box<RunError>),
}

impl<E: Into<RunError>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Run(Box::new(error.into()))
    }
}

fn begin(args: Args) -> Result<(), Failure> {
    let variable = |name: &str| std::env::var(name).ok();
    let place = Place::of(args.domain, args.range, variable)
        .map_err(|error| Failure::Usage(error.to_string()))?;
    let shutdown = Shutdown::new();
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        // A second one ends it at once.
        signal_hook::flag::register_conditional_shutdown(signal, 130, shutdown.flag())
            .and_then(|_| signal_hook::flag::register(signal, shutdown.flag()))
            .map_err(|error| Failure::Usage(format!("signals cannot be heard: {error}")))?;
    }
    let watchdog = Watchdog::start_in_order(CALL, &shutdown, |why| {
        if let GivenUp::Hung { what } = why {
            voice::complain(&format!(
                "{what} took too long; is the bus damaged? (`lager doctor`)"
            ));
        }
        std::process::exit(1);
    })
    .map_err(|error| Failure::Usage(format!("there is no thread for the watch: {error}")))?;
    let config = BusConfig {
        unit: args.name.clone(),
        speed: args.speed,
        clock: args.clock,
        folder: args.bus,
        ..BusConfig::of(&LAGER)
    };
    let bus = watchdog.over("joining the bus", || Bus::open(&config, ROLE))?;
    let settings = Settings {
        name: node_name(args.name.as_str()),
        place,
        measures: Measures {
            ranger_cm: (args.ranger_least_cm, args.ranger_most_cm),
            ranger_ahead_mm: args.ranger_ahead_mm,
            line_ahead_mm: args.line_ahead_mm,
            pack: Pack {
                cells: args.cells,
                low_decivolts: 0,
            },
        },
        lager: args.operator,
    };
    voice::warn_of(place, settings.lager.is_some());
    run(&bus, settings, &watchdog, &shutdown, voice::say)?;
    Ok(())
}
