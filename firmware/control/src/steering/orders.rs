//! Takes in the Pi's commands and settings, and carries them out or refuses them.
//!
//! ```text
//!   byte --> link --> command, new --> register --> wheel: at once
//!                 |           |                 '-> arm: only in standby, after the one before
//!                 |           '-- repeated: renews its age
//!                 '-> setting --> gain, answered
//!                             '-> arm, robot: value by value, answered --> in force as a whole
//! ```

use lager_wire::link::BoardEvent;
use lager_wire::{
    Command, Payload, Profile, Setting, SettingKey, SettingReply, SettingStatus, SteerCommand,
    SteeringProfile, WheelCommand,
};

use super::ends::{End, Finish};
use super::{ArmOrder, SteeringUnit};
use crate::register::Receipt;
use crate::sides::Sides;
use crate::told::{self, Answer};
use crate::{MOST_BYTES, Motor, SteeringBoard};

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
                        let reply = self.set(setting, now_us);
                        self.reports.replies.push(reply);
                    }
                    Payload::Reset(order) => {
                        board.set_motors(Motor::OFF, Motor::OFF);
                        board.reset(order);
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

    fn set(&mut self, setting: Setting, now_us: u32) -> SettingReply {
        let (value, status) = match setting.key {
            SettingKey::GainP | SettingKey::GainD => self.set_gain(setting),
            _ => self
                .hear_arm(setting)
                .unwrap_or_else(|| self.hear_robot(setting, now_us)),
        };
        SettingReply {
            key: setting.key,
            seq: setting.seq,
            value,
            status,
        }
    }

    /// Takes in a value of the arm's profile, which counts once it is whole.
    fn hear_arm(&mut self, setting: Setting) -> Option<Answer> {
        let (answer, profile) = self.told_arm.hear(setting, self.arm.profile())?;
        if let Some(profile) = profile {
            self.arm.set_profile(profile);
        }
        Some(answer)
    }

    /// Takes in what the Pi tells of the robot, which counts once it is whole. If it is not what was
    /// in force, the wheels' command ends: it was given for another robot. Other wheels, whose
    /// motors may be swapped or reversed now, have their bias to learn.
    fn hear_robot(&mut self, setting: Setting, now_us: u32) -> Answer {
        let robot = self.robot();
        let Some((answer, told)) = self.told.hear(setting, &robot) else {
            return (0, SettingStatus::NotHere);
        };
        if let Some(told) = told
            && told != robot
        {
            self.break_off(now_us);
            if told.wheels != robot.wheels {
                self.line.sides = Sides::new();
                self.sides_store.save([0; 2]);
            }
            self.wheels.set_profile(told.wheels);
            self.divider = told.divider;
        }
        if let Some(told) = told {
            self.robot_store.save(told::kept(&told.told()));
        }
        answer
    }

    fn robot(&self) -> SteeringProfile {
        SteeringProfile {
            wheels: *self.wheels.profile(),
            divider: self.divider,
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
}
