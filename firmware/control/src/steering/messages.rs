//! Chooses the steering board's next message to the Pi, and makes it.
//!
//! ```text
//!   states of servos --> ends of commands --> answers to settings --> board status --> report
//!   '------------------- as soon as the UART takes them ----------------------------'  when it
//!                                                                                      is idle
//! ```
//!
//! A servo's state goes out before the end of the command that moved it, so a Pi that hears the end
//! already knows where the arm is.

use lager_wire::{BoardStatus, Command, Payload, SteerData, SteerFlags};

use super::SteeringUnit;
use super::ends::{End, Ends};
use crate::follow::Lost;
use crate::replies::Replies;
use crate::time::{first, reached};
use crate::wheels::STILL;
use crate::{Motor, SteeringBoard, UART_POLL_US};

/// What the Pi has not heard yet, and when the regular messages are due.
#[derive(Debug, Clone)]
pub(super) struct Reports {
    pub(super) ends: Ends,
    pub(super) replies: Replies,
    pub(super) status_wanted: bool,
    pub(super) status_due_us: u32,
    pub(super) data_due_us: u32,
}

impl Reports {
    pub(super) const fn new(now_us: u32) -> Self {
        Self {
            ends: Ends::new(),
            replies: Replies::new(),
            status_wanted: false,
            status_due_us: now_us,
            data_due_us: now_us,
        }
    }
}

impl SteeringUnit {
    pub(super) fn report<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) {
        self.outbox.flush(board);
        if self.outbox.is_empty()
            && let Some(syn) = self.link.poll(now_us)
        {
            self.outbox.send(board, syn);
        }
        if !self.link.is_up() {
            return;
        }
        if reached(now_us, self.reports.status_due_us) {
            self.reports.status_wanted = true;
        }
        // One packet each time, because the wheels wait while it is made.
        if self.outbox.is_empty()
            && let Some(payload) = self.next_payload(board, now_us)
            && let Some(packet) = self.link.encode(payload)
        {
            self.outbox.send(board, packet);
        }
    }

    /// The most urgent message. All but the regular report go out as soon as the UART takes them.
    /// The report waits until the line is free, so that it is new when it arrives.
    fn next_payload<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) -> Option<Payload> {
        if let Some(arm_data) = self.arm.take_report() {
            return Some(Payload::ArmData(arm_data));
        }
        if self.reports.ends.tell_next() {
            return Some(Payload::SteerData(self.steer_data(board, now_us)));
        }
        if let Some(reply) = self.reports.replies.pop() {
            return Some(Payload::SettingReply(reply));
        }
        if core::mem::take(&mut self.reports.status_wanted) {
            return Some(Payload::BoardStatus(self.board_status(board, now_us)));
        }
        if reached(now_us, self.reports.data_due_us) && board.uart_idle() {
            return Some(Payload::SteerData(self.steer_data(board, now_us)));
        }
        None
    }

    fn steer_data<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) -> SteerData {
        self.reports.data_due_us = now_us.wrapping_add(self.config.report_period_us);
        let (left, right) = self.wheels.pulses().mean(self.motors.unwrap_or(STILL));
        // Without a divider the input floats, and 0 means that nothing is known.
        let battery_decivolts = if self.divider {
            board.battery_decivolts()
        } else {
            0
        };
        self.supply.observe(battery_decivolts);
        let finish = self.reports.ends.told();
        SteerData {
            code: self.code(),
            left_duty: left.duty,
            right_duty: right.duty,
            flags: self.flags(left, right, finish.end),
            line_error: self.line.reader.error(),
            finished_seq: finish.seq,
            servo_errors: self.arm.errors(),
            battery_decivolts,
        }
    }

    /// The code of the command that runs; 0 before the first command.
    fn code(&self) -> u8 {
        if self.register.copy().is_none() {
            return 0;
        }
        match self.arm_running.or(self.arm_waiting) {
            Some(order) => Command::Arm(order.command).code(),
            None => Command::Wheel(self.wheels.command()).code(),
        }
    }

    fn flags(&self, left: Motor, right: Motor, end: End) -> SteerFlags {
        let mut flags = SteerFlags::NONE;
        let busy = self.wheels.is_turning() || self.arm_is_active();
        let lost = self.wheels.lost();
        let words_come = self.line.fresh_since_us.is_some() && lost != Some(Lost::Words);
        for (holds, flag) in [
            (left.reverse, SteerFlags::LEFT_REVERSE),
            (right.reverse, SteerFlags::RIGHT_REVERSE),
            (self.arm_is_locked(), SteerFlags::ARM_LOCKED),
            (words_come, SteerFlags::EXDE_OK),
            (
                self.age.is_expired() || lost.is_some(),
                SteerFlags::FAILSAFE,
            ),
            (end == End::Aborted, SteerFlags::ABORTED),
            (end == End::Refused, SteerFlags::REFUSED),
            (busy, SteerFlags::BUSY),
        ] {
            if holds {
                flags.insert(flag);
            }
        }
        flags
    }

    fn board_status<B: SteeringBoard>(&mut self, board: &B, now_us: u32) -> BoardStatus {
        self.reports.status_due_us = now_us.wrapping_add(self.config.status_period_us);
        let (load_percent, longest_loop_100us) = self.load.report(now_us);
        BoardStatus {
            reset: self.reset,
            bad_packets: self.link.bad_packets(),
            lost_packets: self.link.lost_packets(),
            refused: self.refused,
            exde_errors: board.exde_errors(),
            servo_timeouts: self.arm.timeouts(),
            load_percent,
            longest_loop_100us,
        }
    }

    /// When the next report is due. An overdue report only waits for the UART.
    pub(super) fn report_due_us(&self, now_us: u32) -> Option<u32> {
        let due_us = first(now_us, self.reports.data_due_us, self.reports.status_due_us);
        let waits = !self.outbox.is_empty() || reached(now_us, due_us);
        Some(if waits {
            now_us.wrapping_add(UART_POLL_US)
        } else {
            due_us
        })
    }
}
