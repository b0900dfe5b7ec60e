//! Takes in the Pi's commands and settings, and carries them out or refuses them.
//!
//! ```text
//!   byte --> link --> command, new --> register --> wheel: at once
//!                 |           |                 '-> arm: only in standby, after the one before
//!                 |           '-- repeated: renews its age
//!                 '-> setting --> gain, answered
//!                             '-> arm's profile: value by value, answered --> in force as a whole
//! ```

use lager_wire::link::BoardEvent;
use lager_wire::{
    ArmProfile, Command, Payload, Setting, SettingKey, SettingReply, SettingStatus, SteerCommand,
    WheelCommand,
};

use super::ends::{End, Finish};
use super::{ArmOrder, SteeringUnit};
use crate::register::Receipt;
use crate::{MOST_BYTES, SteeringBoard};

impl SteeringUnit {
    pub(super) fn listen<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) {
        for _ in 0..MOST_BYTES {
            let Some(byte) = board.uart_read() else {
                return;
            };
            self.follow(board, now_us);
            match self.link.push(byte, now_us) {
                None => {}
                Some(BoardEvent::Up) => self.greet(now_us),
                Some(BoardEvent::Packet(packet)) => match packet.payload {
                    Payload::SteerCommand(command) => self.receive(command, now_us),
                    Payload::Setting(setting) => {
                        let reply = self.set(setting);
                        self.reports.replies.push(reply);
                    }
                    _ => self.count_refused(),
                },
            }
        }
    }

    /// The Pi has connected, for the first time or again: it hears everything.
    fn greet(&mut self, now_us: u32) {
        self.reports.status_wanted = true;
        self.reports.data_due_us = now_us;
        self.arm.tell_all();
    }

    fn receive(&mut self, command: SteerCommand, now_us: u32) {
        match self.register.receive(command) {
            Receipt::Renewed => self.age.renew(now_us),
            Receipt::AlreadyRefused => {}
            Receipt::New => {
                if let Some(command) = self.register.take() {
                    self.dispatch(command, now_us);
                }
            }
        }
    }

    fn dispatch(&mut self, command: SteerCommand, now_us: u32) {
        match command.command() {
            Some(Command::Wheel(wheel)) => {
                self.accept(now_us);
                self.standby_seen |= wheel == WheelCommand::Standby;
                self.wheels.start(wheel, command.seq, now_us);
            }
            Some(Command::Arm(arm)) if !self.arm_is_locked() => {
                self.accept(now_us);
                self.arm_waiting = Some(ArmOrder {
                    command: arm,
                    seq: command.seq,
                });
            }
            Some(Command::Arm(_)) | None => {
                self.register.refuse();
                self.count_refused();
                self.end(command.seq, End::Refused, now_us);
            }
        }
    }

    fn accept(&mut self, now_us: u32) {
        self.register.accept();
        self.age.renew(now_us);
        self.break_off(now_us);
    }

    /// Ends every command that runs once. An arm command ends later, when its servos have stopped.
    pub(super) fn break_off(&mut self, now_us: u32) {
        if let Some(seq) = self.wheels.abort_turn() {
            self.end(seq, End::Aborted, now_us);
        }
        if let Some(order) = self.arm_waiting.take() {
            self.end(order.seq, End::Aborted, now_us);
        }
        self.arm.abort();
    }

    pub(super) fn end(&mut self, seq: u8, end: End, now_us: u32) {
        self.reports.ends.push(Finish { seq, end });
        self.reports.data_due_us = now_us;
    }

    pub(super) fn count_refused(&mut self) {
        self.refused = self.refused.saturating_add(1);
    }

    fn set(&mut self, setting: Setting) -> SettingReply {
        let (value, status) = match setting.key {
            SettingKey::GainP | SettingKey::GainD => self.set_gain(setting),
            SettingKey::ArmProfile => self.put_profile_in_force(setting.value),
            key => match ArmProfile::index(key) {
                Some(index) => self.put_aside(index, setting.value),
                None => (0, SettingStatus::NotHere),
            },
        };
        SettingReply {
            key: setting.key,
            seq: setting.seq,
            value,
            status,
        }
    }

    fn set_gain(&mut self, setting: Setting) -> (i16, SettingStatus) {
        let mut gains = self.line.pd.gains();
        let gain = match setting.key {
            SettingKey::GainP => &mut gains.p,
            _ => &mut gains.d,
        };
        let Ok(value) = u8::try_from(setting.value) else {
            return (i16::from(*gain), SettingStatus::OutOfRange);
        };
        *gain = value;
        self.line.pd.set_gains(gains);
        self.store.save([gains.p, gains.d]);
        (setting.value, SettingStatus::Accepted)
    }

    /// Keeps one value of the profile that the Pi is sending; it is not in force yet.
    fn put_aside(&mut self, index: usize, value: i16) -> (i16, SettingStatus) {
        match u16::try_from(value) {
            Ok(told) => {
                self.profile[index] = told;
                (value, SettingStatus::Accepted)
            }
            Err(_) => (self.profile[index].cast_signed(), SettingStatus::OutOfRange),
        }
    }

    /// The Pi has sent all values. Obeys the profile if it arrived whole and an arm can obey it.
    fn put_profile_in_force(&mut self, check: i16) -> (i16, SettingStatus) {
        if check == ArmProfile::check(&self.profile) && ArmProfile::is_sound(&self.profile) {
            self.arm.set_profile(ArmProfile::from_values(&self.profile));
            return (check, SettingStatus::Accepted);
        }
        let in_force = ArmProfile::check(&self.arm.profile().values());
        (in_force, SettingStatus::OutOfRange)
    }
}
