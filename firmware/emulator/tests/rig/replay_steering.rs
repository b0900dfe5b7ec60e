//! The steering board: compares the duties of chip and host.

use lager_control::line::LineReader;
use lager_control::{Motor, SteeringBoard, SteeringConfig, SteeringUnit};
use lager_emulator::rig::{Board, MotorChange};
use lager_wire::{LineBits, Setting, SettingKey};

use crate::replay::{board, drive, microseconds, words};
use crate::support::{FAST, SLOW, milliseconds};

/// The two may differ by so many words. The chip's work may reach into the next word, and the host
/// gets the Pi's bytes only together with a word.
const LATEST: usize = 2;

/// The steering board on the host; it gets the words on the wire and the Pi's bytes.
struct SteeringHost {
    now_us: u32,
    bytes: std::vec::IntoIter<(u64, u8)>,
    next_byte: Option<(u64, u8)>,
    word: Option<(u16, u32)>,
    sent: Vec<u8>,
    duties: [i16; 2],
}

board!(SteeringHost);

impl SteeringBoard for SteeringHost {
    fn set_motors(&mut self, left: Motor, right: Motor) {
        self.duties = [left, right].map(|motor| {
            let duty = i16::from(motor.duty);
            if motor.reverse { -duty } else { duty }
        });
    }

    fn exde_word(&mut self) -> Option<(u16, u32)> {
        self.word.take()
    }

    fn exde_errors(&self) -> u8 {
        0
    }

    fn servo_write(&mut self, _: &[u8]) -> bool {
        true
    }

    fn servo_read(&mut self) -> Option<u8> {
        None
    }

    fn battery_decivolts(&mut self) -> u8 {
        0
    }
}

/// The duties in force at a cycle.
fn duties_at(changes: &[MotorChange], cycle: u64) -> [i16; 2] {
    let after = changes.partition_point(|change| change.cycle <= cycle);
    changes[..after]
        .last()
        .map_or([0, 0], |change| change.duties)
}

/// The duties of chip and host after a word.
struct Compared {
    cycle: u64,
    chip: [i16; 2],
    host: [i16; 2],
    /// Duties may differ by this much.
    tolerance: i16,
    /// Whether an order of the Pi came between two words.
    disturbed: bool,
}

impl Compared {
    /// Whether the chip's duties are those of the host after `word`.
    fn agrees_with(&self, word: &Self) -> bool {
        (0..2).all(|side| (self.chip[side] - word.host[side]).abs() <= word.tolerance)
    }
}

/// Duties of chip and host after each word.
fn duties_by_word(baud: u32, settings: &[Setting], d: i32) -> Vec<Compared> {
    let mut robot = drive(baud, settings);
    let words = words(&robot);
    let changes = robot.rig.take_motor_changes();
    let bytes = robot.rig.take_written(Board::Steering);
    let mut host = SteeringHost {
        now_us: 0,
        bytes: bytes.clone().into_iter(),
        next_byte: None,
        word: None,
        sent: Vec::new(),
        duties: [0, 0],
    };
    let mut unit = SteeringUnit::new(&host, SteeringConfig::default());
    let mut reader = LineReader::new();
    let mut past: Vec<(u64, i32)> = Vec::new();
    let mut compared = Vec::new();
    for pair in words.windows(2) {
        let [(cycle, bits), (next, _)] = [pair[0], pair[1]];
        host.now_us = microseconds(cycle);
        host.word = Some((bits, host.now_us));
        unit.step(&mut host);
        let error = i32::from(reader.read(LineBits::new(bits), host.now_us).error);
        let tolerance = tolerance(&past, cycle, error, d);
        past.push((cycle, error));
        let disturbed = bytes
            .iter()
            .any(|(at, _)| (cycle - milliseconds(1)..=next).contains(at));
        compared.push(Compared {
            cycle,
            chip: duties_at(&changes, next),
            host: host.duties,
            tolerance,
            disturbed,
        });
    }
    compared
}

/// D uses the newest sample that is at least 7.5 ms old, and divides by its age. The chip reads its
/// clock some microseconds after the edge. Where these decide which sample is used or how the
/// quotient is rounded, both results are right.
fn tolerance(past: &[(u64, i32)], cycle: u64, error: i32, d: i32) -> i16 {
    let candidates: Vec<i32> = past
        .iter()
        .map(|(at, before)| ((cycle - at) as i32 / 16, error - before))
        .filter(|(age, _)| (7_400..11_000).contains(age))
        .map(|(age, change)| change * d * 10_000 / age)
        .collect();
    let most = candidates.iter().max().copied().unwrap_or(0);
    let least = candidates.iter().min().copied().unwrap_or(0);
    let rounding = i32::from(most != 0 || least != 0);
    (most - least + rounding) as i16
}

fn gain(key: SettingKey, value: i16) -> Setting {
    Setting { key, seq: 7, value }
}

fn assert_alike(compared: &[Compared]) {
    assert!(compared.len() > 300, "{} words", compared.len());
    let mut seen: Vec<[i16; 2]> = compared.iter().map(|word| word.chip).collect();
    seen.sort_unstable();
    seen.dedup();
    assert!(seen.len() >= 8, "the tape was at many places: {seen:?}");
    let exact = compared.iter().filter(|word| word.tolerance == 0).count();
    assert!(exact * 2 > compared.len(), "{exact} of {}", compared.len());
    // A pass of the chip that sends much takes longer than a word; then the chip acts late.
    let mut late = 0;
    for latest in compared.windows(LATEST + 1) {
        let word = &latest[LATEST];
        if latest.iter().any(|word| word.disturbed) || word.agrees_with(word) {
            continue;
        }
        late += 1;
        assert!(
            latest.iter().any(|before| word.agrees_with(before)),
            "after the word at cycle {}: the chip {:?}, the host {:?}",
            word.cycle,
            word.chip,
            latest
                .iter()
                .map(|word| (word.cycle, word.chip, word.host, word.tolerance))
                .collect::<Vec<_>>()
        );
    }
    assert!(
        late * 20 < compared.len(),
        "{late} of {} late",
        compared.len()
    );
}

#[test]
fn the_motors_get_the_same_duties_as_on_the_host() {
    compare_without_d(FAST);
}

#[test]
fn the_motors_get_the_same_duties_on_a_slow_line() {
    compare_without_d(SLOW);
}

fn compare_without_d(baud: u32) {
    let settings = [gain(SettingKey::GainD, 0), gain(SettingKey::GainP, 3)];
    let compared = duties_by_word(baud, &settings, 0);
    assert!(compared.iter().all(|word| word.tolerance == 0));
    assert_alike(&compared);
}

#[test]
fn with_d_the_duties_are_the_same_where_its_clock_does_not_decide() {
    assert_alike(&duties_by_word(FAST, &[], 2));
}
