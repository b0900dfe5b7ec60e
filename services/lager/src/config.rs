//! The configuration: one TOML file, every key with a default, command-line flags on top.
//!
//! It stands apart from the command line because the services read it too. The supervisor gives
//! every child process the effective configuration on its standard input, so a flag reaches all of
//! them or none. An unknown key is an error.

mod battery;
mod bus;
mod buttons;
mod chip;
mod documented;
mod gateway;
mod invalid;
mod logic;
mod realtime;
mod robot;
mod section;
mod serial;
mod station;

use std::io::Read as _;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use lager_battery::Pack;
use lager_home::UnitName;
use lager_lines::check_names;
use lager_orders::Pick;
use lager_plant::{Build, MOST_OBSTACLES, Warehouse};
use lager_ports::BusConfig;
use lager_station::files;
use lager_supervisor::Service;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_supervisor::state_folder;
use lager_topics::LAGER;
use lager_wire::{
    ArmProfile, LineProfile, RangerProfile, RobotProfile, SensorProfile, SteeringProfile,
    WheelsProfile,
};
use serde::{Deserialize, Serialize};

pub use battery::BatterySection;
pub use bus::{BusSection, Waiting};
pub use buttons::ButtonsSection;
pub use chip::{ChipSection, program_near};
pub use documented::flag;
pub use gateway::{GatewaySection, ZenohSection};
pub use logic::LogicSection;
pub use realtime::RealtimeSection;
pub use serial::{BAUD_RATES, SerialSection};
pub use station::{CommSection, StationSection};

use section::section;

use crate::meant::meant;
use crate::realtime::HIGHEST_PRIORITY;

/// The built-in warehouse of a simulated or emulated robot whose warehouse nobody names.
pub const SIMULATED_WAREHOUSE: &str = "small";

/// The allowed speeds of a robot's clock; 1 is real time.
pub const SPEEDS: RangeInclusive<f64> = 0.01..=20.0;

section! {
    ""
    /// Everything a process of the robot needs to know at start.
    pub struct Config {
        /// The robot's name: the middle part of every topic's name.
        pub name: String = "r1".into(),
        /// The speed of the robot's clock; 1 is real time. Real boards need 1. Emulated boards run
        /// slower if the machine cannot keep up.
        pub speed: f64 = 1.0,
        /// What the services drive: "sim", the simulated robot, "chip", the boards' real images in an
        /// emulator, or "serial", the boards at [serial].
        pub body: Body = Body::Sim,
        /// A built-in warehouse (small, curved, large) or the path of a warehouse file. Unset, a
        /// simulated or emulated robot has the built-in "small". Real boards then wait for a
        /// warehouse that somebody sets up at the panel, which is kept in the state folder.
        pub warehouse: Option<String> = None,
        /// The folder that keeps what outlives `lager up`: a warehouse that was set up at the
        /// panel, or the panel's changes to a built-in one (changes to a file are saved in the file), the
        /// orders that wait, and which goods a real robot has not found in their place. Unset,
        /// .state in the folder of the bus if one is named, else $STATE_DIRECTORY, else
        /// $XDG_STATE_HOME/lager, else ~/.local/state/lager.
        pub state: Option<PathBuf> = None,
        /// The file that describes how this robot is built, as it goes from machine to machine: the
        /// sections [wheels], [line], [distance], [battery], [arm], [logic] and [buttons]. Unset,
        /// real boards have robot.toml in their robot's state folder; without it they stand, but for
        /// driving by hand. A section stands in one of the two files.
        pub robot: Option<PathBuf> = None,
        pub log: LogSection = LogSection::default(),
        pub bus: BusSection = BusSection::default(),
        pub realtime: RealtimeSection = RealtimeSection::default(),
        pub serial: SerialSection = SerialSection::default(),
        pub wheels: WheelsProfile = WheelsProfile::default(),
        pub line: LineProfile = LineProfile::default(),
        pub distance: RangerProfile = RangerProfile::default(),
        pub battery: BatterySection = BatterySection::default(),
        pub arm: ArmProfile = ArmProfile::default(),
        pub logic: LogicSection = LogicSection::default(),
        pub simulator: SimulatorSection = SimulatorSection::default(),
        pub chip: ChipSection = ChipSection::default(),
        pub station: StationSection = StationSection::default(),
        pub comm: CommSection = CommSection::default(),
        pub buttons: ButtonsSection = ButtonsSection::default(),
        pub gateway: GatewaySection = GatewaySection::default(),
    }
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

section! {
    "log"
    /// Traces for debugging.
    pub struct LogSection {
        /// File to which all processes of the robot append their traces: those that RUST_LOG
        /// selects, or "info". Unset, they trace only what RUST_LOG selects, on standard error.
        pub file: Option<PathBuf> = None,
        /// Traces as JSON for programs, one value a line: into that file, or on standard error.
        pub json: bool = false,
    }
}

section! {
    "simulator"
    /// The simulated robot and the emulated boards' world.
    pub struct SimulatorSection {
        /// Seed of all noise: the same seed gives the same robot.
        pub seed: u64 = 1,
        /// Seed of how the simulated robot is built: which motors are swapped or reversed, how fast it
        /// is, which way round its line sensors read, which ranger it has, whether its battery is
        /// measured, and which servos its arm has. Unset, it is built as the defaults of [wheels],
        /// [line], [distance], [battery] and [arm] say. Another robot drives well only when somebody
        /// has described it (`lager commission`).
        pub built: Option<u64> = None,
        /// How many things come and go on the ways of the simulated floor, at random: 0 to 64. They
        /// need squares of 50 cm or more.
        pub obstacles: u32 = 0,
    }
}

impl SimulatorSection {
    /// How the simulated robot is built.
    pub fn build(&self) -> Build {
        self.built.map_or_else(Build::default, Build::drawn)
    }
}

impl Config {
    /// Reads `path`, where `-` is standard input. Without a path it reads `lager.toml` in the
    /// current folder, or takes the defaults if there is none.
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

    /// Refuses values that no process could work with. Each error is a sentence.
    pub fn validate(&self) -> Result<()> {
        self.name.parse::<UnitName>()?;
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
        self.serial.validate()?;
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
        self.wheels.validate()?;
        self.distance.validate()?;
        self.arm.validate()?;
        self.gateway.addresses().context("[gateway.zenoh]")?;
        Ok(())
    }

    /// The configuration with which the running robot of this name was started; `None` if no such
    /// robot runs on this bus.
    pub fn of_running_robot(&self) -> Result<Option<Self>> {
        let file = RuntimeFolder::running(&self.bus()?)?;
        file.map(|file| Self::load(Some(&file))).transpose()
    }

    /// The folder of everything that outlives a robot and a station.
    pub fn state_root(&self) -> Result<PathBuf> {
        state_folder::root(self.state.as_deref(), self.bus.folder.as_deref())
    }

    /// The bus that this configuration names.
    pub fn bus(&self) -> Result<BusConfig> {
        Ok(BusConfig {
            application: &LAGER,
            unit: self.name.parse()?,
            speed: self.speed,
            clock: self.chip.clock.clone(),
            folder: self.bus.folder.clone(),
        })
    }

    /// The name or file of the warehouse; `None` if real boards wait for one.
    pub fn warehouse_name(&self) -> Option<&str> {
        match (&self.warehouse, self.body) {
            (Some(name), _) => Some(name),
            (None, Body::Serial) => None,
            (None, Body::Sim | Body::Chip) => Some(SIMULATED_WAREHOUSE),
        }
    }

    /// The warehouse, built in or from its file, checked. `None` if real boards wait for one.
    pub fn known_warehouse(&self) -> Result<Option<Warehouse>> {
        match (self.warehouse_name(), self.body) {
            (None, _) => Ok(None),
            (Some(name), Body::Serial) => warehouse(name).map(Some),
            (Some(_), Body::Sim | Body::Chip) => self.simulated_warehouse().map(Some),
        }
    }

    /// The warehouse of a simulated world, also of one behind the ports of real boards.
    pub fn simulated_warehouse(&self) -> Result<Warehouse> {
        let name = self.warehouse.as_deref().unwrap_or(SIMULATED_WAREHOUSE);
        let warehouse = warehouse(name)?;
        if self.simulator.obstacles > 0 {
            warehouse
                .has_room_for_things()
                .with_context(|| format!("no things can come and go in {name}"))?;
        }
        Ok(warehouse)
    }

    /// The warehouse, where the caller needs one: see [`Self::known_warehouse`].
    pub fn warehouse(&self) -> Result<Warehouse> {
        let known = self.known_warehouse()?;
        known.context("the robot has no warehouse yet; set one up at the panel, or name one (`lager up --warehouse FILE`)")
    }

    /// Who picks the goods up: from the configuration, or by the kind of body.
    pub fn pick(&self) -> Pick {
        self.logic.pick.unwrap_or(match self.body {
            Body::Serial => Pick::Manual,
            Body::Sim | Body::Chip => Pick::Auto,
        })
    }

    /// What the boards are told of their robot.
    pub fn robot(&self) -> RobotProfile {
        RobotProfile {
            steering: SteeringProfile {
                wheels: self.wheels,
                divider: self.battery.divider.unwrap_or(self.body != Body::Serial),
            },
            sensors: SensorProfile {
                line: self.line,
                ranger: self.distance,
            },
            arm: self.arm,
        }
    }

    /// The robot's battery.
    pub const fn pack(&self) -> Pack {
        Pack {
            cells: self.logic.battery_cells,
            low_decivolts: self.logic.low_battery_decivolts,
        }
    }

    /// The navigator's part of the configuration.
    pub fn navigator(&self) -> lager_logic::LogicConfig {
        lager_logic::LogicConfig {
            duty: self.wheels.duty,
            cruise_mm_per_s: self.logic.cruise_mm_per_s,
            sensor_ahead_mm: self.logic.sensor_ahead_mm,
            turn_deg_per_s: 360_000.0 / f32::from(self.wheels.full_turn_ms),
            tape_mm: self.logic.tape_mm,
            ranger_ahead_mm: self.logic.ranger_ahead_mm,
            low_battery_decivolts: self.logic.low_battery_decivolts,
            // No ranger sees farther than its model.
            ranger_cm: self.logic.ranger_cm.min(self.distance.range_cm().1),
            try_again: Duration::from_secs(self.logic.try_again_s.into()),
            reach_shoulder: self.logic.reach_shoulder,
            reach_elbow: self.logic.reach_elbow,
            pick: self.pick(),
            arm: self.arm,
            is_described: self.is_described(),
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
    use lager_wake::Policy;

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
            ("[wheels]\nfull_turn_ms = 0", "full_turn_ms is 0"),
            ("[wheels]\nduty = 255", "40 to 200"),
            ("[distance]\nmodel = \"own\"\nnear_cm = 90", "smaller"),
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
        let named: Config = toml::from_str("[serial]\nsensor = \"/dev/a\"").expect("valid");
        let refused = named.validate().expect_err("one port").to_string();
        assert!(refused.contains("name both, or none"), "{refused}");
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
            ("", Pick::Auto),
            ("body = \"chip\"", Pick::Auto),
            ("body = \"serial\"", Pick::Manual),
            ("[logic]\npick = \"manual\"", Pick::Manual),
            ("body = \"serial\"\n[logic]\npick = \"auto\"", Pick::Auto),
        ] {
            let config: Config = toml::from_str(text).expect("valid TOML");
            assert_eq!(config.navigator().pick, pick, "{text}");
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
    fn raw_readings_come_unasked_where_they_cost_little() {
        for (text, are_told) in [
            ("", true),
            ("raw_line = false", false),
            ("baud = 9600", false),
            ("baud = 9600\nraw_line = true", true),
        ] {
            let config: Config = toml::from_str(&format!("[serial]\n{text}")).expect("valid");
            assert_eq!(config.serial.tells_raw_line(), are_told, "{text}");
        }
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
