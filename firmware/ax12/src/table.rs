//! The servo's control table: the addresses of all registers in the original's listing (A3), and
//! the format of the values that this robot uses.
//!
//! Values of two bytes have their low byte at the address named `_L`. Registers 0..=23 keep their
//! values without power, those from [`TORQUE_ENABLE`] on lose them. Addresses 10, 19..=23 and 45
//! are not in today's manual: they have names here, and the robot never writes them (AMB-33).

#![allow(missing_docs)] // The names are the table's own.

pub const MODEL_NUMBER_L: u8 = 0;
pub const MODEL_NUMBER_H: u8 = 1;
pub const VERSION: u8 = 2;
pub const ID: u8 = 3;
pub const BAUD_RATE: u8 = 4;
pub const RETURN_DELAY_TIME: u8 = 5;
pub const CW_ANGLE_LIMIT_L: u8 = 6;
pub const CW_ANGLE_LIMIT_H: u8 = 7;
pub const CCW_ANGLE_LIMIT_L: u8 = 8;
pub const CCW_ANGLE_LIMIT_H: u8 = 9;
pub const SYSTEM_DATA2: u8 = 10;
pub const LIMIT_TEMPERATURE: u8 = 11;
pub const DOWN_LIMIT_VOLTAGE: u8 = 12;
pub const UP_LIMIT_VOLTAGE: u8 = 13;
pub const MAX_TORQUE_L: u8 = 14;
pub const MAX_TORQUE_H: u8 = 15;
pub const RETURN_LEVEL: u8 = 16;
pub const ALARM_LED: u8 = 17;
pub const ALARM_SHUTDOWN: u8 = 18;
pub const OPERATING_MODE: u8 = 19;
pub const DOWN_CALIBRATION_L: u8 = 20;
pub const DOWN_CALIBRATION_H: u8 = 21;
pub const UP_CALIBRATION_L: u8 = 22;
pub const UP_CALIBRATION_H: u8 = 23;
pub const TORQUE_ENABLE: u8 = 24;
pub const LED: u8 = 25;
pub const CW_COMPLIANCE_MARGIN: u8 = 26;
pub const CCW_COMPLIANCE_MARGIN: u8 = 27;
pub const CW_COMPLIANCE_SLOPE: u8 = 28;
pub const CCW_COMPLIANCE_SLOPE: u8 = 29;
pub const GOAL_POSITION_L: u8 = 30;
pub const GOAL_POSITION_H: u8 = 31;
pub const GOAL_SPEED_L: u8 = 32;
pub const GOAL_SPEED_H: u8 = 33;
pub const TORQUE_LIMIT_L: u8 = 34;
pub const TORQUE_LIMIT_H: u8 = 35;
pub const PRESENT_POSITION_L: u8 = 36;
pub const PRESENT_POSITION_H: u8 = 37;
pub const PRESENT_SPEED_L: u8 = 38;
pub const PRESENT_SPEED_H: u8 = 39;
pub const PRESENT_LOAD_L: u8 = 40;
pub const PRESENT_LOAD_H: u8 = 41;
pub const PRESENT_VOLTAGE: u8 = 42;
pub const PRESENT_TEMPERATURE: u8 = 43;
pub const REGISTERED_INSTRUCTION: u8 = 44;
pub const PAUSE_TIME: u8 = 45;
pub const MOVING: u8 = 46;
pub const LOCK: u8 = 47;
pub const PUNCH_L: u8 = 48;
pub const PUNCH_H: u8 = 49;

/// Number of registers.
pub const LENGTH: usize = 50;

/// Highest position; 0..=1023 spans 300 degrees, 0.29 degrees a unit.
pub const MAX_POSITION: u16 = 1023;

/// Goal speed that means "as fast as the servo can" in joint mode (A5, `STANDARD_SPEED`; AMB-31).
pub const FULL_SPEED: u16 = 0;

/// Factory value of [`RETURN_DELAY_TIME`]; one unit is 2 microseconds.
pub const DEFAULT_RETURN_DELAY: u8 = 250;

/// Value of [`BAUD_RATE`] for 1 Mbit/s: bit/s = 2 000 000 / (value + 1).
pub const BAUD_1_MBIT: u8 = 1;

/// Value of [`MODEL_NUMBER_L`] of an AX-12.
pub const MODEL_AX12: u16 = 12;

/// Decodes a present speed or load: ten bits of magnitude, and bit 10 set for clockwise, which is
/// negative here.
///
/// The result is in -1023..=1023.
#[must_use]
pub const fn signed(raw: u16) -> i16 {
    let size = (raw & 0x03FF) as i16;
    if raw & 0x0400 == 0 { size } else { -size }
}

/// Encodes a speed or load of -1023..=1023 for the register; larger magnitudes are limited.
#[must_use]
pub const fn unsigned(value: i16) -> u16 {
    let size = value.unsigned_abs();
    let size = if size > 1023 { 1023 } else { size };
    if value < 0 { size | 0x0400 } else { size }
}
