//! Robots that are built otherwise than the one of the simulator's world: before their description
//! they stand or say why they fail, and after it they deliver.

use std::time::Duration;

use lager_plant::{ArmBuild, Build, Ranger, Warehouse};
use lager_simulator::RobotOptions;
use lager_topics::{FailureKind, Health, ProfileState, Refusal};
use lager_wire::{
    ArmLimits, ArmPose, ArmProfile, IrModel, JointLimits, JointServos, LineProfile, OneOrTwo,
    RangerProfile, ReversedJoints, SERVO_MAX, WheelsProfile,
};

use super::Whole;
use crate::config::{BatterySection, Config};

/// Virtual time in which a mission must be over.
pub(super) const LIMIT: Duration = Duration::from_secs(600);
/// No horn of a simulated arm sits farther beside its place, in units of position.
const LEAST: u16 = 60;

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
        arm: described_arm(&build.arm),
        ..Config::default()
    };
    config.logic.cruise_mm_per_s *= build.gear as f32;
    for (reach, index) in [
        (&mut config.logic.reach_shoulder, 1),
        (&mut config.logic.reach_elbow, 3),
    ] {
        *reach = reach.strict_add_signed(build.arm.offsets[index]);
    }
    config
}

/// What a person who knows the servos and how their horns sit writes.
fn described_arm(arm: &ArmBuild) -> ArmProfile {
    let id = |index: usize| arm.ids[index].expect("every joint has a first servo");
    let joint = |first: usize| match arm.ids[first + 1] {
        Some(second) => OneOrTwo::Two([id(first), second]),
        None => OneOrTwo::One(id(first)),
    };
    let [base, shoulder, _, elbow, _, wrist, rotation, gripper] = arm.reversed;
    // The arm as drawn, and where its joints are counted otherwise.
    let drawn = ArmProfile::default();
    let counted = |index: usize, position: u16| position.strict_add_signed(arm.offsets[index]);
    let limits = |index: usize| ArmLimits {
        lowest: counted(index, arm.ends[index][0].max(LEAST)),
        highest: counted(index, arm.ends[index][1].min(SERVO_MAX - LEAST)),
    };
    let pose = |pose: ArmPose| ArmPose {
        base: counted(0, pose.base),
        shoulder: counted(1, pose.shoulder),
        elbow: counted(3, pose.elbow),
        wrist: counted(5, pose.wrist),
    };
    ArmProfile {
        servos: JointServos {
            base: id(0),
            shoulder: joint(1),
            elbow: joint(3),
            wrist: id(5),
            rotation: id(6),
            gripper: id(7),
        },
        reversed: ReversedJoints {
            base,
            shoulder,
            elbow,
            wrist,
            rotation,
            gripper,
        },
        limits: JointLimits {
            base: limits(0),
            shoulder: limits(1),
            elbow: limits(3),
            wrist: limits(5),
            rotation: limits(6),
            gripper: limits(7),
        },
        gripper_open: counted(7, drawn.gripper_open),
        gripper_closed: counted(7, drawn.gripper_closed),
        neutral: pose(drawn.neutral),
        drop: pose(drawn.drop),
        carry: pose(drawn.carry),
        ..drawn
    }
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

/// Builds of the arm alone, and what such a robot says when nobody has described it.
fn arms() -> [(ArmBuild, Option<FailureKind>); 5] {
    let reversed = |joints: &[usize]| {
        let mut arm = ArmBuild::default();
        for joint in joints {
            arm.reversed[*joint] = true;
        }
        arm
    };
    let mut others = ArmBuild::default();
    others.ids = others.ids.map(|id| id.map(|id| id + 10));
    let mut single = ArmBuild::default();
    single.ids[2] = None;
    [
        (others, Some(FailureKind::ServoSilent)),
        (single, Some(FailureKind::ServoSilent)),
        // Whoever reaches straight ahead does not turn the base.
        (reversed(&[1, 2]), None),
        (reversed(&[3, 4]), None),
        (reversed(&[7]), None),
    ]
}

#[test]
fn a_robot_whose_arm_nobody_described_fails_and_says_so() {
    for (arm, kind) in arms() {
        let build = Build {
            arm,
            ..Build::default()
        };
        let mut whole = robot(&Config::default(), build, 1);
        let why = whole.run(LIMIT).expect("it cannot deliver");
        println!("{arm:?}: {why}");
        let told = whole.failure_kind().and_then(|told| told.get());
        assert!(told.is_some(), "{arm:?}: {why}");
        assert!(kind.is_none() || told == kind, "{arm:?}: {why}");
        let mut whole = robot(&described(&build), build, 1);
        assert_eq!(whole.run(LIMIT), None, "{arm:?}");
        assert_eq!(whole.robot.world().collisions(), 0, "{arm:?}");
    }
}

#[test]
fn an_arm_of_which_servos_do_not_answer_stands_and_the_reason_names_one() {
    let mut arm = ArmBuild::default();
    (arm.ids[0], arm.ids[5]) = (Some(21), Some(22));
    let build = Build {
        arm,
        ..Build::default()
    };
    let mut whole = robot(&Config::default(), build, 1);
    // Without torque an arm sinks until its board has started.
    while whole.robot.truth().duties == [0, 0] {
        assert_eq!(whole.turn(), None);
        assert!(whole.now < LIMIT, "it never drives");
    }
    let before = whole.robot.truth().world.servo_positions;
    let why = whole.run(LIMIT).expect("it cannot deliver");
    assert!(why.contains("servo 1 of the arm does not answer"), "{why}");
    assert!(why.contains("silent: 2"), "{why}");
    let after = whole.robot.truth().world.servo_positions;
    assert_eq!(after, before);
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
