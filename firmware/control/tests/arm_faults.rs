//! The arm with missing, mute, overloaded or stuck servos: its commands end, the board flags the
//! servo, and the other servos work.

mod support;

use lager_ax12::ErrorBits;
use lager_control::SteeringConfig;
use lager_wire::{Payload, SteerFlags};
use support::Bench;
use support::arm::{aborted, arm_data, done, finish};
use support::servos::Servos;

const CLOCKWISE: u8 = 0xF1;
const IN: u8 = 0xF3;
const UP: u8 = 0xF5;
const LEFT: u8 = 0xF7;
const SQUEEZE: u8 = 0xF9;
const RELEASE: u8 = 0xFA;
const DROP: u8 = 0xFB;

#[test]
fn a_missing_servo_is_flagged_and_the_others_work() {
    for missing in 1..=8_usize {
        let mut servos = Servos::at([512; 8]);
        servos.id(missing as u8).present = false;
        let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
        assert_eq!(
            bench.report().servo_errors,
            1 << (missing - 1),
            "servo {missing}"
        );
        for (code, joint) in [
            (LEFT, vec![1]),
            (UP, vec![2, 3]),
            (IN, vec![4, 5]),
            (CLOCKWISE, vec![7]),
        ] {
            let flags = finish(&mut bench, code, 100);
            let needs_it = joint.contains(&missing);
            assert_eq!(
                flags.contains(SteerFlags::ABORTED),
                needs_it,
                "{code:#04x} without {missing}"
            );
            for servo in joint {
                let moved = bench.pins.servos.positions()[servo - 1] != 512;
                assert_eq!(moved, servo != missing, "servo {servo} without {missing}");
            }
        }
        bench.run_ms(1_000);
        assert!(
            arm_data(&bench)
                .iter()
                .all(|(_, data)| usize::from(data.servo) != missing)
        );
    }
}

#[test]
fn a_drop_without_one_servo_still_opens_the_gripper_and_says_aborted() {
    let mut servos = Servos::at([512; 8]);
    servos.id(4).present = false;
    servos.id(8).position = 400.0;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    aborted(&mut bench, DROP, 12_000);
    assert_eq!(bench.pins.servos.positions()[7], 512);
}

#[test]
fn no_servo_at_all_is_bounded_too() {
    let mut servos = Servos::at([512; 8]);
    for id in 1..=8 {
        servos.id(id).present = false;
    }
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    assert_eq!(bench.report().servo_errors, 0xFF);
    for code in [LEFT, SQUEEZE, RELEASE, DROP] {
        aborted(&mut bench, code, 50);
    }
    bench.run_ms(1_000);
    let status = bench.pi.all(|payload| match payload {
        Payload::BoardStatus(status) => Some(status),
        _ => None,
    });
    assert!(status.last().unwrap().1.servo_timeouts > 8);
}

#[test]
fn a_servo_that_comes_back_is_taken_into_service_where_it_is() {
    let mut bench = Bench::ready();
    bench.pins.servos.id(6).present = false;
    bench.run_ms(1_000);
    assert_eq!(bench.report().servo_errors, 1 << 5);
    let servo = bench.pins.servos.id(6);
    servo.present = true;
    servo.torque = false;
    servo.position = 300.0;
    bench.run_ms(1_000);
    assert_eq!(bench.report().servo_errors, 0);
    let servo = bench.pins.servos.id(6);
    assert!(servo.torque);
    assert_eq!((servo.goal, servo.position), (300, 300.0));
}

#[test]
fn a_servo_that_was_away_for_a_moment_keeps_its_goal() {
    let mut servos = Servos::at([512; 8]);
    servos.id(8).stop = 400.0;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    done(&mut bench, SQUEEZE, 3_000);
    let goal = bench.pins.servos.id(8).goal;
    bench.pins.servos.id(8).present = false;
    bench.run_ms(1_000);
    bench.pins.servos.id(8).present = true;
    bench.run_ms(1_000);
    assert_eq!(bench.report().servo_errors, 0);
    assert_eq!(
        bench.pins.servos.id(8).goal,
        goal,
        "the grip is not loosened"
    );
}

#[test]
fn one_bad_checksum_costs_a_repetition_and_nothing_else() {
    let mut bench = Bench::ready();
    bench.pins.servos.id(1).spoiled = 1;
    done(&mut bench, LEFT, 100);
    assert_eq!(bench.pins.servos.positions()[0], 515);
    assert_eq!(bench.report().servo_errors, 0);
}

#[test]
fn an_answer_of_another_servo_is_no_answer() {
    let mut bench = Bench::ready();
    bench.pins.servos.id(1).misnamed = 1;
    done(&mut bench, LEFT, 100);
    assert_eq!(bench.report().servo_errors, 0);
    bench.pins.servos.id(1).misnamed = usize::MAX;
    aborted(&mut bench, LEFT, 100);
    assert_eq!(bench.report().servo_errors, 1 << 0);
}

#[test]
fn bad_checksums_without_end_are_a_missing_servo() {
    let mut bench = Bench::ready();
    bench.pins.servos.id(3).spoiled = usize::MAX;
    aborted(&mut bench, UP, 100);
    assert_eq!(bench.report().servo_errors, 1 << 2);
    done(&mut bench, LEFT, 100);
    bench.pins.servos.id(3).spoiled = 0;
    bench.run_ms(1_000);
    assert_eq!(bench.report().servo_errors, 0);
}

#[test]
fn an_overloaded_servo_ends_the_movement_and_is_flagged() {
    let mut servos = Servos::at([512; 8]);
    servos.id(8).position = 300.0;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    bench.command(RELEASE);
    bench.run_ms(200);
    bench.pins.servos.id(8).errors = ErrorBits::OVERLOAD;
    bench.run_ms(50);
    let report = bench.report();
    assert!(report.flags.contains(SteerFlags::ABORTED));
    assert_eq!(report.servo_errors, 1 << 7);
    let told = arm_data(&bench)
        .into_iter()
        .rfind(|(_, data)| data.servo == 8)
        .unwrap()
        .1;
    assert_eq!(told.errors, ErrorBits::OVERLOAD.bits());
    done(&mut bench, LEFT, 100);
    // Once the servo reports no error, the next command gives it its torque back and moves it.
    bench.pins.servos.id(8).errors = ErrorBits::NONE;
    bench.pins.servos.id(8).torque_limit = 0;
    done(&mut bench, RELEASE, 3_000);
    assert_eq!(bench.pins.servos.id(8).torque_limit, 1023);
    assert_eq!(bench.report().servo_errors, 0);
}

#[test]
fn a_servo_overloaded_in_a_squeeze_ends_it() {
    let mut bench = Bench::ready();
    bench.command(SQUEEZE);
    bench.run_ms(200);
    bench.pins.servos.id(8).errors = ErrorBits::OVERLOAD;
    bench.run_ms(60);
    assert!(bench.report().flags.contains(SteerFlags::ABORTED));
    assert!(!bench.report().flags.contains(SteerFlags::BUSY));
}

#[test]
fn a_stuck_servo_is_flagged_within_bounded_time() {
    let mut servos = Servos::at([512; 8]);
    servos.id(8).position = 300.0;
    servos.id(8).stuck = true;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    aborted(&mut bench, RELEASE, 5_000);
    assert_eq!(bench.report().servo_errors, 1 << 7);
    done(&mut bench, UP, 100);
    bench.pins.servos.id(8).stuck = false;
    done(&mut bench, RELEASE, 5_000);
    assert_eq!(bench.report().servo_errors, 0);
}

#[test]
fn a_wire_that_takes_nothing_is_bounded() {
    let mut bench = Bench::ready();
    bench.pins.servos.full = true;
    aborted(&mut bench, LEFT, 100);
    bench.pins.servos.full = false;
    bench.run_ms(1_000);
    done(&mut bench, LEFT, 100);
}

#[test]
fn stepping_does_not_sag_under_a_load() {
    // A servo hangs 5 units below its goal. The step starts from the goal, not from where it hangs.
    let mut bench = Bench::ready();
    bench.pins.servos.id(2).stuck = true;
    bench.pins.servos.id(2).position = 507.0;
    done(&mut bench, UP, 300);
    assert_eq!(bench.pins.servos.id(2).goal, 515);
    assert_eq!(bench.pins.servos.id(3).goal, 1023 - 515);
}
