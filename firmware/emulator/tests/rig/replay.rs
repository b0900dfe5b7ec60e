//! The same recorded inputs give the same outputs from the chip and from the host's build of the very
//! same control code, frame by frame.
//!
//! ```text
//!   chip:  conversions, bytes, words --> image ------------> packets, words, duties
//!   host:  the same, at the same times --> lager_control --> the same?
//! ```

use std::time::Duration;

use lager_control::line::LineReader;
use lager_control::{
    Motor, SensorBoard, SensorConfig, SensorUnit, SteeringBoard, SteeringConfig, SteeringUnit,
};
use lager_emulator::rig::{Board, Conversion, Input, MotorChange};
use lager_wire::{
    Decoder, LineBits, Packet, Payload, ResetCause, Setting, SettingKey, Version, WheelCommand,
};

use crate::support::{Robot, milliseconds};

/// Sensors of the line, and bits of a word.
const SENSORS: usize = 11;

/// How many words the chip may be late: its longest loop is 1.2 ms.
const LATEST: usize = 2;

fn microseconds(cycle: u64) -> u32 {
    (cycle / 16) as u32
}

/// The packets among what a unit sent, but for those that tell of its own load, and handshakes.
fn told(bytes: &[u8]) -> Vec<Payload> {
    let mut decoder = Decoder::new(Version::One);
    bytes
        .iter()
        .filter_map(|byte| decoder.push(*byte))
        .map(|packet: Packet| packet.payload)
        .filter(is_compared)
        .collect()
}

fn is_compared(payload: &Payload) -> bool {
    !matches!(payload, Payload::Handshake(_) | Payload::BoardStatus(_))
}

/// Words on the wire: the cycle of the last rise, and the bits.
fn words(robot: &Robot) -> Vec<(u64, u16)> {
    let data = robot.rig.exde().data.take_edges();
    let rises: Vec<u64> = robot
        .rig
        .exde()
        .sync
        .take_edges()
        .iter()
        .filter(|edge| edge.1)
        .map(|edge| edge.0)
        .collect();
    let level = |cycle: u64| {
        let before = data.partition_point(|edge| edge.0 < cycle);
        before > 0 && data[before - 1].1
    };
    rises
        .chunk_by(|one, next| next - one < milliseconds(1) / 20)
        .filter(|word| word.len() == SENSORS)
        .map(|word| {
            let bits = word
                .iter()
                .fold(0, |bits, rise| bits << 1 | u16::from(level(*rise)));
            (word[SENSORS - 1], bits)
        })
        .collect()
}

/// A drive with turns of the tape under the sensors, everything recorded from power on.
fn drive(settings: &[Setting]) -> Robot {
    let mut robot = Robot::new(11);
    robot.rig.record_conversions();
    robot.rig.record_written();
    robot.rig.exde().data.record();
    robot.rig.exde().sync.record();
    robot.place(0.0);
    robot.run(Duration::from_millis(400));
    for &setting in settings {
        robot
            .steering
            .send(&mut robot.rig, Payload::Setting(setting));
        robot.run(Duration::from_millis(20));
    }
    robot.wheels(WheelCommand::ActiveForward);
    for left in [0.0, 7.0, -14.0, 21.0, 0.0, 35.0, -3.0, 60.0, 10.0] {
        robot.place(left);
        robot.run(Duration::from_millis(50));
    }
    robot.wheels(WheelCommand::ActiveBackward);
    robot.place(-10.0);
    robot.run(Duration::from_millis(60));
    robot.wheels(WheelCommand::LeftDiag);
    robot.run(Duration::from_millis(60));
    robot.wheels(WheelCommand::Standby);
    robot.run(Duration::from_millis(30));
    robot
}

/// The sensor board on the host, fed with what the chip's converter saw.
struct SensorHost {
    now_us: u32,
    bytes: std::vec::IntoIter<(u64, u8)>,
    next_byte: Option<(u64, u8)>,
    pass: Vec<Conversion>,
    sent: Vec<u8>,
    words: Vec<u16>,
}

macro_rules! board {
    ($host:ident) => {
        impl lager_control::Board for $host {
            fn now_us(&self) -> u32 {
                self.now_us
            }
            fn uart_read(&mut self) -> Option<u8> {
                let next = self.next_byte.or_else(|| self.bytes.next());
                self.next_byte = next.filter(|(at, _)| microseconds(*at) > self.now_us);
                next.filter(|_| self.next_byte.is_none())
                    .map(|(_, byte)| byte)
            }
            fn uart_write(&mut self, bytes: &[u8]) -> bool {
                self.sent.extend_from_slice(bytes);
                true
            }
            fn uart_idle(&self) -> bool {
                true
            }
            fn reset_cause(&self) -> ResetCause {
                ResetCause::PowerOn
            }
            fn kick_watchdog(&mut self) {}
            fn eeprom_read(&self, _: u8) -> u8 {
                255
            }
            fn eeprom_write(&mut self, _: u8, _: u8) -> bool {
                true
            }
        }
    };
}

board!(SensorHost);
board!(SteeringHost);

impl SensorBoard for SensorHost {
    fn read_line_sensor(&mut self, channel: u8) -> u8 {
        let wanted = |conversion: &&Conversion| conversion.input == Input::Line(channel);
        let found = self.pass.iter().find(wanted);
        found.expect("the chip looked at every sensor").reading as u8
    }

    fn read_ir(&mut self) -> u16 {
        let wanted = |conversion: &&Conversion| conversion.input == Input::Ranger;
        let found = self.pass.iter().find(wanted);
        found
            .expect("the chip looked at the ranger in this pass")
            .reading
    }

    fn exde_send(&mut self, word: u16) -> bool {
        self.words.push(word);
        true
    }

    fn exde_is_sending(&self) -> bool {
        false
    }
}

/// Passes of the sensor board: each begins with the leftmost sensor.
fn passes(conversions: &[Conversion]) -> Vec<Vec<Conversion>> {
    let mut passes: Vec<Vec<Conversion>> = Vec::new();
    for conversion in conversions {
        if conversion.input == Input::Line(0) {
            passes.push(Vec::new());
        }
        if let Some(pass) = passes.last_mut() {
            pass.push(*conversion);
        }
    }
    passes.retain(|pass| pass.len() >= SENSORS);
    passes
}

#[test]
fn the_sensor_board_tells_the_same_as_on_the_host() {
    let mut robot = drive(&[]);
    let chip_told: Vec<Payload> = robot
        .sensor
        .packets
        .iter()
        .map(|arrived| arrived.packet.payload)
        .filter(is_compared)
        .collect();
    let wire = words(&robot);
    let conversions = robot.rig.take_conversions();
    let passes = passes(&conversions);
    let mut host = SensorHost {
        now_us: 0,
        bytes: robot.rig.take_written(Board::Sensor).into_iter(),
        next_byte: None,
        pass: Vec::new(),
        sent: Vec::new(),
        words: Vec::new(),
    };
    // A pass is due in every step: the chip has decided when.
    let config = SensorConfig {
        loop_period_us: 1,
        ..SensorConfig::FAST
    };
    let mut unit = SensorUnit::new(&host, config);
    for pass in &passes {
        host.now_us = microseconds(pass[0].cycle);
        host.pass.clone_from(pass);
        unit.step(&mut host);
    }
    let host_told = told(&host.sent);
    assert!(chip_told.len() > 400, "{} frames", chip_told.len());
    for (frame, (chip, host)) in chip_told.iter().zip(&host_told).enumerate() {
        assert_eq!(chip, host, "frame {frame}");
    }
    assert!(
        host_told.len() - chip_told.len() <= 2,
        "what was still on its way"
    );

    assert_eq!(host.words.len(), passes.len());
    assert!(wire.len() > 400, "{} words", wire.len());
    for (last_rise, bits) in wire {
        let pass = passes.partition_point(|pass| pass[0].cycle < last_rise) - 1;
        assert_eq!(bits, host.words[pass], "the word at cycle {last_rise}");
    }
}

/// The steering board on the host, fed with the words on the wire and the Pi's bytes.
struct SteeringHost {
    now_us: u32,
    bytes: std::vec::IntoIter<(u64, u8)>,
    next_byte: Option<(u64, u8)>,
    word: Option<(u16, u32)>,
    sent: Vec<u8>,
    duties: [i16; 2],
}

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

/// What chip and host made of a word.
struct Compared {
    cycle: u64,
    chip: [i16; 2],
    host: [i16; 2],
    /// How far apart the two may be.
    tolerance: i16,
    /// Whether an order of the Pi came in between.
    disturbed: bool,
}

impl Compared {
    /// Whether the chip did what the host made of `word`.
    fn agrees_with(&self, word: &Self) -> bool {
        (0..2).all(|side| (self.chip[side] - word.host[side]).abs() <= word.tolerance)
    }
}

/// Duties of chip and host after each word.
fn duties_by_word(settings: &[Setting], d: i32) -> Vec<Compared> {
    let mut robot = drive(settings);
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

/// D is a difference to the newest sample at least 7.5 ms old, scaled by its age. The chip reads
/// its clock some microseconds later than the edge, so where the choice of the sample or the
/// quotient's rounding hangs on these, either is right.
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
    // A loop of the chip that tells much takes longer than a word: then it acts late.
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
    let settings = [gain(SettingKey::GainD, 0), gain(SettingKey::GainP, 3)];
    let compared = duties_by_word(&settings, 0);
    assert!(compared.iter().all(|word| word.tolerance == 0));
    assert_alike(&compared);
}

#[test]
fn with_d_the_duties_are_the_same_where_its_clock_does_not_decide() {
    assert_alike(&duties_by_word(&[], 2));
}
