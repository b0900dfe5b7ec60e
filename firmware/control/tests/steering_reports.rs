//! The steering board: its messages to the Pi, the times of its steps, its settings.

mod support;

use lager_control::{Motor, SteeringConfig};
use lager_wire::{
    Payload, ResetCause, SettingKey, SettingStatus, SteerCommand, SteerFlags, WheelCommand,
};
use support::Bench;
use support::servos::Servos;

const STANDBY: u8 = 1;
const FORWARD: u8 = 2;
const FOLLOW: u8 = 3;
const LEFT_PERP: u8 = 7;
const LEFT_DIAG: u8 = 8;

const MIDDLE: u16 = 0b000_0111_0000;
const OFF: (Motor, Motor) = (Motor::OFF, Motor::OFF);
const TURNING_LEFT: (Motor, Motor) = (Motor::backward(100), Motor::forward(100));

fn flag(bench: &Bench, flag: SteerFlags) -> bool {
    bench.report().flags.contains(flag)
}

#[test]
fn the_end_of_a_turn_is_reported_at_once() {
    let mut bench = Bench::ready();
    bench.line = Some(0);
    let seq = bench.command(LEFT_DIAG);
    bench.run_ms(2_300);
    let stopped = bench.pins.motor_log.last().unwrap().0;
    let reports = bench.reports();
    let (told, _) = reports
        .iter()
        .find(|(_, data)| data.finished_seq == seq)
        .unwrap();
    assert!(told.wrapping_sub(stopped) < 1_000);
}

#[test]
fn ends_in_quick_succession_are_all_reported() {
    let mut bench = Bench::ready();
    bench.line = Some(0);
    let turn = bench.command(LEFT_PERP);
    bench.run_ms(100);
    // One step reads both packets, and so ends two commands.
    let (refused, stop) = (turn + 1, turn + 2);
    for (code, seq) in [(0x0E, refused), (STANDBY, stop)] {
        let command = Payload::SteerCommand(SteerCommand { code, seq });
        bench.pi.send(command, &mut bench.pins.uart);
    }
    bench.run_ms(20);
    let mut ends: Vec<(u8, bool, bool)> = bench
        .reports()
        .iter()
        .map(|(_, data)| {
            let flags = data.flags;
            (
                data.finished_seq,
                flags.contains(SteerFlags::ABORTED),
                flags.contains(SteerFlags::REFUSED),
            )
        })
        .collect();
    ends.dedup();
    assert_eq!(
        ends,
        [
            (0, false, false),
            (refused, false, true),
            (turn, true, false)
        ]
    );
}

#[test]
fn gains_are_set_at_run_time_within_their_range() {
    let mut bench = Bench::ready();
    bench.line = Some(MIDDLE >> 1);
    bench.command(FOLLOW);
    bench.run_ms(100);
    assert_eq!(bench.duties(), (104, 96));
    for (seq, (key, value, now, status)) in [
        (SettingKey::GainP, 10, 10, SettingStatus::Accepted),
        (SettingKey::GainP, 256, 10, SettingStatus::OutOfRange),
        (SettingKey::GainP, -1, 10, SettingStatus::OutOfRange),
        (SettingKey::GainD, 7, 7, SettingStatus::Accepted),
        (SettingKey::GainD, i16::MAX, 7, SettingStatus::OutOfRange),
        (SettingKey::GainD, i16::MIN, 7, SettingStatus::OutOfRange),
        (SettingKey::RawLine, 1, 0, SettingStatus::NotHere),
        (SettingKey::Calibrate, 1, 0, SettingStatus::NotHere),
    ]
    .into_iter()
    .enumerate()
    {
        let seq = seq as u8;
        bench.set(key, seq, value);
        bench.run_ms(10);
        let replies = bench.pi.all(|payload| match payload {
            Payload::SettingReply(reply) => Some(reply),
            _ => None,
        });
        let reply = replies.last().unwrap().1;
        assert_eq!(
            (reply.key, reply.seq, reply.value, reply.status),
            (key, seq, now, status)
        );
        assert_eq!(replies.len(), usize::from(seq) + 1, "one answer each");
    }
    bench.run_ms(50);
    assert_eq!(bench.duties(), (120, 80));
}

#[test]
fn it_reports_every_5_ms_and_its_state_twice_a_second() {
    let mut bench = Bench::ready();
    bench.command(STANDBY);
    bench.run_ms(10);
    bench.pi.packets.clear();
    bench.run_ms(5_000);
    let reports = bench.reports().len();
    assert!((990..=1_010).contains(&reports), "{reports}");
    let status = bench.pi.all(|payload| match payload {
        Payload::BoardStatus(status) => Some(status),
        _ => None,
    });
    assert_eq!(status.len(), 10);
    assert_eq!(status[0].1.reset, ResetCause::BrownOut);
    let arm = bench.pi.all(|payload| match payload {
        Payload::ArmData(data) => Some(data.servo),
        _ => None,
    });
    assert_eq!(arm.len(), 50, "10 a second, the servos taking turns");
    for servo in 1..=8 {
        assert!(arm.iter().filter(|(_, id)| *id == servo).count() >= 6);
    }
    let report = bench.report();
    assert_eq!(
        (report.battery_decivolts, report.servo_errors),
        (0, 0),
        "without a divider the input floats and says nothing"
    );
    assert_eq!(WheelCommand::Standby.code(), report.code);
}

#[test]
fn on_a_slow_line_reports_are_fewer_and_never_late() {
    let mut bench = Bench::ready();
    // 9600 Bd.
    bench.pins.uart.byte_us = 1_042;
    bench.line = Some(MIDDLE);
    bench.command(FOLLOW);
    bench.run_ms(1_000);
    bench.pi.packets.clear();
    bench.pins.uart.backlog.clear();
    bench.run_ms(1_000);
    let reports = bench.reports().len();
    assert!((60..=87).contains(&reports), "{reports}");
    // The board makes a report when the line is free, so that it arrives new. Only the rarer
    // packets (one servo's state, the board's status) wait in a row.
    let waiting = bench
        .pins
        .uart
        .backlog
        .iter()
        .map(|(_, busy_us)| *busy_us)
        .max();
    assert!(waiting.unwrap() <= 2 * 11 * 1_042, "{waiting:?}");
    bench.command(STANDBY);
    bench.run_ms(60);
    assert_eq!(bench.report().left_duty, 0);
}

#[test]
fn the_pi_is_asked_until_it_answers_and_then_told_everything() {
    let mut bench = Bench::boot(0, SteeringConfig::default(), Servos::at([512; 8]));
    bench.pi.answers = false;
    bench.run_ms(450);
    let times: Vec<u32> = bench.pi.syns.iter().map(|(at, _)| *at).collect();
    assert_eq!(times.len(), 5, "{times:?}");
    assert!(bench.pi.packets.is_empty(), "no data before the answer");
    bench.pi.answers = true;
    bench.run_ms(120);
    let kinds: Vec<u8> = bench
        .pi
        .packets
        .iter()
        .map(|(_, packet)| packet.payload.kind().code())
        .collect();
    assert_eq!(
        kinds[..9],
        [8, 8, 8, 8, 8, 8, 8, 8, 9],
        "the arm, the board's status"
    );
    for (index, (_, packet)) in bench.pi.packets.iter().enumerate() {
        assert_eq!(
            usize::from(packet.id.get()),
            index % 16,
            "no number is left out"
        );
    }
}

#[test]
fn a_step_more_or_less_changes_nothing() {
    let script = |extra: bool| {
        let mut bench = Bench::ready();
        bench.line = Some(MIDDLE >> 1);
        bench.command(FOLLOW);
        for _ in 0..200 {
            bench.run_us(1_000);
            if extra {
                bench.step();
                bench.step();
            }
        }
        bench.line = Some(0);
        bench.command(LEFT_DIAG);
        for _ in 0..2_000 {
            bench.run_us(1_000);
            if extra {
                bench.step();
            }
        }
        bench.pins.motor_log.clone()
    };
    assert_eq!(script(false), script(true));
}

#[test]
fn a_late_step_is_late_and_nothing_else() {
    let mut bench = Bench::ready();
    bench.command(FORWARD);
    bench.renewed = None;
    bench.line = None;
    bench.pins.now_us = bench.pins.now_us.wrapping_add(400_000);
    bench.step();
    assert_eq!(bench.pins.motors, OFF);
    let turn = bench.command(LEFT_PERP);
    bench.run_ms(100);
    bench.renewed = None;
    bench.pins.now_us = bench.pins.now_us.wrapping_add(100_000);
    bench.step();
    assert_eq!(bench.pins.motors, TURNING_LEFT);
    bench.run_ms(100);
    assert_eq!(bench.report().finished_seq, turn);
    assert!(flag(&bench, SteerFlags::ABORTED));
}

#[test]
fn the_watchdog_is_kicked_well_inside_its_time() {
    let mut bench = Bench::boot(0, SteeringConfig::default(), Servos::at([512; 8]));
    bench.pi.answers = false;
    let mut longest = 0;
    for _ in 0..2_000 {
        let due = bench.unit.step(&mut bench.pins);
        longest = longest.max(due.wrapping_sub(bench.pins.now_us));
        bench.pins.now_us = bench.pins.now_us.max(due).wrapping_add(1);
    }
    assert!(longest <= 20_000, "{longest}");
    assert_eq!(bench.pins.kicks, 2_000);
}

#[test]
fn load_and_longest_pass_are_measured() {
    let mut bench = Bench::ready();
    bench.command(STANDBY);
    bench.pins.step_us = 300;
    bench.run_ms(600);
    bench.pi.packets.clear();
    bench.run_ms(600);
    let status = bench.pi.all(|payload| match payload {
        Payload::BoardStatus(status) => Some(status),
        _ => None,
    });
    let status = status.last().unwrap().1;
    assert_eq!(status.longest_loop_100us, 3);
    assert!(
        (5..=60).contains(&status.load_percent),
        "{}",
        status.load_percent
    );
}

#[test]
fn settings_sent_together_are_all_answered() {
    let mut bench = Bench::ready();
    bench.set(SettingKey::GainP, 1, 4);
    bench.set(SettingKey::GainD, 2, 300);
    bench.run_ms(20);
    let replies = bench.pi.all(|payload| match payload {
        Payload::SettingReply(reply) => Some((reply.seq, reply.value, reply.status)),
        _ => None,
    });
    let replies: Vec<_> = replies.into_iter().map(|(_, reply)| reply).collect();
    assert_eq!(
        replies,
        [
            (1, 4, SettingStatus::Accepted),
            (2, 2, SettingStatus::OutOfRange)
        ]
    );
}

#[test]
fn gains_outlive_the_power() {
    let mut bench = Bench::ready();
    bench.set(SettingKey::GainP, 1, 9);
    bench.set(SettingKey::GainD, 2, 7);
    bench.run_ms(200);
    let eeprom = bench.pins.eeprom;

    let mut bench = Bench::boot(0, SteeringConfig::default(), Servos::at([512; 8]));
    bench.pins.eeprom = eeprom;
    bench.unit = lager_control::SteeringUnit::new(&bench.pins, SteeringConfig::default());
    bench.run_ms(200);
    // A value out of range is answered with the value in force.
    bench.set(SettingKey::GainP, 3, -1);
    bench.set(SettingKey::GainD, 4, -1);
    bench.run_ms(20);
    let values = bench.pi.all(|payload| match payload {
        Payload::SettingReply(reply) => Some(reply.value),
        _ => None,
    });
    let values: Vec<i16> = values.into_iter().map(|(_, value)| value).collect();
    assert_eq!(values, [9, 7]);
}

#[test]
fn a_flood_of_bytes_does_not_hold_up_a_step() {
    let mut bench = Bench::ready();
    let waiting = 1_000;
    bench.pins.uart.received.extend([0x5A; 1_000]);
    bench.step_once();
    assert_eq!(
        waiting - bench.pins.uart.received.len(),
        64,
        "what the board's queue holds, and then the rest of the step"
    );
}
