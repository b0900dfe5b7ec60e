//! The sensor board: its loop, its packets to the Pi, its words to the steering board.

mod support;

use lager_control::{EEPROM_LENGTH, SensorConfig};
use lager_wire::{
    Callsign, Centimetres, LineBits, LineReading, LineState, Payload, ResetCause, ResetOrder,
    SettingKey, SettingReply, SettingStatus, SteerCommand,
};
use support::SensorBench;

const MIDDLE: u16 = 0b000_0111_0000;

fn kinds(bench: &SensorBench) -> Vec<u8> {
    bench
        .pi
        .packets
        .iter()
        .map(|(_, packet)| packet.payload.kind().code())
        .collect()
}

fn replies(bench: &SensorBench) -> Vec<SettingReply> {
    let replies = bench.pi.all(|payload| match payload {
        Payload::SettingReply(reply) => Some(reply),
        _ => None,
    });
    replies.into_iter().map(|(_, reply)| reply).collect()
}

#[test]
fn line_and_distance_take_turns_every_5_ms() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    bench.tape(MIDDLE);
    bench.pins.ir = 267;
    bench.pins.ir_reads = 0;
    bench.run_ms(1_000);
    let lines = bench.pi.all(|payload| match payload {
        Payload::Line(state) => Some(state),
        _ => None,
    });
    let distances = bench.pi.all(|payload| match payload {
        Payload::Distance(distance) => Some(distance),
        _ => None,
    });
    let rarer = bench.pi.all(|payload| match payload {
        Payload::BoardStatus(status) => Some(status),
        _ => None,
    });
    // A status takes the place of a distance.
    assert_eq!((lines.len(), distances.len(), rarer.len()), (100, 98, 2));
    assert!(lines.iter().all(|(_, state)| *state == LineState::OnLine));
    assert!(
        distances
            .iter()
            .all(|(_, distance)| *distance == Centimetres(20))
    );
    assert_eq!(
        bench.pins.ir_reads, 98,
        "the ranger is read only when it is told"
    );
    let times: Vec<u32> = bench.pi.packets.iter().map(|(at, _)| *at).collect();
    for pair in times.windows(2) {
        assert_eq!(pair[1].wrapping_sub(pair[0]), 5_000);
    }
}

#[test]
fn the_steering_board_gets_every_reading_as_a_word() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    let mut sent = Vec::new();
    for bits in [0b100_0000_0000, 0b000_0000_0001, 0b010_1010_0110, 0, 0x7FF] {
        bench.tape(bits);
        for _ in 0..3 {
            bench.run_ms(5);
            sent.push(bits);
        }
    }
    bench.run_ms(4);
    let words = &bench.pins.words;
    let got: Vec<u16> = words.iter().map(|(_, word)| *word).collect();
    assert_eq!(got[..sent.len()], sent);
    for pair in words.windows(2) {
        assert_eq!(pair[1].0.wrapping_sub(pair[0].0), 5_000);
    }
}

#[test]
fn on_a_slow_line_the_loop_waits_until_everything_is_sent() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    // 9600 Bd: 11 bytes are 11.46 ms.
    bench.pins.uart.byte_us = 1_042;
    bench.tape(MIDDLE);
    bench.run_ms(100);
    bench.pi.packets.clear();
    bench.pins.words.clear();
    bench.pins.uart.backlog.clear();
    bench.run_ms(2_000);
    let packets = bench.pi.packets.len();
    assert!((165..=175).contains(&packets), "{packets}");
    let words = bench.pins.words.len();
    assert!((160..=175).contains(&words), "one word a pass: {words}");
    let mut pass_us = None;
    for (at_us, busy_us) in &bench.pins.uart.backlog {
        assert!(
            *busy_us == 0 || pass_us == Some(*at_us),
            "S10: {busy_us} us left"
        );
        pass_us = Some(*at_us);
    }
}

#[test]
fn neither_handshake_waits_for_the_other() {
    let mut bench = SensorBench::boot(0, SensorConfig::default());
    bench.run_ms(100);
    assert!(
        bench.pi.packets.len() > 10,
        "the Pi is served without the steering board"
    );
    assert!(bench.pins.words.is_empty(), "no data before its answer");

    let mut bench = SensorBench::boot(0, SensorConfig::default());
    bench.pi.answers = false;
    bench.tape(MIDDLE);
    bench.run_ms(10);
    bench.pins.answered = true;
    bench.step();
    bench.run_ms(30);
    bench.pins.words.clear();
    bench.run_ms(100);
    assert!(bench.pi.packets.is_empty());
    assert!(
        bench.pins.words.len() >= 19,
        "the steering board without the Pi"
    );
}

#[test]
fn it_says_who_it_is_and_why_it_started() {
    let mut bench = SensorBench::boot(0, SensorConfig::default());
    bench.pi.answers = false;
    bench.run_ms(350);
    assert_eq!(bench.pi.syns.len(), 4);
    for (_, packet) in &bench.pi.syns {
        let Payload::Handshake(handshake) = packet.payload else {
            panic!("{packet:?}")
        };
        assert_eq!(
            (handshake.sign, handshake.reset),
            (Callsign::Sensor, ResetCause::Watchdog)
        );
    }
    bench.pi.answers = true;
    bench.run_ms(200);
    let mut told = bench.pi.packets.iter().take(2);
    let status = told.find_map(|(_, packet)| match packet.payload {
        Payload::BoardStatus(status) => Some(status),
        _ => None,
    });
    let status = status.expect("among the first two packets");
    assert_eq!(status.reset, ResetCause::Watchdog);
    for (index, (_, packet)) in bench.pi.packets.iter().enumerate() {
        assert_eq!(
            usize::from(packet.id.get()),
            index % 16,
            "no number is left out"
        );
    }
}

#[test]
fn status_comes_twice_a_second_and_knows_the_longest_pass() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    bench.run_ms(5_000);
    let status = bench.pi.all(|payload| match payload {
        Payload::BoardStatus(status) => Some(status),
        _ => None,
    });
    assert_eq!(status.len(), 10);
    assert_eq!(status.last().unwrap().1.longest_loop_100us, 50);
}

#[test]
fn raw_line_packets_come_when_asked_for() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    bench.tape(0b110_0000_0001);
    bench.run_ms(100);
    assert!(!kinds(&bench).contains(&3));
    bench.set(SettingKey::RawLine, 4, 1);
    bench.run_ms(20);
    bench.pi.packets.clear();
    bench.run_ms(100);
    let raw = bench.pi.all(|payload| match payload {
        Payload::RawLine(bits) => Some(bits),
        _ => None,
    });
    assert_eq!(raw.len(), 10);
    assert!(
        raw.iter()
            .all(|(_, bits)| *bits == LineBits(0b110_0000_0001))
    );
    let kinds = kinds(&bench);
    for (index, kind) in kinds.iter().enumerate() {
        if *kind == 3 {
            assert_eq!(kinds[index + 1], 1, "the class follows its bits");
        }
    }
    bench.set(SettingKey::RawLine, 5, 0);
    bench.run_ms(20);
    bench.pi.packets.clear();
    bench.run_ms(100);
    assert!(!self::kinds(&bench).contains(&3));
}

#[test]
fn settings_are_answered_in_range_out_of_range_and_not_here() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    for (seq, (key, value, now, status)) in [
        (SettingKey::RawLine, 1, 1, SettingStatus::Accepted),
        (SettingKey::RawLine, 2, 1, SettingStatus::OutOfRange),
        (SettingKey::RawLine, -1, 1, SettingStatus::OutOfRange),
        (SettingKey::RawLine, 0, 0, SettingStatus::Accepted),
        (SettingKey::GainP, 3, 0, SettingStatus::NotHere),
        (SettingKey::GainD, 3, 0, SettingStatus::NotHere),
        (SettingKey::Calibrate, 7, 0, SettingStatus::OutOfRange),
        (SettingKey::Calibrate, 1, 1, SettingStatus::Accepted),
    ]
    .into_iter()
    .enumerate()
    {
        let seq = seq as u8;
        bench.set(key, seq, value);
        bench.run_ms(20);
        let expected = SettingReply {
            key,
            seq,
            value: now,
            status,
        };
        assert_eq!(replies(&bench).last(), Some(&expected));
    }
}

#[test]
fn settings_sent_together_are_all_answered() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    for seq in 0..4 {
        bench.set(SettingKey::RawLine, seq, i16::from(seq % 2));
    }
    bench.run_ms(50);
    let seqs: Vec<u8> = replies(&bench).iter().map(|reply| reply.seq).collect();
    assert_eq!(seqs, [0, 1, 2, 3]);
}

#[test]
fn a_calibration_finds_the_thresholds_of_another_floor() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    // In a darker room tape reads 110 and floor 30: below the built-in thresholds, all is floor.
    let dim = |bench: &mut SensorBench, bits: u16| {
        bench.tape(bits);
        for reading in &mut bench.pins.line {
            *reading = if *reading > 100 { 110 } else { 30 };
        }
    };
    dim(&mut bench, MIDDLE);
    bench.run_ms(50);
    let last_line = |bench: &SensorBench| {
        let lines = bench.pi.all(|payload| match payload {
            Payload::Line(state) => Some(state),
            _ => None,
        });
        lines.last().unwrap().1
    };
    assert_eq!(last_line(&bench), LineState::NotOnLine);
    bench.set(SettingKey::Calibrate, 9, 1);
    for bits in [0x7FF, 0, MIDDLE] {
        dim(&mut bench, bits);
        bench.run_ms(1_800);
    }
    assert_eq!(last_line(&bench), LineState::OnLine);
    let replies = replies(&bench);
    assert_eq!(replies.len(), 2);
    let finished = SettingReply {
        key: SettingKey::Calibrate,
        seq: 9,
        value: 11,
        status: SettingStatus::Accepted,
    };
    assert_eq!(replies[1], finished);
}

#[test]
fn while_a_calibration_runs_each_sensor_tells_in_turn_what_it_has_read() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    bench.tape(MIDDLE);
    let (tape, floor) = (bench.pins.line[5], bench.pins.line[0]);
    bench.run_ms(200);
    let told = |bench: &SensorBench| {
        let readings = bench.pi.all(|payload| match payload {
            Payload::LineReading(reading) => Some(reading),
            _ => None,
        });
        readings
            .into_iter()
            .map(|(_, reading)| reading)
            .collect::<Vec<_>>()
    };
    assert_eq!(told(&bench), [], "nothing is calibrated");
    bench.set(SettingKey::Calibrate, 9, 1);
    bench.run_ms(1_000);
    // The tape moves from the middle to the leftmost sensor.
    bench.tape(0b100_0000_0000);
    bench.run_ms(1_000);
    let readings = told(&bench);
    // One sensor in every fourth pass of 5 ms, less the passes of a status or an answer.
    assert!((95..=100).contains(&readings.len()), "{}", readings.len());
    let order: Vec<u8> = readings.iter().map(|reading| reading.sensor).collect();
    let expected: Vec<u8> = (0..11).cycle().take(order.len()).collect();
    assert_eq!(order, expected);
    let last = |sensor: u8| {
        let told = readings.iter().rev().find(|told| told.sensor == sensor);
        *told.expect("each is told of")
    };
    let seen = |sensor, reading, lowest, highest| LineReading {
        sensor,
        reading,
        lowest,
        highest,
        tells_apart: lowest != highest,
    };
    assert_eq!(last(0), seen(0, tape, floor, tape));
    assert_eq!(last(5), seen(5, floor, floor, tape));
    assert_eq!(last(10), seen(10, floor, floor, floor));
    // In a calibration fewer distances come, and as many as before when it is over.
    bench.run_ms(3_100);
    bench.pi.packets.clear();
    bench.run_ms(1_000);
    assert_eq!(told(&bench), []);
    let distances = bench
        .pi
        .all(|payload| matches!(payload, Payload::Distance(_)).then_some(()));
    assert_eq!(distances.len(), 98);
}

#[test]
fn a_calibration_that_saw_nothing_says_so_and_changes_nothing() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    bench.tape(MIDDLE);
    bench.set(SettingKey::Calibrate, 3, 1);
    bench.run_ms(5_100);
    let last = *replies(&bench).last().unwrap();
    assert_eq!((last.value, last.status), (0, SettingStatus::OutOfRange));
    bench.pi.packets.clear();
    bench.run_ms(20);
    let lines = bench.pi.all(|payload| match payload {
        Payload::Line(state) => Some(state),
        _ => None,
    });
    assert_eq!(lines.last().unwrap().1, LineState::OnLine);
}

#[test]
fn a_command_on_the_wrong_board_is_refused_and_counted() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    for seq in 0..3 {
        bench.send(Payload::SteerCommand(SteerCommand { code: 2, seq }));
    }
    bench.run_ms(1_000);
    let status = bench.pi.all(|payload| match payload {
        Payload::BoardStatus(status) => Some(status),
        _ => None,
    });
    assert_eq!(status.last().unwrap().1.refused, 3);
}

#[test]
fn a_step_more_or_less_changes_nothing() {
    let run = |extra: bool| {
        let mut bench = SensorBench::ready(SensorConfig::default());
        for round in 0..100 {
            bench.tape(0x7FF >> (round % 11));
            bench.run_ms(5);
            if extra {
                bench.step();
                bench.step();
            }
        }
        (bench.pins.words, bench.pi.packets)
    };
    assert_eq!(run(false), run(true));
}

#[test]
fn a_pass_waits_until_the_word_before_has_left() {
    let mut bench = SensorBench::ready(SensorConfig {
        loop_period_us: 450,
        ..SensorConfig::default()
    });
    bench.tape(MIDDLE);
    bench.pins.word_us = 7_000;
    bench.run_ms(1_000);
    for pair in bench.pins.words.windows(2) {
        let apart_us = pair[1].0.wrapping_sub(pair[0].0);
        assert!((7_000..7_500).contains(&apart_us), "{apart_us}");
    }
    assert!(bench.pins.words.len() > 130);
}

#[test]
fn a_calibration_outlives_the_power_and_an_empty_one_is_not_kept() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    bench.set(SettingKey::Calibrate, 1, 1);
    bench.run_ms(5_100);
    assert_eq!(
        bench.pins.eeprom, [255; EEPROM_LENGTH as usize],
        "nothing was seen"
    );
    bench.set(SettingKey::Calibrate, 2, 1);
    for reading in [30, 110] {
        bench.pins.line = [reading; 11];
        bench.run_ms(2_600);
    }
    bench.run_ms(200);
    let eeprom = bench.pins.eeprom;
    assert_eq!(eeprom[2..13], [70; 11], "the middle, for every sensor");

    let lines = |eeprom| {
        let mut bench = SensorBench::boot(0, SensorConfig::default());
        bench.pins.eeprom = eeprom;
        bench.unit = lager_control::SensorUnit::new(&bench.pins, SensorConfig::default());
        bench.pins.line = [30, 30, 30, 30, 30, 71, 30, 30, 30, 30, 30];
        bench.run_ms(50);
        bench.pi.all(|payload| match payload {
            Payload::Line(state) => Some(state),
            _ => None,
        })
    };
    assert_eq!(lines(eeprom).last().unwrap().1, LineState::OnLine);
    let mut damaged = eeprom;
    damaged[5] ^= 4;
    assert_eq!(lines(damaged).last().unwrap().1, LineState::NotOnLine);
}

#[test]
fn a_calibration_is_taken_back_while_it_runs_and_after_it_has_ended_and_only_once() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    let calibrates = |bench: &mut SensorBench, seq, [floor, tape]: [u8; 2]| {
        bench.set(SettingKey::Calibrate, seq, 1);
        for reading in [floor, tape] {
            bench.pins.line = [reading; 11];
            bench.run_ms(2_600);
        }
        bench.run_ms(300);
    };
    let both = |bench: &SensorBench| [2, 34].map(|copy| bench.pins.eeprom[copy]);
    calibrates(&mut bench, 1, [30, 110]);
    calibrates(&mut bench, 2, [50, 150]);
    assert_eq!(both(&bench), [70, 100]);
    // One that runs ends, and what was in force stays.
    bench.set(SettingKey::Calibrate, 3, 1);
    bench.pins.line = [200; 11];
    bench.run_ms(1_000);
    for _ in 0..2 {
        bench.set(SettingKey::Calibrate, 4, 2);
        bench.run_ms(100);
        let last = *replies(&bench).last().expect("an answer");
        assert_eq!((last.value, last.status), (2, SettingStatus::Accepted));
    }
    bench.run_ms(5_000);
    assert_eq!(both(&bench), [70, 100]);
    // The last one that has ended is taken back, once and for good.
    for seq in [5, 5, 6] {
        bench.set(SettingKey::Calibrate, seq, 2);
        bench.run_ms(500);
        assert_eq!(both(&bench), [70, 70]);
    }
    bench.pins.line = [30, 30, 30, 30, 30, 71, 30, 30, 30, 30, 30];
    bench.run_ms(50);
    let lines = bench.pi.all(|payload| match payload {
        Payload::Line(state) => Some(state),
        _ => None,
    });
    assert_eq!(lines.last().expect("a line").1, LineState::OnLine);
}

#[test]
fn the_watchdog_is_kicked_well_inside_its_time() {
    let mut bench = SensorBench::boot(0, SensorConfig::default());
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
fn it_resets_when_the_pi_orders_it() {
    let mut bench = SensorBench::ready(SensorConfig::default());
    bench.run_ms(10);
    assert_eq!(bench.pins.resets, []);
    bench.send(Payload::Reset(ResetOrder::Restart));
    bench.run_ms(1);
    assert_eq!(bench.pins.resets, [ResetOrder::Restart]);
}
