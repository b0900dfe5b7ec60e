//! The command register of a played steering board: how commands change the reports that it sends.
//!
//! ```text
//!   new number: execute    same number: renew    150 ms without a command: stand, report FAILSAFE
//! ```

use core::time::Duration;

use lager_wire::{Command, SteerCommand, SteerData, SteerFlags, WheelCommand};

/// A command that was not renewed for this time ends.
const AGE_LIMIT: Duration = Duration::from_millis(150);
const STANDBY: u8 = WheelCommand::Standby.code();

/// The command register of a steering board.
#[derive(Clone, Debug)]
pub struct Register {
    /// The code of the command that is executed; 0 before the first one.
    pub code: u8,
    /// The number of the last command.
    pub last_seq: Option<u8>,
    /// The age limit has ended the command.
    pub failsafe: bool,
    /// The age limit has ended the command while the wheels turned.
    pub halted: bool,
    /// The number of the last command that has ended.
    pub finished_seq: u8,
    /// How that command ended, as flags of the report.
    pub finish: SteerFlags,
    /// The code of every executed command, in order.
    pub executed: Vec<u8>,
    /// The number of one-shot commands that ran to their end.
    pub completed: usize,
    heard: Duration,
    ends: Option<Duration>,
    lasts: [Duration; 2],
}

impl Register {
    /// A register with these durations of a turn and of a step of the arm.
    #[must_use]
    pub fn new(turn: Duration, arm: Duration) -> Self {
        Self {
            code: 0,
            last_seq: None,
            failsafe: false,
            halted: false,
            finished_seq: 0,
            finish: SteerFlags::NONE,
            executed: Vec::with_capacity(1 << 12),
            completed: 0,
            heard: Duration::ZERO,
            ends: None,
            lasts: [turn, arm],
        }
    }

    /// Whether the wheels turn.
    #[must_use]
    pub fn moves(&self) -> bool {
        matches!(Command::from_code(self.code), Some(Command::Wheel(_))) && self.code != STANDBY
    }

    /// Whether a step of the arm runs.
    #[must_use]
    pub fn moves_arm(&self) -> bool {
        self.ends.is_some() && matches!(Command::from_code(self.code), Some(Command::Arm(_)))
    }

    /// Takes a command that came at `now`.
    ///
    /// # Panics
    /// When its code is not defined: no bridge sends such a command.
    pub fn take(&mut self, now: Duration, command: SteerCommand) {
        self.heard = now;
        if self.last_seq == Some(command.seq) {
            return;
        }
        self.end(SteerFlags::ABORTED);
        self.last_seq = Some(command.seq);
        self.failsafe = false;
        let meaning = command.command().expect("a bridge sends defined codes");
        let is_arm = matches!(meaning, Command::Arm(_));
        if is_arm && self.moves() {
            self.finished_seq = command.seq;
            self.finish = SteerFlags::REFUSED;
            return;
        }
        self.code = command.code;
        self.executed.push(command.code);
        if meaning.is_one_shot() {
            self.ends = Some(now + self.lasts[usize::from(is_arm)]);
        }
    }

    /// Ends the one-shot command that runs, if there is one.
    pub fn end(&mut self, how: SteerFlags) {
        if self.ends.take().is_some() {
            self.finished_seq = self.last_seq.unwrap_or_default();
            self.finish = how;
            self.code = STANDBY;
        }
    }

    /// Does what is due at `now`, and returns the board's report.
    pub fn step(&mut self, now: Duration) -> SteerData {
        if now.saturating_sub(self.heard) > AGE_LIMIT && self.last_seq.is_some() {
            self.failsafe = true;
            self.halted |= self.moves();
            self.end(SteerFlags::ABORTED);
            self.code = STANDBY;
        }
        if self.ends.is_some_and(|end| end <= now) {
            self.end(SteerFlags::NONE);
            self.completed += 1;
        }
        let mut flags = self.finish;
        if self.failsafe {
            flags.insert(SteerFlags::FAILSAFE);
        }
        if self.ends.is_some() {
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
