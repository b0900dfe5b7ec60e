//! The arm's profile arrives value by value, and the board obeys it as a whole.

mod support;

use lager_control::SteeringConfig;
use lager_wire::{
    ArmLimits, ArmPose, ArmProfile, LIMP, Payload, Profile, Setting, SettingKey, SettingReply,
    SettingStatus,
};
use support::Bench;
use support::arm::{aborted, arm_data, done, refused};
use support::servos::Servos;

const LEFT: u8 = 0xF7;
const RIGHT: u8 = 0xF8;
const SQUEEZE: u8 = 0xF9;
const RELEASE: u8 = 0xFA;
const DROP: u8 = 0xFB;

/// A profile that differs from the default in every value.
fn other() -> ArmProfile {
    let pose = |base| ArmPose {
        base,
        shoulder: 450,
        elbow: 460,
        wrist: 470,
    };
    let mut profile = ArmProfile {
        torque_limit: 600,
        squeeze_load: 120,
        gripper_open: 480,
        gripper_closed: 220,
        neutral: pose(530),
        drop: pose(500),
        carry: pose(530),
        ..ArmProfile::default()
    };
    profile.limits.base = ArmLimits {
        lowest: 490,
        highest: 540,
    };
    profile
}

/// Sends a setting and returns the board's answer.
fn set(bench: &mut Bench, key: SettingKey, seq: u8, value: i16) -> (i16, SettingStatus) {
    bench.pi.packets.clear();
    bench.send(Payload::Setting(Setting { key, seq, value }));
    bench.run_ms(20);
    let replies: Vec<SettingReply> = bench
        .pi
        .all(|payload| match payload {
            Payload::SettingReply(reply) => Some(reply),
            _ => None,
        })
        .into_iter()
        .map(|(_, reply)| reply)
        .collect();
    let [reply] = replies[..] else {
        panic!("one answer, not {replies:?}");
    };
    assert_eq!((reply.key, reply.seq), (key, seq));
    (reply.value, reply.status)
}

fn tell_values(bench: &mut Bench, profile: &ArmProfile) {
    for (index, value) in profile.values().into_iter().enumerate() {
        let key = ArmProfile::key(index).expect("a key");
        let value = value.cast_signed();
        let answer = set(bench, key, index as u8, value);
        assert_eq!(answer, (value, SettingStatus::Accepted));
    }
}

fn put_in_force(bench: &mut Bench, profile: &ArmProfile) -> (i16, SettingStatus) {
    let check = ArmProfile::check(&profile.values());
    set(bench, SettingKey::ArmProfile, 77, check)
}

fn check(profile: &ArmProfile) -> i16 {
    ArmProfile::check(&profile.values())
}

#[test]
fn a_profile_that_was_told_is_obeyed() {
    let profile = other();
    let mut bench = Bench::ready();
    tell_values(&mut bench, &profile);
    for servo in &bench.pins.servos.servos {
        assert_eq!(servo.torque_limit, 1_023, "not yet in force");
    }
    let answer = put_in_force(&mut bench, &profile);
    assert_eq!(answer, (check(&profile), SettingStatus::Accepted));
    bench.run_ms(60);
    for servo in &bench.pins.servos.servos {
        assert_eq!((servo.torque_limit, servo.torque), (600, true));
    }
    assert_eq!(bench.pins.servos.positions(), [512; 8], "nothing moved");

    for _ in 0..10 {
        done(&mut bench, LEFT, 100);
        if bench.pins.servos.positions()[0] == 540 {
            break;
        }
    }
    refused(&mut bench, LEFT);
    assert_eq!(bench.pins.servos.positions()[0], 540);
    done(&mut bench, RELEASE, 3_000);
    assert_eq!(bench.pins.servos.positions()[7], 480);
    done(&mut bench, DROP, 12_000);
    let base = &bench.pins.servos.id(1).goals;
    assert_eq!(base[base.len() - 2..], [500, 530]);
    assert_eq!(bench.pins.servos.positions()[1], 450);
    bench.pins.servos.id(8).stop = 400.0;
    done(&mut bench, SQUEEZE, 3_000);
    let gripper = bench.pins.servos.id(8).clone();
    assert!((-299..=-120).contains(&gripper.load), "{}", gripper.load);
}

#[test]
fn a_profile_that_did_not_come_whole_is_refused_and_nothing_of_it_obeyed() {
    let mut bench = Bench::ready();
    let before = check(&ArmProfile::default());
    let profile = other();
    for (index, value) in profile.values().into_iter().enumerate().skip(1) {
        let key = ArmProfile::key(index).expect("a key");
        set(&mut bench, key, index as u8, value.cast_signed());
    }
    let answer = put_in_force(&mut bench, &profile);
    assert_eq!(answer, (before, SettingStatus::OutOfRange));
    for _ in 0..12 {
        done(&mut bench, LEFT, 100);
    }
    assert_eq!(bench.pins.servos.positions()[0], 548, "the old limits hold");
    let torque = profile.torque_limit.cast_signed();
    set(&mut bench, SettingKey::ArmTorqueLimit, 9, torque);
    let answer = put_in_force(&mut bench, &profile);
    assert_eq!(answer, (check(&profile), SettingStatus::Accepted));
    refused(&mut bench, LEFT);
}

#[test]
fn a_profile_no_arm_can_obey_is_refused_by_the_board_too() {
    let mut bench = Bench::ready();
    let mut profile = other();
    profile.drop.base = 700;
    tell_values(&mut bench, &profile);
    let answer = put_in_force(&mut bench, &profile);
    let before = check(&ArmProfile::default());
    assert_eq!(answer, (before, SettingStatus::OutOfRange));
    let answer = set(&mut bench, SettingKey::ArmDropBase, 1, -5);
    assert_eq!(answer, (700, SettingStatus::OutOfRange), "no position");
}

#[test]
fn a_new_torque_limit_waits_for_nothing_and_an_order_waits_for_it() {
    let mut bench = Bench::ready();
    let profile = ArmProfile {
        torque_limit: 500,
        ..ArmProfile::default()
    };
    tell_values(&mut bench, &profile);
    put_in_force(&mut bench, &profile);
    done(&mut bench, RIGHT, 200);
    assert_eq!(bench.pins.servos.positions()[0], 509);
    for servo in &bench.pins.servos.servos {
        assert_eq!(servo.torque_limit, 500);
    }
}

#[test]
fn a_limp_arm_has_no_torque_tells_where_it_is_and_holds_there_afterwards() {
    let mut bench = Bench::ready();
    let limp = ArmProfile {
        torque_limit: LIMP,
        ..ArmProfile::default()
    };
    tell_values(&mut bench, &limp);
    let answer = put_in_force(&mut bench, &limp);
    assert_eq!(answer, (check(&limp), SettingStatus::Accepted));
    bench.run_ms(60);
    assert!(!bench.pins.servos.servos.iter().any(|servo| servo.torque));
    let goals = |bench: &Bench| -> usize {
        let servos = &bench.pins.servos.servos;
        servos.iter().map(|servo| servo.goals.len()).sum()
    };
    let before = goals(&bench);
    // A person moves a joint, and the board says where it is.
    bench.pins.servos.id(1).position = 700.0;
    bench.pi.packets.clear();
    bench.run_ms(2_000);
    let told = arm_data(&bench);
    assert!(
        told.iter()
            .any(|(_, data)| (data.servo, data.position) == (1, 700)),
        "{told:?}"
    );
    for code in [LEFT, SQUEEZE, RELEASE, DROP] {
        aborted(&mut bench, code, 50);
    }
    // A servo that was away for a moment comes back without torque.
    bench.pins.servos.id(6).present = false;
    bench.run_ms(1_000);
    bench.pins.servos.id(6).present = true;
    bench.run_ms(1_000);
    assert!(!bench.pins.servos.servos.iter().any(|servo| servo.torque));
    assert_eq!(goals(&bench), before, "no goal was written");

    let strong = ArmProfile::default();
    tell_values(&mut bench, &strong);
    put_in_force(&mut bench, &strong);
    bench.run_ms(100);
    assert!(bench.pins.servos.servos.iter().all(|servo| servo.torque));
    assert_eq!(bench.pins.servos.positions()[0], 700, "it stays there");
    done(&mut bench, LEFT, 100);
    assert_eq!(bench.pins.servos.positions()[0], 703);
}

#[test]
fn a_movement_ends_when_the_arm_gets_limp() {
    let mut bench = Bench::ready();
    let limp = ArmProfile {
        torque_limit: LIMP,
        ..ArmProfile::default()
    };
    tell_values(&mut bench, &limp);
    let seq = bench.command(DROP);
    bench.run_ms(200);
    put_in_force(&mut bench, &limp);
    bench.run_ms(100);
    let report = bench.report();
    assert_eq!(report.finished_seq, seq);
    assert!(report.flags.contains(lager_wire::SteerFlags::ABORTED));
    let before = bench.pins.servos.positions();
    bench.run_ms(1_000);
    assert_eq!(bench.pins.servos.positions(), before);
}

#[test]
fn a_board_that_was_told_nothing_obeys_the_default() {
    let mut servos = Servos::at([512; 8]);
    servos.id(1).position = 1_020.0;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    done(&mut bench, LEFT, 100);
    refused(&mut bench, LEFT);
    assert_eq!(bench.pins.servos.positions()[0], 1_023);
}
