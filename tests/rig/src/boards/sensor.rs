//! The sensor board that tests play, with counters of what the bridge did to it.

use lager_wire::link::{BoardEvent, BoardLink};
use lager_wire::{
    BoardStatus, Callsign, Centimetres, LineBits, LineReading, LineState, Packet, Payload, Profile,
    ResetCause, ResetOrder, SensorProfile, SettingKey, SettingReply, SettingStatus,
};

use super::Peer;
use crate::GAP_US;
use crate::board::answer_to;

const RESTART: Payload = Payload::Reset(ResetOrder::Restart);

/// A sensor board. Every 10 ms it sends a packet, in turn the line and the distance.
pub struct SensorBoard {
    /// The board's end of the link.
    pub link: BoardLink,
    /// The line state that it reports.
    pub state: LineState,
    /// The line sensors that see tape, one bit each.
    pub bits: u16,
    /// The distance that it reports, in cm.
    pub distance: u8,
    /// It sends the sensors' bits with each line state.
    pub raw: bool,
    /// The number of calibrations that began.
    pub calibrations: usize,
    /// The number of restarts.
    pub restarts: usize,
    /// How many times the link came up.
    pub ups: usize,
    /// It does not answer settings, until it restarts.
    pub deaf: bool,
    due_us: u32,
    flip_flop: bool,
    reset: ResetCause,
    answers: Vec<Payload>,
    /// Number of the last calibration. A request with the same number only gets the answer again.
    calibration: Option<u8>,
}

impl SensorBoard {
    /// A board that has just been switched on.
    #[must_use]
    pub fn new() -> Self {
        Self {
            link: BoardLink::new(Callsign::Sensor, ResetCause::PowerOn, GAP_US),
            state: LineState::OnLine,
            bits: 0b000_0111_0000,
            distance: 255,
            raw: false,
            calibrations: 0,
            restarts: 0,
            ups: 0,
            deaf: false,
            due_us: 0,
            flip_flop: false,
            reset: ResetCause::PowerOn,
            answers: Vec::new(),
            calibration: None,
        }
    }

    /// Restarts the board.
    pub fn restart(&mut self, cause: ResetCause) {
        self.link = BoardLink::new(Callsign::Sensor, cause, GAP_US);
        self.reset = cause;
        self.raw = false;
        self.deaf = false;
        self.restarts += 1;
    }

    /// Sends the reading of one line sensor.
    pub fn tell(&mut self, reading: LineReading) {
        self.answers.push(Payload::LineReading(reading));
    }

    /// Ends the running calibration, in which `sensors` sensors have seen both floor and tape.
    ///
    /// # Panics
    /// When no calibration runs.
    /// When none runs.
    pub fn end_calibration(&mut self, sensors: i16, status: SettingStatus) {
        self.answers.push(Payload::SettingReply(SettingReply {
            key: SettingKey::Calibrate,
            seq: self.calibration.expect("a calibration was asked for"),
            value: sensors,
            status,
        }));
    }

    fn set(&mut self, packet: &Packet) {
        let Payload::Setting(setting) = packet.payload else {
            return;
        };
        if self.deaf {
            return;
        }
        let status = match setting.key {
            SettingKey::RawLine => {
                self.raw = setting.value == 1;
                SettingStatus::Accepted
            }
            SettingKey::Calibrate => {
                if self.calibration.replace(setting.seq) != Some(setting.seq) {
                    self.calibrations += 1;
                }
                SettingStatus::Accepted
            }
            // It plays no robot of its own, and takes whatever it is told.
            SettingKey::Sensors => SettingStatus::Accepted,
            key if SensorProfile::index(key).is_some() => SettingStatus::Accepted,
            _ => SettingStatus::NotHere,
        };
        self.answers.push(answer_to(&setting, status));
    }
}

impl Peer for SensorBoard {
    fn take(&mut self, byte: u8, now_us: u32) {
        match self.link.push(byte, now_us) {
            Some(BoardEvent::Up) => {
                self.ups += 1;
                self.answers.push(Payload::BoardStatus(BoardStatus {
                    reset: self.reset,
                    bad_packets: self.link.bad_packets(),
                    lost_packets: self.link.lost_packets(),
                    refused: 0,
                    exde_errors: 0,
                    servo_timeouts: 0,
                    load_percent: 42,
                    longest_loop_100us: 50,
                }));
            }
            Some(BoardEvent::Packet(packet)) if packet.payload == RESTART => {
                self.restart(ResetCause::Ordered);
            }
            Some(BoardEvent::Packet(packet)) => self.set(&packet),
            None => (),
        }
    }

    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) {
        out.extend(self.link.poll(now_us).into_iter().flatten());
        while let Some(answer) = self.answers.pop() {
            out.extend(self.link.encode(answer).into_iter().flatten());
        }
        if now_us.wrapping_sub(self.due_us) > i32::MAX as u32 {
            return;
        }
        self.due_us = now_us + 10_000;
        self.flip_flop = !self.flip_flop;
        let packets = if self.flip_flop {
            let raw = Payload::RawLine(LineBits::new(self.bits));
            [self.raw.then_some(raw), Some(Payload::Line(self.state))]
        } else {
            [Some(Payload::Distance(Centimetres(self.distance))), None]
        };
        for payload in packets.into_iter().flatten() {
            out.extend(self.link.encode(payload).into_iter().flatten());
        }
    }
}

impl Default for SensorBoard {
    fn default() -> Self {
        Self::new()
    }
}
