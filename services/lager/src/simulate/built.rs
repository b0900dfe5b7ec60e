//! Robots that are built otherwise than the one of the simulator's world: before their description
//! they stand or say why they fail, and after it they deliver.

use std::time::Duration;

use lager_plant::{Build, Ranger, Warehouse};
use lager_simulator::RobotOptions;
use lager_topics::{Health, ProfileState, Refusal};
use lager_wire::{IrModel, LineProfile, RangerProfile, WheelsProfile};

use super::Whole;
use crate::config::{BatterySection, Config};

/// Virtual time in which a mission must be over.
pub(super) const LIMIT: Duration = Duration::from_secs(600);

/// What a person who knows the robot writes into its description.
fn described(build: &Build) -> Config {
    let mut config = Config {
        wheels: WheelsProfile {
            swapped: build.swapped,
            left_reversed: build.reversed[0],
            right_reversed: build.reversed[1],
            full_turn_ms: (build.full_turn() * 1_000.0) as u16,
            ..WheelsProfile::default()
        },
        line: LineProfile {
            dark_is_high: !build.dark_is_low,
        },
        distance: RangerProfile {
            model: match build.ranger {
                Ranger::Gp2y0a21 => IrModel::Gp2y0a21,
                Ranger::Gp2y0a41 => IrModel::Gp2y0a41,
                Ranger::Gp2y0a02 => IrModel::Gp2y0a02,
            },
            ..RangerProfile::default()
        },
        battery: BatterySection {
            divider: Some(build.divider),
        },
        ..Config::default()
    };
    config.logic.cruise_mm_per_s *= build.gear as f32;
    config
}

pub(super) fn robot(config: &Config, build: Build, seed: u64) -> Whole {
    let warehouse = Warehouse::builtin("small").expect("built in");
    let options = RobotOptions {
        seed,
        build,
        ..RobotOptions::default()
    };
    Whole::of(config, &warehouse, &[1], options).expect("a robot")
}

pub(super) fn seeds() -> std::ops::RangeInclusive<u64> {
    let seeds = std::env::var("LAGER_SEEDS").map_or(20, |seeds| seeds.parse().expect("a number"));
    1..=seeds
}

#[test]
fn a_robot_that_its_boards_know_delivers_however_it_is_built() {
    for seed in seeds() {
        let build = Build::drawn(seed);
        let mut whole = robot(&described(&build), build, seed);
        assert_eq!(whole.run(LIMIT), None, "seed {seed}: {build:?}");
        assert_eq!(whole.robot.world().collisions(), 0, "seed {seed}");
    }
}

#[test]
fn a_robot_whose_motors_or_line_sensors_nobody_described_fails_and_says_so() {
    let builds = [
        Build {
            swapped: true,
            ..Build::default()
        },
        Build {
            reversed: [true, false],
            ..Build::default()
        },
        Build {
            reversed: [false, true],
            ..Build::default()
        },
        Build {
            reversed: [true, true],
            ..Build::default()
        },
        Build {
            dark_is_low: true,
            ..Build::default()
        },
    ];
    for build in builds {
        let mut whole = robot(&Config::default(), build, 1);
        let why = whole.run(LIMIT).expect("it cannot deliver");
        println!("{build:?}: {why}");
        assert!(whole.failure_kind().is_some(), "{build:?}: {why}");
        let mut whole = robot(&described(&build), build, 1);
        assert_eq!(whole.run(LIMIT), None, "{build:?}");
    }
}

fn health(whole: &Whole) -> Health {
    whole.seen.health.expect("published ten times a second")
}

#[test]
fn a_floating_input_for_the_battery_changes_nothing() {
    let build = Build {
        divider: false,
        ..Build::default()
    };
    let mut whole = robot(&described(&build), build, 1);
    assert_eq!(whole.run(LIMIT), None);
    assert_eq!(whole.robot.world().collisions(), 0);
}

#[test]
fn the_boards_have_taken_the_description_before_the_wheels_turn() {
    let build = Build {
        swapped: true,
        reversed: [true, true],
        ..Build::default()
    };
    let mut whole = robot(&described(&build), build, 3);
    while whole.robot.truth().duties == [0, 0] {
        assert_eq!(whole.turn(), None);
        assert!(whole.now < LIMIT, "it never drives");
    }
    let health = health(&whole);
    assert_eq!(health.steering_profile, ProfileState::Accepted);
    assert_eq!(health.sensor_profile, ProfileState::Accepted);
    assert_eq!(health.blocked, Refusal::None);
}
