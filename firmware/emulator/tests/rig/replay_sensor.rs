//! The sensor board: compares the outputs of chip and host for the Pi and for the steering board.

use lager_control::{SensorBoard, SensorConfig, SensorUnit};
use lager_emulator::rig::{Board, Conversion, Input};
use lager_wire::Payload;

use crate::replay::{SENSORS, board, drive, is_compared, microseconds, told, words};
use crate::support::{FAST, SLOW};

/// The sensor board on the host; it gets the readings of the chip's converter.
struct SensorHost {
    now_us: u32,
    bytes: std::vec::IntoIter<(u64, u8)>,
    next_byte: Option<(u64, u8)>,
    pass: Vec<Conversion>,
    sent: Vec<u8>,
    words: Vec<u16>,
}

board!(SensorHost);

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

/// The passes of the sensor board; each begins with the leftmost sensor.
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
    compare(FAST);
}

#[test]
fn the_sensor_board_tells_the_same_on_a_slow_line() {
    compare(SLOW);
}

fn compare(baud: u32) {
    let mut robot = drive(baud, &[]);
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
    // Here a pass is due in every step, because the chip has decided when.
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
