//! The steering board: commands, the wheels, the fail-safe.

mod support;

use lager_control::{Motor, SteeringConfig};
use lager_wire::{Command, Payload, ResetOrder, SteerCommand, SteerFlags};
use support::Bench;
use support::servos::Servos;

const STANDBY: u8 = 1;
const FORWARD: u8 = 2;
const FOLLOW: u8 = 3;
const BACKWARD: u8 = 4;
const FOLLOW_BACK: u8 = 5;
const LEFT: u8 = 6;
const LEFT_PERP: u8 = 7;
const LEFT_DIAG: u8 = 8;
const RIGHT: u8 = 9;
const RIGHT_PERP: u8 = 10;
const RIGHT_DIAG: u8 = 11;
const ARM_UP: u8 = 0xF5;

const MIDDLE: u16 = 0b000_0111_0000;
const OFF: (Motor, Motor) = (Motor::OFF, Motor::OFF);
const TURNING_LEFT: (Motor, Motor) = (Motor::backward(100), Motor::forward(100));
const TURNING_RIGHT: (Motor, Motor) = (Motor::forward(100), Motor::backward(100));

fn flag(bench: &Bench, flag: SteerFlags) -> bool {
    bench.report().flags.contains(flag)
}

/// How long the wheels turned in the last command, in ms, from the times of the motors' changes.
fn turned_ms(bench: &Bench, motors: (Motor, Motor)) -> Vec<u32> {
    let log = &bench.pins.motor_log;
    log.iter()
        .zip(log.iter().skip(1))
        .filter(|(from, _)| from.1 == motors)
        .map(|(from, to)| to.0.wrapping_sub(from.0) / 1_000)
        .collect()
}

#[test]
fn the_motors_are_off_from_boot_to_the_first_valid_command() {
    let mut bench = Bench::boot(0, SteeringConfig::default(), Servos::at([512; 8]));
    bench.step();
    assert_eq!(bench.pins.motor_log, [(0, OFF)], "the first thing it does");
    bench.line = Some(MIDDLE);
    bench.run_ms(500);
    assert_eq!(bench.pins.motors, OFF);
    assert_eq!(bench.report().code, 0);
    assert!(
        !flag(&bench, SteerFlags::FAILSAFE),
        "nothing was told, so nothing grew old"
    );
    bench.command(0x0F);
    bench.run_ms(50);
    assert_eq!(bench.pins.motors, OFF);
    bench.command(FORWARD);
    assert_eq!(
        bench.pins.motors,
        (Motor::forward(100), Motor::forward(100))
    );
    assert_eq!(bench.pins.motor_log.len(), 2, "set once, changed once");
}

#[test]
fn every_manual_command_sets_its_duties_and_directions() {
    let mut bench = Bench::ready();
    for (code, motors) in [
        (FORWARD, (Motor::forward(100), Motor::forward(100))),
        (BACKWARD, (Motor::backward(100), Motor::backward(100))),
        (LEFT, TURNING_LEFT),
        (RIGHT, TURNING_RIGHT),
        (STANDBY, OFF),
    ] {
        bench.command(code);
        assert_eq!(bench.pins.motors, motors, "code {code}");
        bench.run_ms(1_000);
        assert_eq!(
            bench.pins.motors, motors,
            "code {code} goes on while it is renewed"
        );
        let report = bench.report();
        assert_eq!((report.code, report.left_duty, report.right_duty), {
            (code, motors.0.duty, motors.1.duty)
        });
        assert_eq!(flag(&bench, SteerFlags::LEFT_REVERSE), motors.0.reverse);
        assert_eq!(flag(&bench, SteerFlags::RIGHT_REVERSE), motors.1.reverse);
        assert_eq!(flag(&bench, SteerFlags::ARM_LOCKED), code != STANDBY);
        assert_eq!(report.finished_seq, 0, "setpoints do not end");
    }
}

#[test]
fn a_standby_stops_in_the_step_that_brings_it() {
    for code in [FORWARD, FOLLOW, LEFT_PERP, RIGHT] {
        let mut bench = Bench::ready();
        bench.command(code);
        bench.run_ms(300);
        assert_ne!(bench.pins.motors, OFF);
        bench.command(STANDBY);
        assert_eq!(bench.pins.motors, OFF, "code {code}");
    }
}

#[test]
fn following_steers_by_the_words() {
    let mut bench = Bench::ready();
    bench.line = Some(MIDDLE);
    bench.command(FOLLOW);
    bench.run_ms(100);
    assert_eq!(
        bench.pins.motors,
        (Motor::forward(100), Motor::forward(100))
    );
    // The line moves two sensors to the right: e = 4, P = 8, for 10 ms also D = 8.
    bench.line = Some(MIDDLE >> 2);
    bench.run_ms(8);
    assert_eq!(bench.duties(), (116, 84));
    bench.run_ms(30);
    assert_eq!(bench.duties(), (108, 92));
    assert_eq!(bench.report().line_error, 4);
    bench.line = Some(MIDDLE << 2);
    bench.run_ms(50);
    assert_eq!(bench.duties(), (92, 108));
    bench.command(FOLLOW_BACK);
    bench.run_ms(50);
    assert_eq!(
        bench.pins.motors,
        (Motor::backward(104), Motor::backward(96))
    );
}

#[test]
fn a_mark_does_not_steer() {
    let mut bench = Bench::ready();
    bench.line = Some(MIDDLE >> 1);
    bench.command(FOLLOW);
    bench.run_ms(100);
    for mark in [0b111_1111_0000, 0b000_0111_1111, 0b111_1111_1111] {
        assert_eq!(bench.duties(), (104, 96));
        bench.line = Some(mark);
        bench.run_ms(100);
        assert_eq!(bench.duties(), (100, 100), "{mark:011b}");
        // After a mark on both sides the error is held for 100 ms.
        bench.line = Some(MIDDLE >> 1);
        bench.run_ms(150);
    }
}

#[test]
fn without_words_there_is_no_following() {
    let mut bench = Bench::ready();
    bench.command(FOLLOW);
    bench.run_ms(50);
    assert!(flag(&bench, SteerFlags::EXDE_OK));
    bench.line = None;
    bench.run_ms(90);
    assert_ne!(bench.pins.motors, OFF, "a few words may be lost");
    bench.run_ms(30);
    assert_eq!(bench.pins.motors, OFF);
    assert!(!flag(&bench, SteerFlags::EXDE_OK));
    bench.command(FORWARD);
    assert_ne!(bench.pins.motors, OFF, "driving by hand needs no line");
    bench.command(FOLLOW);
    assert_eq!(bench.pins.motors, OFF);
    bench.line = Some(MIDDLE);
    bench.run_ms(20);
    assert_ne!(bench.pins.motors, OFF);
    assert!(flag(&bench, SteerFlags::EXDE_OK));
}

#[test]
fn following_that_lost_its_words_is_over_until_another_command() {
    for code in [FOLLOW, FOLLOW_BACK] {
        let mut bench = Bench::ready();
        let seq = bench.command(code);
        bench.run_ms(500);
        assert_ne!(bench.pins.motors, OFF);
        bench.line = None;
        bench.pins.motor_log.clear();
        bench.run_ms(110);
        let report = bench.report();
        assert_eq!((report.finished_seq, report.code), (seq, code));
        assert!(flag(&bench, SteerFlags::FAILSAFE) && flag(&bench, SteerFlags::ABORTED));
        assert!(!flag(&bench, SteerFlags::EXDE_OK), "and why");
        bench.line = Some(MIDDLE);
        bench.run_ms(2_000);
        assert_eq!(bench.pins.motors, OFF, "renewing does not start it");
        assert_eq!(bench.pins.motor_log.len(), 1, "off once");
        assert!(flag(&bench, SteerFlags::FAILSAFE) && !flag(&bench, SteerFlags::EXDE_OK));
        bench.command(code);
        bench.run_ms(20);
        assert_ne!(bench.pins.motors, OFF);
        assert!(!flag(&bench, SteerFlags::FAILSAFE) && flag(&bench, SteerFlags::EXDE_OK));
    }
}

#[test]
fn following_that_lost_its_tape_is_over_until_another_command() {
    for code in [FOLLOW, FOLLOW_BACK] {
        let mut bench = Bench::ready();
        bench.command(code);
        bench.run_ms(500);
        // A short gap in the tape does not end following.
        bench.line = Some(0);
        bench.run_ms(1_900);
        bench.line = Some(MIDDLE);
        bench.run_ms(100);
        assert_ne!(bench.pins.motors, OFF);
        bench.line = Some(0);
        bench.run_ms(1_950);
        assert_ne!(bench.pins.motors, OFF);
        bench.pins.motor_log.clear();
        bench.run_ms(100);
        let report = bench.report();
        assert_eq!(report.finished_seq, bench.seq());
        assert!(flag(&bench, SteerFlags::FAILSAFE) && flag(&bench, SteerFlags::ABORTED));
        assert!(flag(&bench, SteerFlags::EXDE_OK), "the words are there");
        bench.line = Some(MIDDLE);
        bench.run_ms(2_000);
        assert_eq!(bench.pins.motors, OFF, "tape alone does not start it");
        assert_eq!(bench.pins.motor_log.len(), 1, "off once");
        bench.command(STANDBY);
        bench.run_ms(20);
        assert!(!flag(&bench, SteerFlags::FAILSAFE));
        bench.command(code);
        bench.run_ms(20);
        assert_ne!(bench.pins.motors, OFF);
    }
}

#[test]
fn only_following_needs_words_and_tape() {
    for code in [FORWARD, BACKWARD, LEFT, RIGHT] {
        let mut bench = Bench::ready();
        bench.line = Some(0);
        bench.command(code);
        bench.run_ms(3_000);
        bench.line = None;
        bench.run_ms(3_000);
        assert_ne!(bench.pins.motors, OFF, "code {code}");
        assert!(!flag(&bench, SteerFlags::FAILSAFE));
    }
}

#[test]
fn the_arm_is_locked_until_the_first_standby() {
    let mut bench = Bench::boot(0, SteeringConfig::default(), Servos::at([512; 8]));
    bench.line = Some(MIDDLE);
    bench.run_ms(300);
    assert!(flag(&bench, SteerFlags::ARM_LOCKED));
    let goals = bench.pins.servos.id(2).goals.len();
    let seq = bench.command(ARM_UP);
    bench.run_ms(300);
    assert_eq!(bench.report().finished_seq, seq);
    assert!(flag(&bench, SteerFlags::REFUSED));
    assert_eq!(bench.pins.servos.id(2).goals.len(), goals, "nothing moved");
    // After a turn the board is in standby by itself; the Pi has not ordered it.
    bench.line = Some(0);
    bench.command(LEFT_DIAG);
    bench.run_ms(2_000);
    assert!(flag(&bench, SteerFlags::ARM_LOCKED));
    bench.command(STANDBY);
    bench.run_ms(20);
    assert!(!flag(&bench, SteerFlags::ARM_LOCKED));
    let seq = bench.command(ARM_UP);
    bench.run_ms(300);
    assert_eq!(bench.report().finished_seq, seq);
    assert!(!flag(&bench, SteerFlags::REFUSED));
    assert!(bench.pins.servos.id(2).goals.len() > goals);
}

#[test]
fn turns_last_their_time_and_three_eighths_more_where_no_tape_comes() {
    for (code, motors, line, ms) in [
        (LEFT_PERP, TURNING_LEFT, None, 3_000),
        (RIGHT_PERP, TURNING_RIGHT, None, 3_000),
        (LEFT_DIAG, TURNING_LEFT, None, 1_500),
        (RIGHT_DIAG, TURNING_RIGHT, None, 1_500),
        (LEFT_PERP, TURNING_LEFT, Some(0), 4_125),
        (RIGHT_DIAG, TURNING_RIGHT, Some(0), 2_062),
    ] {
        let mut bench = Bench::ready();
        bench.line = line;
        let seq = bench.command(code);
        bench.run_ms(1_000);
        assert_eq!(bench.pins.motors, motors);
        assert!(flag(&bench, SteerFlags::BUSY) && flag(&bench, SteerFlags::ARM_LOCKED));
        assert_eq!(bench.report().code, code);
        bench.run_ms(3_500);
        assert_eq!(turned_ms(&bench, motors), [ms], "code {code}");
        let report = bench.report();
        assert_eq!((report.finished_seq, report.code), (seq, STANDBY));
        for absent in [
            SteerFlags::BUSY,
            SteerFlags::ABORTED,
            SteerFlags::REFUSED,
            SteerFlags::ARM_LOCKED,
        ] {
            assert!(!flag(&bench, absent));
        }
    }
}

#[test]
fn two_equal_turns_in_a_row_are_two_turns_and_a_refresh_is_none() {
    let mut bench = Bench::ready();
    bench.line = None;
    let first = bench.command(LEFT_PERP);
    bench.run_ms(3_500);
    assert_eq!(bench.report().finished_seq, first);
    assert_eq!(turned_ms(&bench, TURNING_LEFT), [3_000]);
    // The Pi repeats the same number, and nothing moves.
    bench.run_ms(2_000);
    assert_eq!(turned_ms(&bench, TURNING_LEFT), [3_000]);
    let second = bench.command(LEFT_PERP);
    assert_ne!(first, second);
    bench.run_ms(3_500);
    assert_eq!(turned_ms(&bench, TURNING_LEFT), [3_000, 3_000]);
    assert_eq!(bench.report().finished_seq, second);
}

#[test]
fn a_turn_ends_early_on_tape() {
    let mut bench = Bench::ready();
    bench.line = Some(MIDDLE);
    let seq = bench.command(RIGHT_PERP);
    bench.run_ms(400);
    assert_eq!(
        bench.pins.motors, TURNING_RIGHT,
        "not on the tape it began on"
    );
    bench.line = Some(0b110_0000_0000);
    bench.run_ms(400);
    bench.line = Some(0);
    bench.run_ms(1_000);
    bench.line = Some(0b000_0000_0111);
    bench.run_ms(100);
    assert_eq!(bench.pins.motors, TURNING_RIGHT, "not on tape at the side");
    bench.line = Some(0b000_0001_1100);
    bench.run_ms(8);
    assert_eq!(bench.pins.motors, OFF);
    bench.run_ms(20);
    assert_eq!(bench.report().finished_seq, seq);
    assert!(!flag(&bench, SteerFlags::ABORTED));
    let turned = turned_ms(&bench, TURNING_RIGHT);
    assert!((1_895..1_920).contains(&turned[0]), "{turned:?}");
}

#[test]
fn a_new_command_breaks_a_turn_off_and_that_is_reported() {
    let mut bench = Bench::ready();
    bench.line = Some(0);
    let turn = bench.command(LEFT_PERP);
    bench.run_ms(500);
    bench.command(FORWARD);
    assert_eq!(
        bench.pins.motors,
        (Motor::forward(100), Motor::forward(100))
    );
    bench.run_ms(20);
    assert_eq!(bench.report().finished_seq, turn);
    assert!(flag(&bench, SteerFlags::ABORTED));
    let second = bench.command(LEFT_DIAG);
    bench.run_ms(2_300);
    assert_eq!(bench.report().finished_seq, second);
    assert!(!flag(&bench, SteerFlags::ABORTED));
}

#[test]
fn a_command_older_than_150_ms_stops_the_wheels() {
    let mut bench = Bench::ready();
    bench.command(FORWARD);
    let told = bench.pins.now_us;
    bench.renewed = None;
    bench.run_ms(149);
    assert_ne!(bench.pins.motors, OFF);
    assert!(!flag(&bench, SteerFlags::FAILSAFE));
    bench.run_ms(10);
    assert_eq!(bench.pins.motors, OFF);
    let stopped = bench.pins.motor_log.last().unwrap().0;
    assert_eq!(
        stopped.wrapping_sub(told),
        150_001,
        "in the first microsecond beyond"
    );
    assert!(flag(&bench, SteerFlags::FAILSAFE));
    assert_eq!(
        bench.report().code,
        FORWARD,
        "what it would do if it were renewed"
    );
}

#[test]
fn a_renewed_setpoint_is_taken_up_again() {
    let mut bench = Bench::ready();
    let seq = bench.command(FORWARD);
    bench.renewed = None;
    bench.run_ms(400);
    assert_eq!(bench.pins.motors, OFF);
    bench.send(Payload::SteerCommand(SteerCommand { code: FORWARD, seq }));
    assert_ne!(bench.pins.motors, OFF);
    bench.run_ms(10);
    assert!(!flag(&bench, SteerFlags::FAILSAFE));
}

#[test]
fn a_turn_that_grew_too_old_is_aborted_and_stays_so() {
    let mut bench = Bench::ready();
    bench.line = Some(0);
    let seq = bench.command(LEFT_PERP);
    bench.renewed = None;
    bench.run_ms(200);
    assert_eq!(bench.pins.motors, OFF);
    let report = bench.report();
    assert_eq!(report.finished_seq, seq);
    assert!(flag(&bench, SteerFlags::ABORTED) && flag(&bench, SteerFlags::FAILSAFE));
    assert!(!flag(&bench, SteerFlags::BUSY));
    bench.send(Payload::SteerCommand(SteerCommand {
        code: LEFT_PERP,
        seq,
    }));
    bench.run_ms(100);
    assert_eq!(
        bench.pins.motors, OFF,
        "the same number does not turn again"
    );
    assert!(!flag(&bench, SteerFlags::FAILSAFE));
    assert!(flag(&bench, SteerFlags::ABORTED));
    bench.command(LEFT_PERP);
    assert_eq!(bench.pins.motors, TURNING_LEFT);
}

#[test]
fn the_failsafe_holds_while_the_clock_goes_round() {
    let mut bench = Bench::ready();
    bench.command(FORWARD);
    bench.renewed = None;
    // 75 minutes in slices. After that long, a wrapping age would look young again.
    for _ in 0..75 {
        bench.run_ms(60_000);
        assert_eq!(bench.pins.motors, OFF);
        assert!(flag(&bench, SteerFlags::FAILSAFE));
        bench.pi.packets.clear();
        bench.run_ms(20);
    }
}

#[test]
fn undefined_codes_are_refused_counted_and_change_nothing() {
    let mut bench = Bench::ready();
    let undefined: Vec<u8> = (0..=255)
        .filter(|code| Command::from_code(*code).is_none())
        .collect();
    assert_eq!(undefined.len(), 256 - 30);
    bench.command(FOLLOW);
    bench.run_ms(50);
    for (seq, code) in (100_u8..=255).cycle().zip(undefined) {
        bench.pins.motor_log.clear();
        bench.send(Payload::SteerCommand(SteerCommand { code, seq }));
        bench.run_ms(12);
        assert_eq!(bench.report().finished_seq, seq);
        assert!(flag(&bench, SteerFlags::REFUSED));
        assert_eq!(bench.report().code, FOLLOW);
        assert_eq!(bench.pins.motor_log, [], "code {code:#04x}");
    }
    bench.run_ms(600);
    let status = bench.pi.all(|payload| match payload {
        Payload::BoardStatus(status) => Some(status),
        _ => None,
    });
    assert_eq!(status.last().unwrap().1.refused, 226);
}

#[test]
fn a_refused_command_renews_nothing() {
    let mut bench = Bench::ready();
    bench.command(FORWARD);
    bench.run_ms(50);
    bench.command(0x0C);
    bench.run_ms(100);
    assert_ne!(
        bench.pins.motors, OFF,
        "what was under way goes on for its time"
    );
    bench.run_ms(60);
    assert_eq!(bench.pins.motors, OFF);
    let refusals = bench
        .reports()
        .iter()
        .filter(|(_, data)| data.finished_seq == 2)
        .count();
    assert!(refusals > 10, "and the refusal stands in the reports");
}

#[test]
fn arm_commands_are_refused_unless_the_wheels_are_in_standby() {
    for code in [FORWARD, FOLLOW, BACKWARD, LEFT, LEFT_PERP] {
        let mut bench = Bench::ready();
        bench.line = Some(0);
        bench.command(code);
        bench.run_ms(50);
        let motors = bench.pins.motors;
        let goals = bench.pins.servos.id(2).goals.len();
        let seq = bench.command(ARM_UP);
        bench.run_ms(20);
        assert_eq!(bench.report().finished_seq, seq);
        assert!(flag(&bench, SteerFlags::REFUSED) && flag(&bench, SteerFlags::ARM_LOCKED));
        assert_eq!(bench.pins.motors, motors, "code {code} goes on");
        assert_eq!(bench.pins.servos.id(2).goals.len(), goals);
    }
    let mut bench = Bench::ready();
    bench.command(STANDBY);
    let seq = bench.command(ARM_UP);
    bench.run_ms(100);
    assert_eq!(bench.report().finished_seq, seq);
    assert!(!flag(&bench, SteerFlags::REFUSED));
    assert_eq!(bench.pins.servos.id(2).goals.last(), Some(&515));
}

#[test]
fn a_fresh_boards_wheels_are_in_standby_for_the_arm() {
    let mut bench = Bench::ready();
    let seq = bench.command(ARM_UP);
    bench.run_ms(100);
    assert_eq!(bench.report().finished_seq, seq);
    assert!(!flag(&bench, SteerFlags::REFUSED) && !flag(&bench, SteerFlags::ABORTED));
}

#[test]
fn what_takes_long_waits_while_a_word_comes_in_and_commands_do_not() {
    let mut bench = Bench::ready();
    bench.line = None;
    bench.pins.receiving = true;
    bench.pi.packets.clear();
    bench.command(FORWARD);
    assert_eq!(
        bench.pins.motors,
        (Motor::forward(100), Motor::forward(100))
    );
    bench.run_ms(20);
    assert_eq!(bench.reports(), []);
    bench.pins.receiving = false;
    bench.run_ms(20);
    assert!(bench.reports().len() >= 4);
}

#[test]
fn a_reset_that_the_pi_orders_switches_the_motors_off_first() {
    for order in ResetOrder::ALL {
        let mut bench = Bench::ready();
        bench.command(FORWARD);
        bench.run_ms(50);
        assert_ne!(bench.pins.motors, OFF);
        bench.send(Payload::Reset(*order));
        bench.run_ms(1);
        assert_eq!(bench.pins.resets, [(*order, Some(OFF))]);
    }
}
