//! Calibrates the line sensors of a simulated robot as a person does: asks the board, as `lager
//! calibrate` does, and moves the robot over tape and floor by hand until the board says that it is
//! done (E9).
//!
//! It talks to the board over its serial line; the bridge that uses the line afterwards begins with
//! a handshake. It never tells the board the thresholds.

use core::f64::consts::TAU;
use core::time::Duration;

use lager_plant::Pose;
use lager_wire::link::{HostEvent, HostLink, HostTransmitter};
use lager_wire::{LineBits, Payload, Setting, SettingKey, SettingReply};
use thiserror::Error;

use crate::robot::{Robot, Wire};

/// How far it moves the array to either side, in mm: the outermost sensors come over the tape.
const SWAY: f64 = 60.0;
/// Time of one move to and fro, in s.
const PERIOD: f64 = 1.6;
/// The time between two requests to the board, until it answers.
const ASK: Duration = Duration::from_millis(200);
/// The longest time that a calibration may take.
const LIMIT: Duration = Duration::from_secs(12);
/// The time that the board needs to save the thresholds.
const KEEP: Duration = Duration::from_millis(500);
const STEP: Duration = Duration::from_millis(1);

/// Why the sensors are not calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CalibrateError {
    /// The board does not answer.
    #[error("the sensor board does not answer; is its cable in?")]
    Silent,
    /// Some sensors saw no contrast.
    #[error(
        "only {channels} of 11 line sensors saw floor and tape apart; move all of them over the tape, or lay darker tape"
    )]
    NoContrast {
        /// The number of sensors that saw both tape and floor.
        channels: i16,
    },
}

/// Calibrates the line sensors where the robot stands, and puts it back there.
///
/// # Errors
/// The board does not answer, or a sensor saw too little contrast.
pub fn calibrate(robot: &mut Robot) -> Result<(), CalibrateError> {
    let start = robot.world().pose();
    let (mut link, mut transmitter) = (HostLink::new(), HostTransmitter::new());
    let mut bytes = Vec::new();
    let mut ask_at = Duration::ZERO;
    let mut running = false;
    let limit = robot.now() + LIMIT;
    while robot.now() < limit {
        let now = robot.now() + STEP;
        robot.advance_to(now);
        if running {
            robot.place(swayed(&start, now));
        }
        bytes.clear();
        robot.read(Wire::Sensor, &mut bytes);
        let mut events: Vec<_> = bytes
            .iter()
            .filter_map(|byte| link.push(*byte, now))
            .collect();
        while let Some(event) = link.poll(now) {
            events.push(event);
        }
        for event in events {
            match event {
                HostEvent::SendSyn => robot.write(Wire::Sensor, &transmitter.syn()),
                HostEvent::SendAck { .. } => {
                    if let Some(version) = link.version() {
                        robot.write(Wire::Sensor, &transmitter.ack(version));
                    }
                }
                HostEvent::Packet(packet) => match packet.payload {
                    Payload::SettingReply(reply) if reply.key == SettingKey::Calibrate => {
                        if running && reply.value != 1 {
                            return finish(robot, start, reply);
                        }
                        running = true;
                    }
                    _ => {}
                },
                HostEvent::Up(_) | HostEvent::Silent => {}
            }
        }
        if !running && link.version().is_some() && now >= ask_at {
            ask_at = now + ASK;
            let setting = Setting {
                key: SettingKey::Calibrate,
                seq: 1,
                value: 1,
            };
            if let Some(packet) = transmitter.encode(Payload::Setting(setting)) {
                robot.write(Wire::Sensor, &packet);
            }
        }
    }
    Err(CalibrateError::Silent)
}

fn finish(robot: &mut Robot, start: Pose, reply: SettingReply) -> Result<(), CalibrateError> {
    robot.place(start);
    robot.advance_to(robot.now() + KEEP);
    let channels = reply.value;
    if channels == i16::from(LineBits::SENSORS) {
        Ok(())
    } else {
        Err(CalibrateError::NoContrast { channels })
    }
}

fn swayed(start: &Pose, now: Duration) -> Pose {
    let aside = SWAY * (TAU * now.as_secs_f64() / PERIOD).sin();
    let (x, y) = start.point(0.0, aside);
    Pose { x, y, ..*start }
}
