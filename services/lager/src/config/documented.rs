//! The configuration as a file with every key explained; `lager config` prints it.

use std::fmt::Write as _;
use std::sync::LazyLock;

use lager_wire::{ArmProfile, LineProfile, RangerProfile, WheelsProfile};

use super::realtime::CoresSection;
use super::section::{Declared, Section};
use super::{
    BatterySection, BusSection, ButtonsSection, ChipSection, CommSection, Config, GatewaySection,
    LogSection, LogicSection, RealtimeSection, SerialSection, SimulatorSection, StationSection,
    ZenohSection,
};

/// Every section, in the order of the file.
const SECTIONS: [Section; 26] = [
    Config::SECTION,
    LogSection::SECTION,
    BusSection::SECTION,
    RealtimeSection::SECTION,
    CoresSection::SECTION,
    SerialSection::SECTION,
    Section {
        name: "wheels",
        about: WheelsProfile::ABOUT,
        keys: WheelsProfile::KEYS,
    },
    Section {
        name: "line",
        about: LineProfile::ABOUT,
        keys: LineProfile::KEYS,
    },
    Section {
        name: "distance",
        about: RangerProfile::ABOUT,
        keys: RangerProfile::KEYS,
    },
    BatterySection::SECTION,
    Section {
        name: "arm",
        about: ArmProfile::ABOUT,
        keys: ArmProfile::KEYS,
    },
    joints("arm.servos"),
    joints("arm.reversed"),
    joints("arm.limits"),
    joints("arm.neutral"),
    joints("arm.drop"),
    joints("arm.carry"),
    LogicSection::SECTION,
    SimulatorSection::SECTION,
    ChipSection::SECTION,
    StationSection::SECTION,
    CommSection::SECTION,
    ButtonsSection::SECTION,
    GatewaySection::SECTION,
    ZenohSection::SECTION,
    Section {
        name: "gateway.zenoh.rates",
        about: &[],
        keys: &[],
    },
];

/// A section of joints, whose names explain them. The key of the profile explains the section.
const fn joints(name: &'static str) -> Section {
    Section {
        name,
        about: &[],
        keys: &[],
    }
}

/// What a key means, in the words of the printed file.
pub fn meaning(section: &str, key: &str) -> Option<String> {
    let section = SECTIONS.iter().find(|it| it.name == section)?;
    let (_, lines) = section.keys.iter().find(|(name, _)| *name == key)?;
    (!lines.is_empty()).then(|| lines.concat().trim_start().to_owned())
}

/// The defaults in TOML, made once: the command line needs some at every start.
static DEFAULTS: LazyLock<String> =
    LazyLock::new(|| toml::to_string(&Config::default()).expect("the defaults are TOML"));

/// The help of a flag that replaces a key: what the key means, and its default.
///
/// # Panics
/// There is no such key. A test of the command line would show that.
pub fn flag(section: &str, key: &str) -> String {
    let meaning = meaning(section, key).expect("a key with an explanation");
    let meaning = meaning.trim_end_matches('.');
    let mut values = lines_of(&DEFAULTS, section).filter_map(|line| line.split_once(" = "));
    match values.find(|(name, _)| *name == key) {
        Some((_, default)) => format!("{meaning} [default: {}]", default.trim_matches('"')),
        None => meaning.to_owned(),
    }
}

impl Config {
    /// The configuration as a file with every key explained; `lager config` prints it.
    pub fn documented(&self) -> String {
        // The values as TOML has them: a section's line in brackets, and a line for each key.
        let values = toml::to_string(self).expect("every configuration is TOML");
        let mut text = String::new();
        for Section { name, about, keys } in SECTIONS {
            let mut set: Vec<&str> = lines_of(&values, name).collect();
            if !name.is_empty() {
                text.push('\n');
                explain(&mut text, about);
                explain(&mut text, of_its_key(name));
                // Writing to a String cannot fail.
                let _ = writeln!(text, "[{name}]");
            }
            for (key, explained) in keys {
                // What a section within this one holds stands below.
                if SECTIONS.iter().any(|it| is_within(it.name, name, key)) {
                    continue;
                }
                explain(&mut text, explained);
                let is_it = |line: &&str| line.split(" = ").next() == Some(key);
                let _ = match set.iter().position(is_it) {
                    Some(place) => writeln!(text, "{}", set.remove(place)),
                    None => writeln!(text, "# {key} = ..."),
                };
            }
            for line in set {
                let _ = writeln!(text, "{line}");
            }
        }
        text
    }
}

/// The explanation of the key that holds this section within another one.
fn of_its_key(section: &str) -> &'static [&'static str] {
    let keys = SECTIONS
        .iter()
        .flat_map(|of| of.keys.iter().map(|key| (of.name, key)));
    let mut holding = keys.filter(|(of, (key, _))| is_within(section, of, key));
    holding.next().map_or(&[], |(_, (_, explained))| *explained)
}

/// Whether `section` is a subsection that holds this key of another section.
fn is_within(section: &str, of: &str, key: &str) -> bool {
    match of {
        "" => section == key,
        of => {
            section
                .strip_prefix(of)
                .and_then(|rest| rest.strip_prefix('.'))
                == Some(key)
        }
    }
}

fn explain(text: &mut String, lines: &[&str]) {
    for line in lines {
        let _ = writeln!(text, "#{line}");
    }
}

/// The lines of the keys of a section.
fn lines_of<'a>(values: &'a str, section: &str) -> impl Iterator<Item = &'a str> {
    let head = format!("[{section}]");
    let mut within = section.is_empty();
    values.lines().filter(move |line| {
        if line.starts_with('[') {
            within = *line == head;
            return false;
        }
        within && !line.is_empty()
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Body, Waiting};
    use super::*;
    use lager_comm::LinkLost;
    use lager_orders::{Level, SwitchKind};
    use lager_wire::{ArmLimits, IrModel, JointLimits, JointServos, OneOrTwo, ReversedJoints};

    #[test]
    fn the_documented_file_reads_back_with_every_key() {
        let config = Config {
            name: "r7".into(),
            speed: 2.5,
            body: Body::Serial,
            warehouse: Some("a \"quoted\" name".into()),
            state: Some("/var/lib/lager".into()),
            robot: Some("/etc/lager/robot.toml".into()),
            log: LogSection {
                file: Some("/var/log/lager".into()),
                json: true,
            },
            bus: BusSection {
                folder: Some("/run/warehouse".into()),
                waiting: Waiting::Adaptive,
                longest_spin_us: 700,
            },
            realtime: RealtimeSection {
                priority: 20,
                lock_memory: true,
                cores: CoresSection {
                    bridge: [0, 2].into_iter().collect(),
                    ..CoresSection::default()
                },
            },
            wheels: WheelsProfile {
                swapped: true,
                duty: 120,
                ..WheelsProfile::default()
            },
            line: LineProfile {
                dark_is_high: false,
            },
            distance: RangerProfile {
                model: IrModel::Own,
                near_cm: 12,
                ..RangerProfile::default()
            },
            battery: BatterySection {
                divider: Some(false),
            },
            arm: ArmProfile {
                torque_limit: 700,
                servos: JointServos {
                    base: 12,
                    elbow: OneOrTwo::One(4),
                    ..JointServos::default()
                },
                reversed: ReversedJoints {
                    wrist: true,
                    ..ReversedJoints::default()
                },
                limits: JointLimits {
                    elbow: ArmLimits {
                        lowest: 100,
                        highest: 900,
                    },
                    ..JointLimits::default()
                },
                ..ArmProfile::default()
            },
            chip: ChipSection {
                emulator: Some("/opt/emulator".into()),
                sensor_elf: Some("sensor.elf".into()),
                steering_elf: Some("steering.elf".into()),
                eeprom: Some("/var/eeprom".into()),
                clock: Some("/run/clock".into()),
            },
            station: StationSection {
                wanted: false,
                address: Some("192.168.1.5:7420".into()),
                listen: Some("127.0.0.1:7421".parse().expect("an address")),
                gag: Some("/run/gag".into()),
                warehouse: Some("/srv/hall.toml".into()),
                queue: Some("/srv/queue.toml".into()),
                history: false,
                panel: Some("127.0.0.1:7411".parse().expect("an address")),
            },
            comm: CommSection {
                secret: Some("/etc/lager/secret".into()),
                link_lost: LinkLost::Stand,
            },
            buttons: ButtonsSection {
                chip: Some("/dev/gpiochip4".into()),
                reset: Some(5),
                switch: Some(6),
                switch_kind: SwitchKind::Press,
                reset_closed: Level::High,
                switch_closed: Level::High,
                reset_starts: false,
                debounce_ms: 30,
            },
            gateway: GatewaySection {
                metrics: Some("127.0.0.1:7431".parse().expect("an address")),
                foxglove: Some("127.0.0.1:8766".parse().expect("an address")),
                zenoh: ZenohSection {
                    endpoint: Some("tls/0.0.0.0:7448".parse().expect("an endpoint")),
                    router: Some("tls/192.168.1.9:7449".parse().expect("an endpoint")),
                    topics: vec!["sensor/*".into(), "nav/status".into()],
                    authority: Some("/etc/lager/ca.pem".into()),
                    certificate: Some("/etc/lager/r1.pem".into()),
                    key: Some("/etc/lager/r1.key".into()),
                    rates: [("sensor/line".into(), 10.0)].into(),
                },
            },
            ..Config::default()
        };
        for config in [config, Config::default()] {
            let text = config.documented();
            let read: Config = toml::from_str(&text).expect("valid TOML");
            assert_eq!(read, config, "{text}");
            let plain = toml::to_string(&config).expect("serialisable");
            for line in plain.lines().filter(|line| !line.is_empty()) {
                let there = text.lines().filter(|printed| *printed == line).count();
                let wanted = plain.lines().filter(|other| *other == line).count();
                assert_eq!(there, wanted, "{line}\n{text}");
            }
        }
    }

    #[test]
    fn what_is_unset_stands_there_with_its_explanation() {
        let text = Config::default().documented();
        let head = "# The robot's name: the middle part of every topic's name.\nname = \"r1\"\n";
        assert!(text.starts_with(head), "{text}");
        assert!(
            text.contains("\n# reset = ...\n# Where the pressed reset"),
            "{text}"
        );
        assert!(!text.contains("log = ..."), "{text}");
    }

    #[test]
    fn every_key_is_explained_or_stands_below_one_that_is() {
        for section in SECTIONS {
            for (place, (key, lines)) in section.keys.iter().enumerate() {
                let is_section = SECTIONS
                    .iter()
                    .any(|it| is_within(it.name, section.name, key));
                assert!(
                    is_section || place > 0 || !lines.is_empty(),
                    "[{}] {key}",
                    section.name
                );
            }
        }
    }
}
