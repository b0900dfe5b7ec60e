//! Commands to the steering board, and its reports (U7, AMB-4, AMB-12).
//!
//! ```text
//! steercomm   version 1   code  seq  !code  !seq  0  0  0  0
//!             original    code  0    0      0     0  0  0  0     or eight characters '0' and '1'
//! steerdata   version 1   code  left right  flags error finished servo battery
//!             original    code  left right  flags error (drops)  servo battery
//! ```
//!
//! With the complements, noise cannot move the robot even if a CRC is right by chance.

use core::time::Duration;

use crate::bytes::{Bytes, Fault, PAYLOAD_LENGTH, unused_from};
use crate::command::Command;
use crate::handshake::Version;
use crate::text::binary_digits;

/// How long a version-1 steering board obeys a command that the Pi does not repeat.
pub const COMMAND_AGE: Duration = Duration::from_millis(150);

/// A command to the steering board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SteerCommand {
    /// The firmware code. It may be one that is in no list: the board must get it to count it
    /// (AMB-52).
    pub code: u8,
    /// The command's number: the same number renews the command's age, a new number is a new
    /// command. 0 to and from an original board, which has no numbers.
    pub seq: u8,
}

impl SteerCommand {
    /// The command that the code means, if it means one.
    pub const fn command(self) -> Option<Command> {
        Command::from_code(self.code)
    }

    pub(crate) fn write(self, version: Version, payload: &mut Bytes) {
        payload[0] = self.code;
        if version == Version::One {
            payload[1] = self.seq;
            payload[2] = !self.code;
            payload[3] = !self.seq;
        }
    }

    pub(crate) fn read(version: Version, payload: &Bytes, given: usize) -> Result<Self, Fault> {
        if version == Version::Original {
            let text = if given == PAYLOAD_LENGTH {
                binary_digits(payload)
            } else {
                None
            };
            // '0' and '1' are neither wheel nor arm codes, so the two forms cannot be confused.
            return Ok(Self {
                code: text.unwrap_or(payload[0]),
                seq: 0,
            });
        }
        if payload[2] != !payload[0] {
            return Err(Fault { index: 2 });
        }
        if payload[3] != !payload[1] {
            return Err(Fault { index: 3 });
        }
        unused_from(4, payload)?;
        Ok(Self {
            code: payload[0],
            seq: payload[1],
        })
    }
}

/// The steering board's present conditions, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct SteerFlags(pub u8);

impl SteerFlags {
    /// No condition holds.
    pub const NONE: Self = Self(0);
    /// The left wheel pair runs backwards.
    pub const LEFT_REVERSE: Self = Self(1);
    /// The right wheel pair runs backwards.
    pub const RIGHT_REVERSE: Self = Self(2);
    /// The arm lock is closed (T4).
    pub const ARM_LOCKED: Self = Self(4);
    /// Line words arrive from the sensor board, and the board has not given up following for lack
    /// of them.
    pub const EXDE_OK: Self = Self(8);
    /// The board has stopped by itself: the command grew too old, or the board lost the line that
    /// it followed. In the second case the command has ended (`ABORTED` under its number), and only
    /// another command turns the wheels again. Without `EXDE_OK` no words came; with it, they
    /// showed no tape.
    pub const FAILSAFE: Self = Self(16);
    /// The command numbered `finished_seq` was ended early.
    pub const ABORTED: Self = Self(32);
    /// The command numbered `finished_seq` was refused.
    pub const REFUSED: Self = Self(64);
    /// A command that runs once is under way.
    pub const BUSY: Self = Self(128);

    /// Whether all conditions in `others` hold.
    pub const fn contains(self, others: Self) -> bool {
        self.0 & others.0 == others.0
    }

    /// Adds the conditions in `others`.
    pub const fn insert(&mut self, others: Self) {
        self.0 |= others.0;
    }

    /// These conditions and those in `others`.
    #[must_use]
    pub const fn with(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }
}

/// The steering board's report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct SteerData {
    /// The firmware code of the present command; 0 before the first.
    pub code: u8,
    /// Duty of the left wheel pair, 0 to 255 of full on (AMB-23).
    pub left_duty: u8,
    /// Duty of the right wheel pair, 0 to 255 of full on.
    pub right_duty: u8,
    /// The present conditions.
    pub flags: SteerFlags,
    /// The line's offset in half sensor steps, -10 to 10, positive when the line is to the right
    /// (AMB-20). Encoding saturates it.
    pub line_error: i8,
    /// The `seq` of the last command that ran to its end, was ended early or was refused. Always 0
    /// from an original board.
    pub finished_seq: u8,
    /// One bit per servo, servo 1 in bit 0: it reports an error or does not answer.
    pub servo_errors: u8,
    /// Battery voltage in 0.1 V; 0 is unknown.
    pub battery_decivolts: u8,
}

impl SteerData {
    /// The largest line error either way: the outermost sensor, five steps of two halves.
    pub const LINE_ERROR_LIMIT: i8 = 10;

    pub(crate) fn write(self, version: Version, payload: &mut Bytes) {
        let error = saturated(self.line_error);
        let finished = match version {
            Version::Original => 0,
            Version::One => self.finished_seq,
        };
        *payload = [
            self.code,
            self.left_duty,
            self.right_duty,
            self.flags.0,
            error.to_le_bytes()[0],
            finished,
            self.servo_errors,
            self.battery_decivolts,
        ];
    }

    /// Nothing documents the meaning of an original board's eight bytes (AMB-12), so none is
    /// refused. Version 1 checks code and line error.
    pub(crate) fn read(version: Version, payload: &Bytes) -> Result<Self, Fault> {
        let [
            code,
            left_duty,
            right_duty,
            flags,
            error,
            finished,
            servo_errors,
            battery,
        ] = *payload;
        let line_error = i8::from_le_bytes([error]);
        if version == Version::One {
            if code != 0 && Command::from_code(code).is_none() {
                return Err(Fault { index: 0 });
            }
            if line_error != saturated(line_error) {
                return Err(Fault { index: 4 });
            }
        }
        Ok(Self {
            code,
            left_duty,
            right_duty,
            flags: SteerFlags(flags),
            line_error: saturated(line_error),
            finished_seq: match version {
                Version::Original => 0,
                Version::One => finished,
            },
            servo_errors,
            battery_decivolts: battery,
        })
    }
}

fn saturated(line_error: i8) -> i8 {
    line_error.clamp(-SteerData::LINE_ERROR_LIMIT, SteerData::LINE_ERROR_LIMIT)
}
