//! With the same recorded inputs, the chip and the host's build of the same control code must give
//! the same outputs, frame by frame.
//!
//! ```text
//!   chip:  conversions, bytes, words --> image ------------> packets, words, duties
//!   host:  the same, at the same times --> lager_control --> the same?
//! ```

use std::time::Duration;

use lager_wire::{Decoder, Packet, Payload, Setting, Version, WheelCommand};

use crate::support::{Robot, SLOW, milliseconds};

/// How many line sensors there are, and how many bits a word has.
pub(crate) const SENSORS: usize = 11;

pub(crate) fn microseconds(cycle: u64) -> u32 {
    (cycle / 16) as u32
}

/// The packets that a unit sent, without handshakes and reports of its own load.
pub(crate) fn told(bytes: &[u8]) -> Vec<Payload> {
    let mut decoder = Decoder::new(Version::One);
    bytes
        .iter()
        .filter_map(|byte| decoder.push(*byte))
        .map(|packet: Packet| packet.payload)
        .filter(is_compared)
        .collect()
}

pub(crate) fn is_compared(payload: &Payload) -> bool {
    !matches!(payload, Payload::Handshake(_) | Payload::BoardStatus(_))
}

/// The words on the wire: the cycle of the last rise, and the bits.
pub(crate) fn words(robot: &Robot) -> Vec<(u64, u16)> {
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

/// A drive in which the tape moves under the sensors; everything is recorded from power-on. It is
/// longer on slow lines, where less can be compared in the same time.
pub(crate) fn drive(baud: u32, settings: &[Setting]) -> Robot {
    let mut robot = Robot::at(baud, 11);
    let longer = if baud == SLOW { 10 } else { 1 };
    let run = |robot: &mut Robot, milliseconds: u64| {
        robot.run(Duration::from_millis(milliseconds * longer));
    };
    robot.rig.record_conversions();
    robot.rig.record_written();
    robot.rig.exde().data.record();
    robot.rig.exde().sync.record();
    robot.place(0.0);
    run(&mut robot, 400);
    for &setting in settings {
        robot
            .steering
            .send(&mut robot.rig, Payload::Setting(setting));
        run(&mut robot, 20);
    }
    robot.wheels(WheelCommand::ActiveForward);
    for left in [0.0, 7.0, -14.0, 21.0, 0.0, 35.0, -3.0, 60.0, 10.0] {
        robot.place(left);
        run(&mut robot, 50);
    }
    robot.wheels(WheelCommand::ActiveBackward);
    robot.place(-10.0);
    run(&mut robot, 60);
    robot.wheels(WheelCommand::LeftDiag);
    run(&mut robot, 60);
    robot.wheels(WheelCommand::Standby);
    run(&mut robot, 30);
    robot
}

/// The parts of a host's board that both boards have.
macro_rules! board {
    ($host:ident) => {
        impl lager_control::Board for $host {
            fn now_us(&self) -> u32 {
                self.now_us
            }
            fn uart_read(&mut self) -> Option<u8> {
                let next = self.next_byte.or_else(|| self.bytes.next());
                self.next_byte =
                    next.filter(|(at, _)| $crate::replay::microseconds(*at) > self.now_us);
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
            fn reset_cause(&self) -> lager_wire::ResetCause {
                lager_wire::ResetCause::PowerOn
            }
            fn reset(&mut self, _: lager_wire::ResetOrder) {}
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

pub(crate) use board;
