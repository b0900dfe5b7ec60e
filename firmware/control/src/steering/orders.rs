//! What the Pi says: commands and settings, taken in, carried out or refused.
//!
//! ```text
//!   byte --> link --> command, new --> register --> wheel: at once
//!                 |           |                 '-> arm: only in standby, when the one before has ended
//!                 |           '-- repeated: renews its age
//!                 '-> setting --> gain, answered
//! ```

use lager_wire::link::BoardEvent;
use lager_wire::{
    Command, Payload, Setting, SettingKey, SettingReply, SettingStatus, SteerCommand,
};

use super::ends::{End, Finish};
use super::{ArmOrder, SteeringUnit};
use crate::pd::Gains;
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

    /// The Pi has just come, or come again: it is told everything.
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
                self.wheels.start(wheel, command.seq);
            }
            Some(Command::Arm(arm)) if self.wheels.is_standby() => {
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

    /// Ends everything that runs once. The arm's end follows when its servos have been stopped.
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

    fn count_refused(&mut self) {
        self.refused = self.refused.saturating_add(1);
    }

    fn set(&mut self, setting: Setting) -> SettingReply {
        let gains = self.line.pd.gains();
        let (in_force, changed) = match setting.key {
            SettingKey::GainP => (
                gains.p,
                u8::try_from(setting.value).map(|p| (p, Gains { p, ..gains })),
            ),
            SettingKey::GainD => (
                gains.d,
                u8::try_from(setting.value).map(|d| (d, Gains { d, ..gains })),
            ),
            SettingKey::RawLine | SettingKey::Calibrate => {
                return SettingReply {
                    key: setting.key,
                    seq: setting.seq,
                    value: 0,
                    status: SettingStatus::NotHere,
                };
            }
        };
        let (value, status) = match changed {
            Ok((value, gains)) => {
                self.line.pd.set_gains(gains);
                self.store.save([gains.p, gains.d]);
                (value, SettingStatus::Accepted)
            }
            Err(_) => (in_force, SettingStatus::OutOfRange),
        };
        SettingReply {
            key: setting.key,
            seq: setting.seq,
            value: i16::from(value),
            status,
        }
    }
}
