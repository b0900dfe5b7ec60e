//! A steering board: command register, sequence bytes, age limit and reports as the bridge sees
//! them. Turns take 300 ms and arm steps 100 ms, so that tests are quick.

use lager_rig::{GAP_US, answer_to};
use lager_wire::link::{BoardEvent, BoardLink};
use lager_wire::{
    ArmData, ArmProfile, BoardStatus, Callsign, Command, Packet, Payload, ResetCause, Setting,
    SettingKey, SettingStatus, SteerCommand, SteerData, SteerFlags, WheelCommand,
};

use super::board::Peer;

const AGE_LIMIT_US: u32 = 150_000;

pub(crate) struct SteeringBoard {
    pub(crate) link: BoardLink,
    /// The code being executed.
    pub(crate) code: u8,
    /// Every command executed, in order, over restarts.
    pub(crate) executed: Vec<u8>,
    pub(crate) gains: [i16; 2],
    /// The arm's profile as it was told, and whether it is in force.
    pub(crate) profile: [u16; ArmProfile::VALUES],
    pub(crate) profile_in_force: bool,
    /// Takes no profile.
    pub(crate) stubborn: bool,
    pub(crate) restarts: usize,
    /// How often the link came up.
    pub(crate) ups: usize,
    /// The age limit has struck.
    pub(crate) failsafe: bool,
    /// It has struck while the wheels turned.
    pub(crate) halted: bool,
    /// It reports nothing; all else works.
    pub(crate) mute: bool,
    /// How often a packet with a command came.
    pub(crate) commands: usize,
    reset: ResetCause,
    last_seq: Option<u8>,
    heard_us: u32,
    busy_until_us: Option<u32>,
    finished_seq: u8,
    finish: SteerFlags,
    report_us: u32,
    out: Vec<Payload>,
}

impl SteeringBoard {
    pub(crate) fn new() -> Self {
        Self {
            link: BoardLink::new(Callsign::Steering, ResetCause::PowerOn, GAP_US),
            code: 0,
            executed: Vec::with_capacity(1 << 12),
            gains: [2, 2],
            profile: [0; ArmProfile::VALUES],
            profile_in_force: false,
            stubborn: false,
            restarts: 0,
            ups: 0,
            failsafe: false,
            halted: false,
            mute: false,
            commands: 0,
            reset: ResetCause::PowerOn,
            last_seq: None,
            heard_us: 0,
            busy_until_us: None,
            finished_seq: 0,
            finish: SteerFlags::NONE,
            report_us: 0,
            out: Vec::with_capacity(64),
        }
    }

    pub(crate) fn restart(&mut self, cause: ResetCause) {
        *self = Self {
            link: BoardLink::new(Callsign::Steering, cause, GAP_US),
            executed: std::mem::take(&mut self.executed),
            restarts: self.restarts + 1,
            ups: self.ups,
            stubborn: self.stubborn,
            reset: cause,
            ..Self::new()
        };
    }

    /// Whether the wheels turn.
    pub(crate) fn moves(&self) -> bool {
        self.code > 1 && self.code <= 11
    }

    /// How often a command was executed.
    pub(crate) fn count(&self, command: Command) -> usize {
        let code = command.code();
        self.executed.iter().filter(|done| **done == code).count()
    }

    fn command(&mut self, command: SteerCommand, now_us: u32) {
        self.commands += 1;
        self.heard_us = now_us;
        if self.last_seq == Some(command.seq) {
            return;
        }
        self.end(SteerFlags::ABORTED);
        self.last_seq = Some(command.seq);
        self.failsafe = false;
        let meaning = command.command().expect("the bridge sends defined codes");
        let is_arm = matches!(meaning, Command::Arm(_));
        if is_arm && self.moves() {
            self.finished_seq = command.seq;
            self.finish = SteerFlags::REFUSED;
            return;
        }
        self.code = command.code;
        self.executed.push(command.code);
        if meaning.is_one_shot() {
            let lasts = if is_arm { 100_000 } else { 300_000 };
            self.busy_until_us = Some(now_us.wrapping_add(lasts));
        }
    }

    fn end(&mut self, how: SteerFlags) {
        if self.busy_until_us.take().is_some() {
            if matches!(Command::from_code(self.code), Some(Command::Arm(_))) {
                self.out.push(Payload::ArmData(ArmData {
                    servo: 3,
                    errors: 0,
                    position: 700,
                    load: -12,
                    decivolts: 110,
                    celsius: 30,
                }));
            }
            self.finished_seq = self.last_seq.expect("something was executed");
            self.finish = how;
            self.code = WheelCommand::Standby.code();
        }
    }

    fn set_profile(&mut self, setting: &Setting) {
        if setting.key == SettingKey::ArmProfile {
            self.profile_in_force =
                !self.stubborn && setting.value == ArmProfile::check(&self.profile);
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

    fn report(&self) -> SteerData {
        let mut flags = self.finish;
        if self.failsafe {
            flags.insert(SteerFlags::FAILSAFE);
        }
        if self.busy_until_us.is_some() {
            flags.insert(SteerFlags::BUSY);
        }
        let duty = if self.moves() { 100 } else { 0 };
        SteerData {
            code: self.code,
            left_duty: duty,
            right_duty: duty,
            flags,
            line_error: -3,
            finished_seq: self.finished_seq,
            servo_errors: 0,
            battery_decivolts: 111,
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
                Payload::SteerCommand(command) => self.command(command, now_us),
                Payload::Setting(setting) => self.set(&setting),
                _ => (),
            },
            None => (),
        }
    }

    fn step(&mut self, now_us: u32, out: &mut Vec<u8>) {
        if now_us.wrapping_sub(self.heard_us) > AGE_LIMIT_US && self.last_seq.is_some() {
            self.failsafe = true;
            self.halted |= self.moves();
            self.end(SteerFlags::ABORTED);
            self.code = WheelCommand::Standby.code();
        }
        if self
            .busy_until_us
            .is_some_and(|until| now_us.wrapping_sub(until) < u32::MAX / 2)
        {
            self.end(SteerFlags::NONE);
        }
        out.extend(self.link.poll(now_us).into_iter().flatten());
        for payload in std::mem::take(&mut self.out) {
            out.extend(self.link.encode(payload).into_iter().flatten());
        }
        if now_us.wrapping_sub(self.report_us) >= 5_000 {
            self.report_us = now_us;
            // Muted it says something all the same, so that its link stays up.
            let report = match self.mute {
                false => Payload::SteerData(self.report()),
                true => Payload::BoardStatus(self.status()),
            };
            out.extend(self.link.encode(report).into_iter().flatten());
        }
    }
}
