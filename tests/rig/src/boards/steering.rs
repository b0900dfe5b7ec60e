//! The steering board that tests play: command register, gains, the arm's profile and the reports.
//! A turn takes 300 ms and a step of the arm 100 ms, so that tests are quick.

use core::time::Duration;

use lager_wire::link::{BoardEvent, BoardLink};
use lager_wire::{
    ArmData, ArmProfile, BoardStatus, Callsign, Command, Packet, Payload, Profile, ResetCause,
    Setting, SettingKey, SettingStatus,
};

use super::{Peer, Register};
use crate::GAP_US;
use crate::board::answer_to;

/// A steering board.
pub struct SteeringBoard {
    /// The board's end of the link.
    pub link: BoardLink,
    /// Its command register.
    pub register: Register,
    /// P and D of its regulator.
    pub gains: [i16; 2],
    /// The arm's profile that the bridge sent last.
    pub profile: [u16; ArmProfile::VALUES],
    /// The board uses this profile.
    pub profile_in_force: bool,
    /// The number of restarts.
    pub restarts: usize,
    /// How many times the link came up.
    pub ups: usize,
    /// The number of received packets with a command.
    pub commands: usize,
    reset: ResetCause,
    report_us: u32,
    out: Vec<Payload>,
}

impl SteeringBoard {
    /// A board that has just been switched on.
    #[must_use]
    pub fn new() -> Self {
        Self {
            link: BoardLink::new(Callsign::Steering, ResetCause::PowerOn, GAP_US),
            register: Register::new(Duration::from_millis(300), Duration::from_millis(100)),
            gains: [2, 2],
            profile: [0; ArmProfile::VALUES],
            profile_in_force: false,
            restarts: 0,
            ups: 0,
            commands: 0,
            reset: ResetCause::PowerOn,
            report_us: 0,
            out: Vec::with_capacity(64),
        }
    }

    /// Restarts the board; its record of executed commands stays.
    pub fn restart(&mut self, cause: ResetCause) {
        let executed = std::mem::take(&mut self.register.executed);
        *self = Self {
            link: BoardLink::new(Callsign::Steering, cause, GAP_US),
            restarts: self.restarts + 1,
            ups: self.ups,
            reset: cause,
            ..Self::new()
        };
        self.register.executed = executed;
    }

    /// Whether the wheels turn.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.register.moves()
    }

    /// The number of executed commands.
    #[must_use]
    pub fn count(&self, command: Command) -> usize {
        let executed = self.register.executed.iter();
        executed.filter(|done| **done == command.code()).count()
    }

    /// Runs `work` on the register. If a step of the arm ends meanwhile, reports its servo.
    fn with_register<R>(&mut self, work: impl FnOnce(&mut Register) -> R) -> R {
        let moved = self.register.moves_arm();
        let result = work(&mut self.register);
        if moved && !self.register.moves_arm() {
            self.out.push(Payload::ArmData(ArmData {
                servo: 3,
                errors: 0,
                position: 700,
                load: -12,
                decivolts: 110,
                celsius: 30,
            }));
        }
        result
    }

    fn set_profile(&mut self, setting: &Setting) {
        if setting.key == SettingKey::ArmProfile {
            self.profile_in_force = setting.value == ArmProfile::check(&self.profile);
        } else if let Some(index) = ArmProfile::index(setting.key) {
            self.profile[index] = setting.value.cast_unsigned();
        }
        let last = setting.key == SettingKey::ArmProfile;
        let status = if last && !self.profile_in_force {
            SettingStatus::OutOfRange
        } else {
            SettingStatus::Accepted
        };
        self.out.push(answer_to(setting, status));
    }

    fn set(&mut self, setting: &Setting) {
        let place = match setting.key {
            SettingKey::GainP => 0,
            SettingKey::GainD => 1,
            SettingKey::RawLine | SettingKey::Calibrate => return,
            _ => return self.set_profile(setting),
        };
        let status = if setting.value <= 100 {
            self.gains[place] = setting.value;
            SettingStatus::Accepted
        } else {
            SettingStatus::OutOfRange
        };
        let in_force = Setting {
            value: self.gains[place],
            ..*setting
        };
        self.out.push(answer_to(&in_force, status));
    }

    fn status(&self) -> BoardStatus {
        BoardStatus {
            reset: self.reset,
            bad_packets: self.link.bad_packets(),
            lost_packets: self.link.lost_packets(),
            refused: 1,
            exde_errors: 2,
            servo_timeouts: 3,
            load_percent: 4,
            longest_loop_100us: 5,
        }
    }
}

impl Peer for SteeringBoard {
    fn take(&mut self, byte: u8, now_us: u32) {
        match self.link.push(byte, now_us) {
            Some(BoardEvent::Up) => {
                self.ups += 1;
                self.out.push(Payload::BoardStatus(self.status()));
            }
            Some(BoardEvent::Packet(Packet { payload, .. })) => match payload {
                Payload::SteerCommand(command) => {
                    self.commands += 1;
                    self.with_register(|register| register.take(micros(now_us), command));
                }
                Payload::Setting(setting) => self.set(&setting),
                _ => (),
            },
            None => (),
        }
    }

    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) {
        let report = self.with_register(|register| register.step(micros(now_us)));
        out.extend(self.link.poll(now_us).into_iter().flatten());
        for payload in std::mem::take(&mut self.out) {
            out.extend(self.link.encode(payload).into_iter().flatten());
        }
        if now_us.wrapping_sub(self.report_us) >= 5_000 {
            self.report_us = now_us;
            let report = Payload::SteerData(report);
            out.extend(self.link.encode(report).into_iter().flatten());
        }
    }
}

fn micros(now_us: u32) -> Duration {
    Duration::from_micros(now_us.into())
}

impl Default for SteeringBoard {
    fn default() -> Self {
        Self::new()
    }
}
