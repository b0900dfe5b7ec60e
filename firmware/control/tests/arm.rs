//! Runs the arm's commands against eight scripted servos.

mod support;

use lager_control::SteeringConfig;
use lager_wire::{ArmProfile, SteerFlags};
use support::Bench;
use support::arm::{arm_data, done, refused, with_arm};
use support::servos::Servos;

const CLOCKWISE: u8 = 0xF1;
const COUNTER_CLOCKWISE: u8 = 0xF2;
const IN: u8 = 0xF3;
const OUT: u8 = 0xF4;
const UP: u8 = 0xF5;
const DOWN: u8 = 0xF6;
const LEFT: u8 = 0xF7;
const RIGHT: u8 = 0xF8;
const SQUEEZE: u8 = 0xF9;
const RELEASE: u8 = 0xFA;
const DROP: u8 = 0xFB;
const STANDBY: u8 = 1;
const FORWARD: u8 = 2;

#[test]
fn at_boot_every_servo_holds_where_it_is() {
    let positions = [100, 200, 823, 400, 623, 600, 700, 330];
    let mut bench = Bench::boot(0, SteeringConfig::default(), Servos::at(positions));
    bench.run_ms(60);
    for (index, servo) in bench.pins.servos.servos.iter().enumerate() {
        assert_eq!(servo.goals, [positions[index]], "servo {}", index + 1);
        assert!(servo.torque);
        assert_eq!(servo.torque_limit, 1023);
    }
    assert_eq!(bench.pins.servos.positions(), positions);
    bench.run_ms(2_000);
    for servo in &bench.pins.servos.servos {
        assert_eq!(servo.goals.len(), 1, "and nothing moves afterwards");
    }
    assert_eq!(bench.report().servo_errors, 0);
}

#[test]
fn every_step_moves_its_joint_three_units_its_way() {
    for (code, moved) in [
        (LEFT, [3, 0, 0, 0, 0, 0, 0, 0]),
        (RIGHT, [-3, 0, 0, 0, 0, 0, 0, 0]),
        (UP, [0, 3, -3, 0, 0, 0, 0, 0]),
        (DOWN, [0, -3, 3, 0, 0, 0, 0, 0]),
        (OUT, [0, 0, 0, 3, -3, 0, 0, 0]),
        (IN, [0, 0, 0, -3, 3, 0, 0, 0]),
        (COUNTER_CLOCKWISE, [0, 0, 0, 0, 0, 0, 3, 0]),
        (CLOCKWISE, [0, 0, 0, 0, 0, 0, -3, 0]),
    ] {
        let start = [512, 500, 523, 400, 623, 512, 512, 512];
        let mut bench = Bench::ready_with(SteeringConfig::default(), Servos::at(start));
        done(&mut bench, code, 100);
        done(&mut bench, code, 100);
        let expected: Vec<i32> = start
            .iter()
            .zip(moved)
            .map(|(from, by)| i32::from(*from) + 2 * by)
            .collect();
        let positions: Vec<i32> = bench
            .pins
            .servos
            .positions()
            .into_iter()
            .map(i32::from)
            .collect();
        assert_eq!(positions, expected, "code {code:#04x}");
    }
}

#[test]
fn steps_end_at_the_limits_and_are_refused_there() {
    let mut profile = ArmProfile::default();
    profile.limits.base.highest = 514;
    let mut bench = Bench::ready_with(with_arm(profile), Servos::at([512; 8]));
    done(&mut bench, LEFT, 100);
    assert_eq!(bench.pins.servos.positions()[0], 514, "two of the three");
    for count in 1..=3 {
        refused(&mut bench, LEFT);
        assert_eq!(bench.status().refused, count);
    }
    assert_eq!(bench.pins.servos.positions()[0], 514);
    done(&mut bench, RIGHT, 100);
    assert_eq!(bench.pins.servos.positions()[0], 511, "back is allowed");
    let mut bench = Bench::ready_with(SteeringConfig::default(), Servos::at([1; 8]));
    done(&mut bench, RIGHT, 100);
    refused(&mut bench, RIGHT);
    assert_eq!(bench.pins.servos.positions()[0], 0);
}

#[test]
fn an_arm_outside_its_limits_is_only_stepped_back() {
    let mut profile = ArmProfile::default();
    profile.limits.base.highest = 600;
    let mut bench = Bench::ready_with(with_arm(profile), Servos::at([700; 8]));
    refused(&mut bench, LEFT);
    done(&mut bench, RIGHT, 100);
    assert_eq!(bench.pins.servos.positions()[0], 697, "a step, no leap");
}

#[test]
fn the_servos_touched_are_told_before_the_end() {
    let mut bench = Bench::ready();
    for (code, servos) in [(LEFT, vec![1]), (UP, vec![2, 3]), (OUT, vec![4, 5])] {
        bench.pi.packets.clear();
        done(&mut bench, code, 100);
        let seq = bench.report().finished_seq;
        let (told, _) = *bench
            .reports()
            .iter()
            .find(|(_, data)| data.finished_seq == seq)
            .unwrap();
        for servo in servos {
            let (_, data) = *arm_data(&bench)
                .iter()
                .rfind(|(at, data)| data.servo == servo && told.wrapping_sub(*at) < 5_000)
                .unwrap_or_else(|| panic!("servo {servo} was not told before the end"));
            let position = bench.pins.servos.positions()[usize::from(servo) - 1];
            assert_eq!(data.position, position);
            assert_eq!((data.decivolts, data.celsius, data.errors), (117, 41, 0));
        }
    }
}

#[test]
fn release_opens_softly() {
    let mut servos = Servos::at([512; 8]);
    servos.id(8).position = 300.0;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    let from = bench.pins.now_us;
    done(&mut bench, RELEASE, 3_000);
    assert_eq!(bench.pins.servos.positions()[7], 512);
    let took_ms = bench.pins.now_us.wrapping_sub(from) / 1_000;
    assert!(
        (850..1_100).contains(&took_ms),
        "212 units at 11.1 rpm, not {took_ms} ms"
    );
}

#[test]
fn a_squeeze_ends_at_the_load() {
    let mut servos = Servos::at([512; 8]);
    servos.id(8).stop = 400.0;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    done(&mut bench, SQUEEZE, 3_000);
    let gripper = bench.pins.servos.id(8).clone();
    assert_eq!(gripper.position, 400.0);
    // The load is 40 a unit: the goal passes 300 when it is 8 units inside, in steps of 3.
    assert!(gripper.load <= -300, "{}", gripper.load);
    assert!((389..=392).contains(&gripper.goal), "{}", gripper.goal);
    for pair in gripper.goals.windows(2) {
        assert!(pair[0] - pair[1] <= 3, "step by step");
    }
    let told = arm_data(&bench)
        .into_iter()
        .rfind(|(_, data)| data.servo == 8)
        .unwrap()
        .1;
    assert_eq!((told.position, told.load), (400, gripper.load));
    // The gripper keeps what it holds.
    bench.run_ms(2_000);
    assert_eq!(bench.pins.servos.id(8).goal, gripper.goal);
}

#[test]
fn a_squeeze_ends_when_nothing_moves() {
    let mut servos = Servos::at([512; 8]);
    servos.id(8).stop = 400.0;
    servos.id(8).stiffness = 0;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    done(&mut bench, SQUEEZE, 3_000);
    let goal = bench.pins.servos.id(8).goal;
    assert!((380..400).contains(&goal), "{goal}");
}

#[test]
fn a_squeeze_on_nothing_ends_closed() {
    let mut bench = Bench::ready();
    done(&mut bench, SQUEEZE, 6_000);
    assert_eq!(bench.pins.servos.id(8).goal, 210);
    done(&mut bench, SQUEEZE, 1_000);
    assert_eq!(bench.pins.servos.id(8).goal, 210);
}

#[test]
fn a_gripper_that_closes_the_other_way_is_a_matter_of_numbers() {
    let profile = ArmProfile {
        gripper_open: 500,
        gripper_closed: 560,
        ..ArmProfile::default()
    };
    let mut servos = Servos::at([512; 8]);
    servos.id(8).position = 500.0;
    let mut bench = Bench::ready_with(with_arm(profile), servos);
    done(&mut bench, SQUEEZE, 3_000);
    assert_eq!(bench.pins.servos.id(8).goal, 560);
}

#[test]
fn drop_lowers_opens_and_comes_back_up() {
    let mut servos = Servos::at([550, 600, 423, 400, 623, 512, 512, 399]);
    servos.id(8).stop = 399.0;
    let mut bench = Bench::ready_with(SteeringConfig::default(), servos);
    done(&mut bench, DROP, 12_000);
    let config = ArmProfile::default();
    let shoulder = &bench.pins.servos.id(2).goals;
    assert_eq!(
        shoulder[shoulder.len() - 2..],
        [config.drop.shoulder, config.neutral.shoulder]
    );
    assert_eq!(
        bench.pins.servos.positions(),
        [
            config.neutral.base,
            config.neutral.shoulder,
            1023 - config.neutral.shoulder,
            config.neutral.elbow,
            1023 - config.neutral.elbow,
            config.neutral.wrist,
            512,
            config.gripper_open,
        ]
    );
    assert_eq!(
        bench.pins.servos.id(8).goals.last(),
        Some(&config.gripper_open)
    );
}

#[test]
fn drop_opens_only_when_the_arm_is_down() {
    let mut bench = Bench::ready_with(
        SteeringConfig::default(),
        Servos::at([512, 600, 423, 400, 623, 512, 512, 300]),
    );
    bench.command(DROP);
    for _ in 0..4_000 {
        bench.run_ms(1);
        if bench.pins.servos.id(8).goals.len() > 1 {
            break;
        }
    }
    assert_eq!(bench.pins.servos.id(8).goals.last(), Some(&512));
    let low = ArmProfile::default().drop.shoulder;
    assert!(bench.pins.servos.positions()[1].abs_diff(low) <= 6);
}

#[test]
fn the_wheels_wait_for_the_arm() {
    let mut bench = Bench::ready();
    let seq = bench.command(DROP);
    bench.run_ms(300);
    assert_eq!(bench.duties(), (0, 0));
    bench.command(FORWARD);
    assert_eq!(bench.duties(), (0, 0), "the arm is still moving");
    bench.run_ms(60);
    assert_eq!(bench.duties(), (100, 100), "it has been stopped");
    let report = bench.report();
    assert_eq!(report.finished_seq, seq);
    assert!(report.flags.contains(SteerFlags::ABORTED));
}

#[test]
fn a_standby_freezes_the_arm_where_it_is() {
    let mut bench = Bench::ready_with(
        SteeringConfig::default(),
        Servos::at([512, 600, 423, 400, 623, 512, 512, 400]),
    );
    let seq = bench.command(DROP);
    bench.run_ms(400);
    bench.command(STANDBY);
    bench.run_ms(50);
    assert_eq!(bench.report().finished_seq, seq);
    assert!(bench.report().flags.contains(SteerFlags::ABORTED));
    let positions = bench.pins.servos.positions();
    assert!(positions[1] < 590 && positions[1] > 310, "{positions:?}");
    bench.run_ms(2_000);
    assert_eq!(
        bench.pins.servos.positions(),
        positions,
        "nothing moves any more"
    );
    assert_eq!(
        bench.pins.servos.id(8).goals.len(),
        1,
        "the gripper was not opened"
    );
}

#[test]
fn a_pi_that_falls_silent_stops_the_arm() {
    let mut bench = Bench::ready_with(
        SteeringConfig::default(),
        Servos::at([512, 600, 423, 400, 623, 512, 512, 400]),
    );
    let seq = bench.command(DROP);
    bench.renewed = None;
    bench.run_ms(250);
    let report = bench.report();
    assert_eq!(report.finished_seq, seq);
    assert!(report.flags.contains(SteerFlags::ABORTED));
    assert!(report.flags.contains(SteerFlags::FAILSAFE));
    let positions = bench.pins.servos.positions();
    bench.run_ms(2_000);
    assert_eq!(bench.pins.servos.positions(), positions);
}

#[test]
fn a_newer_arm_command_takes_the_place_of_the_older() {
    let mut bench = Bench::ready();
    let squeeze = bench.command(SQUEEZE);
    bench.run_ms(200);
    let left = bench.command(LEFT);
    bench.run_ms(100);
    let ends: Vec<u8> = {
        let mut ends: Vec<u8> = bench
            .reports()
            .iter()
            .map(|(_, data)| data.finished_seq)
            .collect();
        ends.dedup();
        ends
    };
    assert_eq!(ends[ends.len() - 2..], [squeeze, left]);
    assert_eq!(bench.pins.servos.positions()[0], 515);
    assert!(!bench.report().flags.contains(SteerFlags::ABORTED));
}
