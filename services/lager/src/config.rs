//! The configuration: one TOML file, every key with a default, command-line flags on top.
//!
//! It is apart from the command line because the services read it too. The supervisor gives every
//! child process the effective configuration on its standard input, so a flag reaches all of them
//! or none. An unknown key is an error, never ignored.

mod bus;
mod buttons;
mod chip;
mod documented;
mod gateway;
mod invalid;
mod logic;
mod realtime;
mod station;

use std::io::Read as _;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use lager_lines::check_names;
use lager_plant::{MOST_OBSTACLES, Warehouse};
use lager_ports::{BusConfig, RobotName};
use lager_station::files;
use lager_wire::ArmProfile;
use serde::{Deserialize, Serialize};

pub use bus::{BusSection, Waiting};
pub use buttons::ButtonsSection;
pub use chip::ChipSection;
pub use gateway::GatewaySection;
pub use logic::{LogicSection, PickBy};
pub use realtime::RealtimeSection;
pub use station::{CommSection, StationSection, WithoutLink};

use crate::meant::meant;
use crate::realtime::HIGHEST_PRIORITY;
use crate::services::Service;

/// The rates that boards are built for, in baud: that of today and the original's UBRR 103.
pub const BAUD_RATES: [u32; 2] = [500_000, 9_600];

/// How many times as fast as real time a robot's clock may run.
pub const SPEEDS: RangeInclusive<f64> = 0.01..=20.0;

/// Everything a process of the robot needs to know at start.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// The robot's name: the middle part of every topic's name.
    pub name: String,
    /// How many times as fast as real time the robot's clock runs; real boards need 1, and
    /// emulated ones run as fast as the machine can if that is less.
    pub speed: f64,
    /// What the services drive.
    pub body: Body,
    /// A built-in warehouse (`small`, `curved`, `large`) or the path of a warehouse file.
    pub warehouse: String,
    /// Where it keeps what outlives it; unset, as `state.rs` has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<PathBuf>,
    /// Where the traces go.
    pub log: LogSection,
    /// Where the bus lives.
    pub bus: BusSection,
    /// What the services on the path from sensor to steering want of the machine.
    pub realtime: RealtimeSection,
    /// The two serial ports.
    pub serial: SerialSection,
    /// What the arm may do, as the steering board is told.
    pub arm: ArmProfile,
    /// What logic knows of the robot's measures.
    pub logic: LogicSection,
    /// The simulated robot and the emulated boards' world.
    pub simulator: SimulatorSection,
    /// The emulated boards.
    pub chip: ChipSection,
    /// The external computer.
    pub station: StationSection,
    /// How the robot talks to it.
    pub comm: CommSection,
    /// The robot's own buttons.
    pub buttons: ButtonsSection,
    /// What programs outside are shown.
    pub gateway: GatewaySection,
}

/// What stands at the other end of the two UARTs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Body {
    /// The simulated robot of this program.
    Sim,
    /// The real boards' images in an emulator, see `[chip]`.
    Chip,
    /// The real boards, at the ports of `[serial]`.
    Serial,
}

impl Body {
    /// The service that stands for the boards where there are none.
    pub fn service(self) -> Option<Service> {
        match self {
            Self::Sim => Some(Service::Simulator),
            Self::Chip => Some(Service::Emulator),
            Self::Serial => None,
        }
    }
}

/// `[log]`: what happened, for whoever debugs.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LogSection {
    /// The file that traces are appended to, instead of none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// One JSON value a line instead of text for people.
    pub json: bool,
}

/// `[serial]`: the cables to the boards.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SerialSection {
    /// Port of the sensor board. Given the wrong way round the robot works all the same: the
    /// boards tell who they are.
    pub sensor: PathBuf,
    /// Port of the steering board.
    pub steering: PathBuf,
    /// Baud rate of both: 500000, or 9600 for boards built with the original's UBRR 103.
    pub baud: u32,
    /// Whether the sensor board sends the raw reading of all eleven sensors as well.
    pub raw_line: bool,
    /// Whether an original steering board is driven, whose commands have no age limit.
    pub original_boards: bool,
}

/// `[simulator]`: the simulated robot and the emulated boards' world.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SimulatorSection {
    /// Seed of all noise: the same seed is the same robot.
    pub seed: u64,
    /// So many things come and go on the ways, at random.
    pub obstacles: u32,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            name: "r1".into(),
            speed: 1.0,
            body: Body::Sim,
            warehouse: "small".into(),
            state: None,
            log: LogSection::default(),
            bus: BusSection::default(),
            realtime: RealtimeSection::default(),
            serial: SerialSection::default(),
            arm: ArmProfile::default(),
            logic: LogicSection::default(),
            simulator: SimulatorSection::default(),
            chip: ChipSection::default(),
            station: StationSection::default(),
            comm: CommSection::default(),
            buttons: ButtonsSection::default(),
            gateway: GatewaySection::default(),
        }
    }
}

impl Default for SerialSection {
    fn default() -> Self {
        Self {
            sensor: "/dev/lager-sensor".into(),
            steering: "/dev/lager-steering".into(),
            baud: 500_000,
            raw_line: false,
            original_boards: false,
        }
    }
}

impl Default for SimulatorSection {
    fn default() -> Self {
        Self {
            seed: 1,
            obstacles: 0,
        }
    }
}

impl Config {
    /// Reads `path`, where `-` is standard input, or `lager.toml` in the current folder where there
    /// is one, or the defaults.
    pub fn load(path: Option<&Path>) -> Result<Self> {
        let path = match path {
            Some(path) => path,
            None if Path::new("lager.toml").is_file() => Path::new("lager.toml"),
            None => return Ok(Self::default()),
        };
        let text = match path == Path::new("-") {
            true => {
                let mut text = String::new();
                let mut input = std::io::stdin().take(files::MOST_BYTES);
                input.read_to_string(&mut text).map(|_| text)
            }
            false => files::read(path),
        };
        let text =
            text.with_context(|| format!("cannot read the configuration {}", path.display()))?;
        toml::from_str(&text).map_err(|error| {
            anyhow!(
                "the configuration {} is not valid: {}. `lager config` prints one with every key",
                path.display(),
                invalid::why(&text, &error)
            )
        })
    }

    /// Refuses values no process could work with, each with a sentence.
    pub fn validate(&self) -> Result<()> {
        self.name.parse::<RobotName>()?;
        if !SPEEDS.contains(&self.speed) {
            bail!(
                "speed is {}; it must be from {} to {} (`lager simulate` runs faster)",
                self.speed,
                SPEEDS.start(),
                SPEEDS.end()
            );
        }
        if self.body == Body::Serial && self.speed != 1.0 {
            bail!(
                "speed {} needs a simulated or emulated body; real boards run at 1",
                self.speed
            );
        }
        if !BAUD_RATES.contains(&self.serial.baud) {
            let [usual, slow] = BAUD_RATES;
            bail!(
                "[serial] baud is {}; boards are built for {usual}, or for {slow} as the original ones",
                self.serial.baud
            );
        }
        if self.simulator.obstacles as usize > MOST_OBSTACLES {
            bail!(
                "[simulator] obstacles is {}; at most {MOST_OBSTACLES} things can stand in a warehouse",
                self.simulator.obstacles
            );
        }
        self.buttons.validate()?;
        self.logic.validate()?;
        self.bus.validate()?;
        if self.realtime.priority > HIGHEST_PRIORITY {
            bail!(
                "[realtime] priority is {}; it must be from 1 to {HIGHEST_PRIORITY}, or 0 for the normal scheduler",
                self.realtime.priority
            );
        }
        self.arm.validate()?;
        Ok(())
    }

    /// The bus this configuration names.
    pub fn bus(&self) -> Result<BusConfig> {
        Ok(BusConfig {
            robot: self.name.parse()?,
            speed: self.speed,
            clock: self.chip.clock.clone(),
            folder: self.bus.folder.clone(),
        })
    }

    /// The warehouse, built in or from its file, checked. It has room for the things that are to
    /// come and go there, if any are.
    pub fn warehouse(&self) -> Result<Warehouse> {
        let warehouse = warehouse(&self.warehouse)?;
        if self.body != Body::Serial && self.simulator.obstacles > 0 {
            warehouse
                .has_room_for_things()
                .with_context(|| format!("no things can come and go in {}", self.warehouse))?;
        }
        Ok(warehouse)
    }

    /// Who picks the goods up: as told, or else as it is usual with the body.
    pub fn pick(&self) -> PickBy {
        self.logic.pick.unwrap_or(match self.body {
            Body::Serial => PickBy::Manual,
            Body::Sim | Body::Chip => PickBy::Auto,
        })
    }

    /// What the navigator is told.
    pub fn navigator(&self) -> lager_logic::LogicConfig {
        lager_logic::LogicConfig {
            cruise_mm_per_s: self.logic.cruise_mm_per_s,
            sensor_ahead_mm: self.logic.sensor_ahead_mm,
            turn_deg_per_s: self.logic.turn_deg_per_s,
            tape_mm: self.logic.tape_mm,
            ranger_ahead_mm: self.logic.ranger_ahead_mm,
            low_battery_decivolts: self.logic.low_battery_decivolts,
            ranger_cm: self.logic.ranger_cm,
            try_again: Duration::from_secs(self.logic.try_again_s.into()),
            reach_shoulder: self.logic.reach_shoulder,
            reach_elbow: self.logic.reach_elbow,
            pick: self.pick().into(),
            arm: self.arm,
            waiting: self.bus.policy(),
            ..lager_logic::LogicConfig::default()
        }
    }
}

/// A warehouse by the name of a built-in one or by its file.
pub fn warehouse(name: &str) -> Result<Warehouse> {
    if let Some(warehouse) = Warehouse::builtin(name) {
        return Ok(warehouse);
    }
    let read = files::read_toml::<Warehouse>(Path::new(name));
    let warehouse = read.with_context(|| match Path::new(name).exists() {
        true => format!("the warehouse file {name} is not valid"),
        false => format!(
            "there is no warehouse `{name}`{}: the built-in ones are {}, anything else is read as a file",
            meant(name, Warehouse::BUILTIN),
            Warehouse::BUILTIN.join(", ")
        ),
    })?;
    warehouse
        .validate()
        .with_context(|| format!("the warehouse file {name} cannot be built"))?;
    let names = warehouse.products.iter();
    check_names(names.filter_map(|product| product.name.as_deref()))
        .with_context(|| format!("the warehouse file {name}"))?;
    Ok(warehouse)
}

#[cfg(test)]
mod tests {
    use lager_ports::Policy;

    use super::*;

    #[test]
    fn an_unknown_key_is_an_error_that_names_it() {
        let error = toml::from_str::<Config>("sped = 2").expect_err("a typing error");
        assert!(error.to_string().contains("sped"), "{error}");
    }

    #[test]
    fn impossible_values_are_refused_with_a_sentence() {
        for (config, word) in [
            (
                Config {
                    speed: 0.0,
                    ..Config::default()
                },
                "speed",
            ),
            (
                Config {
                    name: "R 1".into(),
                    ..Config::default()
                },
                "name",
            ),
            (
                Config {
                    body: Body::Serial,
                    speed: 2.0,
                    ..Config::default()
                },
                "simulated",
            ),
            (
                Config {
                    bus: BusSection {
                        longest_spin_us: 1_000_000,
                        ..BusSection::default()
                    },
                    ..Config::default()
                },
                "longest_spin_us",
            ),
            (
                Config {
                    realtime: RealtimeSection {
                        priority: 100,
                        ..RealtimeSection::default()
                    },
                    ..Config::default()
                },
                "1 to 99",
            ),
            (
                Config {
                    arm: ArmProfile {
                        gripper_open: 210,
                        ..ArmProfile::default()
                    },
                    ..Config::default()
                },
                "gripper_closed",
            ),
        ] {
            let error = config.validate().expect_err("impossible");
            assert!(error.to_string().contains(word), "{error}");
        }
    }

    #[test]
    fn measures_that_no_robot_has_are_refused_by_their_keys() {
        for (text, word) in [
            ("[serial]\nbaud = 0", "baud is 0"),
            ("[serial]\nbaud = 115200", "500000"),
            ("[logic]\ncruise_mm_per_s = 0.0", "cruise_mm_per_s is 0"),
            ("[logic]\ncruise_mm_per_s = nan", "cruise_mm_per_s is NaN"),
            ("[logic]\ncruise_mm_per_s = -73.3", "10 to 1000"),
            ("[logic]\ncruise_mm_per_s = 1.0", "cruise_mm_per_s is 1"),
            ("[logic]\nsensor_ahead_mm = 0.0", "20 to 400"),
            ("[logic]\nsensor_ahead_mm = inf", "sensor_ahead_mm is inf"),
            ("[logic]\nsensor_ahead_mm = 160000.0", "sensor_ahead_mm"),
            ("[logic]\nturn_deg_per_s = 0.0", "turn_deg_per_s is 0"),
            ("[logic]\nreach_elbow = 1024", "reach_elbow is 1024"),
            ("[logic]\ntape_mm = 90.0", "5 to 50"),
            ("[logic]\nranger_ahead_mm = -1.0", "ranger_ahead_mm is -1"),
            ("[logic]\nranger_cm = 1", "ranger_cm is 1;"),
            ("[logic]\nranger_cm = 10", "11 to 255"),
        ] {
            let config: Config = toml::from_str(text).expect("valid TOML");
            let error = config.validate().expect_err("impossible").to_string();
            assert!(error.contains(word), "{error}");
        }
        let rates = BAUD_RATES.map(|baud| format!("[serial]\nbaud = {baud}"));
        let rangers = [0, 11].map(|reach| format!("[logic]\nranger_cm = {reach}"));
        for text in rates.iter().chain(&rangers) {
            let config: Config = toml::from_str(text).expect("valid TOML");
            config.validate().expect("a robot that there is");
        }
    }

    #[test]
    fn who_picks_is_as_told_and_else_as_usual_with_the_body() {
        for (text, pick) in [
            ("", PickBy::Auto),
            ("body = \"chip\"", PickBy::Auto),
            ("body = \"serial\"", PickBy::Manual),
            ("[logic]\npick = \"manual\"", PickBy::Manual),
            ("body = \"serial\"\n[logic]\npick = \"auto\"", PickBy::Auto),
        ] {
            let config: Config = toml::from_str(text).expect("valid TOML");
            assert_eq!(config.navigator().pick, pick.into(), "{text}");
        }
    }

    #[test]
    fn the_longest_spin_reaches_the_ports() {
        let config: Config =
            toml::from_str("[bus]\nwaiting = \"adaptive\"\nlongest_spin_us = 300").expect("valid");
        let longest_spin = Duration::from_micros(300);
        assert_eq!(config.bus.policy(), Policy::Adaptive { longest_spin });
        assert_eq!(config.navigator().waiting, config.bus.policy());
        let config: Config = toml::from_str("[bus]\nwaiting = \"adaptive\"").expect("valid");
        assert_eq!(config.bus.policy(), Policy::ADAPTIVE);
    }

    #[test]
    fn every_built_in_warehouse_can_be_had_by_name() {
        for name in Warehouse::BUILTIN {
            warehouse(name)
                .expect("built in")
                .validate()
                .expect("sound");
        }
        let error = warehouse("medium").expect_err("no such warehouse");
        assert!(
            error.to_string().contains("small, curved, large"),
            "{error}"
        );
        let error = warehouse("smal").expect_err("no such warehouse");
        assert!(
            error.to_string().contains("did you mean `small`?"),
            "{error}"
        );
    }

    #[test]
    fn a_mistyped_warehouse_is_refused_with_the_one_that_was_meant() {
        let refused = format!("{:#}", warehouse("smal").expect_err("there is none"));
        assert!(
            refused.contains("no warehouse `smal` (did you mean `small`?)"),
            "{refused}"
        );
        let path = std::env::temp_dir().join(format!("lager-sied-{}.toml", std::process::id()));
        let text = "size = [2, 1]\nside_length_cm = 50\n[[products]]\nid = 1\n";
        std::fs::write(&path, text).expect("a file");
        let refused = warehouse(&path.to_string_lossy()).expect_err("no such key");
        std::fs::remove_file(path).expect("it is there");
        let refused = format!("{refused:#}");
        assert!(refused.ends_with("; did you mean `product`?"), "{refused}");
    }
}
