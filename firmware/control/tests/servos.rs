//! The board learns which servos move the joints and which way they count.

mod support;

use lager_control::SteeringConfig;
use lager_wire::{
    ArmData, ArmProfile, JointServos, OneOrTwo, Payload, Profile, ReversedJoints, SettingReply,
    SettingStatus, SteerFlags,
};
use support::Bench;
use support::arm::{arm_data, done, with_arm};
use support::servos::Servos;

const UP: u8 = 0xF5;
const LEFT: u8 = 0xF7;
const SQUEEZE: u8 = 0xF9;
const RELEASE: u8 = 0xFA;
const DROP: u8 = 0xFB;

/// Ids that nothing else has, and whose order is not that of the joints.
const IDS: [u8; 8] = [17, 253, 0, 30, 29, 31, 40, 16];

/// An arm with these ids, in which some joints count the other way.
fn other() -> ArmProfile {
    ArmProfile {
        servos: JointServos {
            base: IDS[0],
            shoulder: OneOrTwo::Two([IDS[1], IDS[2]]),
            elbow: OneOrTwo::Two([IDS[3], IDS[4]]),
            wrist: IDS[5],
            rotation: IDS[6],
            gripper: IDS[7],
        },
        reversed: ReversedJoints {
            base: true,
            elbow: true,
            gripper: true,
            ..ReversedJoints::default()
        },
        ..ArmProfile::default()
    }
}

/// The same servos on the wire.
fn wired(positions: [u16; 8]) -> Servos {
    let mut servos = Servos::at(positions);
    servos.ids = IDS;
    servos
}

fn tell(bench: &mut Bench, profile: &ArmProfile) -> SettingReply {
    for (setting, seq) in profile.settings().zip(1..) {
        bench.set(setting.key, seq, setting.value);
        bench.run_ms(20);
    }
    let replies = bench.pi.all(|payload| match payload {
        Payload::SettingReply(reply) => Some(reply),
        _ => None,
    });
    let (_, last) = replies.last().expect("an answer");
    *last
}

/// The last report of the servo with this number.
fn told(bench: &Bench, number: u8) -> Option<ArmData> {
    let reports = arm_data(bench);
    let last = reports.iter().rfind(|(_, data)| data.servo == number);
    last.map(|(_, data)| *data)
}

#[test]
fn ids_and_directions_are_told_and_every_servo_holds_where_it_is() {
    let positions = [500, 520, 503, 480, 543, 512, 530, 700];
    let mut bench = Bench::ready_with(SteeringConfig::default(), wired(positions));
    bench.run_ms(100);
    assert_eq!(bench.report().servo_errors, 0xFF, "no id of 1 to 8 answers");
    let reply = tell(&mut bench, &other());
    assert_eq!(reply.status, SettingStatus::Accepted);
    bench.run_ms(200);
    assert_eq!(bench.report().servo_errors, 0);
    for (servo, position) in bench.pins.servos.servos.iter().zip(positions) {
        assert!(servo.torque);
        assert_eq!(servo.goals, [position]);
    }
    // The base counts the other way, its partnerless report too.
    assert_eq!(told(&bench, 1).expect("a report").position, 1_023 - 500);
    assert_eq!(told(&bench, 2).expect("a report").position, 520);
    assert_eq!(told(&bench, 4).expect("a report").position, 1_023 - 480);
}

#[test]
fn a_reversed_joint_moves_the_way_it_is_told() {
    let mut bench = Bench::ready_with(with_arm(other()), wired([512; 8]));
    done(&mut bench, LEFT, 200);
    let base = bench.pins.servos.positions()[0];
    assert_eq!(base, 509, "to the left is down on this servo");
    assert_eq!(told(&bench, 1).expect("a report").position, 514);
    done(&mut bench, UP, 200);
    assert_eq!(bench.pins.servos.positions()[1..3], [515, 508]);
    done(&mut bench, DROP, 12_000);
    let goals = |bench: &mut Bench, id| {
        let goals = bench.pins.servos.id(id).goals.clone();
        goals[goals.len() - 2..].to_vec()
    };
    // The elbow of the drop pose and of the neutral pose, turned round; its partner faces it.
    assert_eq!(goals(&mut bench, 30), [1_023 - 512, 1_023 - 400]);
    assert_eq!(goals(&mut bench, 29), [512, 400]);
    assert_eq!(goals(&mut bench, 253), [300, 600]);
}

#[test]
fn a_reversed_gripper_feels_what_it_holds() {
    let mut bench = Bench::ready_with(with_arm(other()), wired([512; 8]));
    done(&mut bench, RELEASE, 3_000);
    assert_eq!(bench.pins.servos.id(16).position.round(), 511.0);
    done(&mut bench, SQUEEZE, 8_000);
    let gripper = bench.pins.servos.id(16).clone();
    assert_eq!(gripper.goal, 1_023 - 210, "closed on nothing");
    bench.pins.servos.id(16).load = 400;
    bench.run_ms(1_000);
    let load = told(&bench, 8).expect("a report").load;
    assert!(load <= 0, "{load}: it presses towards closed");
}

#[test]
fn a_joint_with_one_servo_has_no_second_one() {
    let mut profile = ArmProfile::default();
    profile.servos.shoulder = OneOrTwo::One(2);
    profile.servos.elbow = OneOrTwo::One(4);
    let mut servos = Servos::at([512; 8]);
    servos.id(3).present = false;
    servos.id(5).present = false;
    let mut bench = Bench::ready_with(with_arm(profile), servos);
    bench.run_ms(2_000);
    assert_eq!(bench.report().servo_errors, 0);
    assert_eq!((told(&bench, 3), told(&bench, 5)), (None, None));
    done(&mut bench, UP, 200);
    assert_eq!(bench.pins.servos.id(2).goal, 515);
    done(&mut bench, DROP, 12_000);
    for id in [3, 5] {
        assert_eq!(bench.pins.servos.id(id).goals, [0_u16; 0]);
    }
    // Every other servo is asked in its turn.
    for id in [1, 2, 4, 6, 7, 8] {
        assert!(bench.pins.servos.id(id).looks > 2, "servo {id}");
    }
}

#[test]
fn a_command_for_other_servos_is_broken_off() {
    let mut bench = Bench::ready();
    let seq = bench.command(DROP);
    bench.run_ms(400);
    let mut profile = ArmProfile::default();
    profile.reversed.wrist = true;
    let moving = bench.pins.servos.positions();
    tell(&mut bench, &profile);
    bench.run_ms(100);
    let report = bench.report();
    assert_eq!(report.finished_seq, seq);
    assert!(report.flags.contains(SteerFlags::ABORTED));
    let at = bench.pins.servos.positions();
    assert_ne!(at, moving, "it moved while the values came");
    bench.run_ms(1_000);
    assert_eq!(bench.pins.servos.positions(), at, "and holds");
    assert_eq!(bench.report().servo_errors, 0);
    done(&mut bench, LEFT, 200);
}

#[test]
fn ids_that_no_arm_has_are_refused_and_the_old_ones_stay() {
    for id in [2, 254] {
        let mut bench = Bench::ready();
        let mut profile = ArmProfile::default();
        profile.servos.base = id;
        let reply = tell(&mut bench, &profile);
        assert_eq!(reply.status, SettingStatus::OutOfRange);
        done(&mut bench, LEFT, 200);
        assert_eq!(bench.pins.servos.positions()[0], 515);
    }
}
