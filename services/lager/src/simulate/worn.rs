//! Whole missions on worn tape and on an empty battery: the robot stands and says what a person has
//! to do, and delivers once it is done.

use std::time::Duration;

use lager_plant::{Floor, Warehouse};
use lager_supervisor::mission::{Helper, Watch};
use lager_topics::{FailureKind, Hold, Remedy};

use super::Whole;
use crate::config::Config;

/// Virtual time in which a mission must be over.
const LIMIT: Duration = Duration::from_secs(600);

/// A floor on which the tape has less than half of its contrast.
const WORN: Floor = Floor {
    white: 45,
    tape: 115,
};

fn robot(floor: Floor, seed: u64) -> Whole {
    let warehouse = Warehouse {
        floor,
        ..Warehouse::builtin("small").expect("built in")
    };
    Whole::new(&Config::default(), &warehouse, &[1], seed, 0).expect("a robot")
}

#[test]
fn worn_tape_asks_for_calibration_and_is_followed_after_it() {
    for seed in 1..=5 {
        let mut blind = robot(WORN, seed);
        let why = blind.run(LIMIT).expect("it sees no tape");
        let failure = blind.navigator.status().failure;
        assert_eq!(failure.kind, FailureKind::LineUnseen, "seed {seed}: {why}");
        assert_eq!(failure.remedy, Remedy::Calibrate);
        let mut whole = robot(WORN, seed);
        assert_eq!(whole.calibrate(), Ok(()), "seed {seed}");
        assert_eq!(whole.run(LIMIT), None, "seed {seed}");
        assert_eq!(whole.robot.world().collisions(), 0, "seed {seed}");
    }
}

#[test]
fn a_battery_that_runs_low_is_charged_at_a_crossing_and_the_mission_goes_on() {
    for seed in 1..=5 {
        let mut whole = robot(Floor::default(), seed);
        whole.watch = Watch::new(whole.watch.mission().clone(), Helper::Person);
        whole.robot.world_mut().set_battery_charge(0.04);
        while whole.navigator.status().hold.get() != Some(Hold::Battery) {
            assert_eq!(whole.turn(), None, "seed {seed}");
            assert!(whole.now < LIMIT, "seed {seed}: it never stands");
        }
        let end = whole.now + Duration::from_secs(30);
        while whole.now < end {
            assert_eq!(whole.turn(), None, "seed {seed}");
        }
        assert_eq!(whole.robot.truth().duties, [0, 0], "seed {seed}");
        whole.robot.world_mut().set_battery_charge(1.0);
        assert_eq!(whole.run(LIMIT), None, "seed {seed}");
    }
}

#[test]
fn a_battery_that_nobody_charges_ends_the_run_and_the_reason_says_so() {
    let mut whole = robot(Floor::default(), 1);
    whole.robot.world_mut().set_battery_charge(0.04);
    let why = whole.run(LIMIT).expect("it stands");
    assert!(why.contains("the battery is low"), "{why}");
    assert!(why.contains("Charge the battery"), "{why}");
    assert_eq!(
        whole.hold().and_then(|hold| hold.get()),
        Some(Hold::Battery)
    );
    assert_eq!(whole.failure_kind(), None, "it would go on by itself");
    assert!(whole.now < LIMIT);
}
