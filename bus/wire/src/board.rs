//! Reports of the arm's servos and of a board's own state. Version 1 only.
//!
//! ```text
//! arm data       servo  errors  position low  high  load low  high  decivolts  celsius
//! board status   reset  bad     lost  refused  exde  timeouts  load %  longest loop
//! ```

use crate::bytes::{Bytes, Fault};
use crate::handshake::ResetCause;

/// The index, which is its number - 1, of the servo that moves each joint, the first one of a pair.
/// The ids on the servos' wire are those of [`crate::ArmProfile::servos`].
pub mod servo {
    /// Turns the arm on the robot.
    pub const BASE: usize = 0;
    /// Lifts the upper arm, with the next servo.
    pub const SHOULDER: usize = 1;
    /// Lifts the forearm, with the next servo.
    pub const ELBOW: usize = 3;
    /// Lifts the gripper.
    pub const WRIST: usize = 5;
    /// Turns the gripper.
    pub const ROTATION: usize = 6;
    /// Opens and closes the gripper.
    pub const GRIPPER: usize = 7;
}

/// One servo of the arm, as it last answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ArmData {
    /// The servo's number, 1 to 8, whatever its id is. The receiver refuses other numbers.
    pub servo: u8,
    /// The AX-12's error bits; bit 7 is not one of them and is dropped.
    pub errors: u8,
    /// Position, 0 to 1023, 0.29 degrees each; of a reversed joint turned round. Encoding saturates
    /// it.
    pub position: u16,
    /// Load, -1023 to 1023 of full torque, positive counter-clockwise; of a reversed joint turned
    /// round. Encoding saturates it.
    pub load: i16,
    /// Supply voltage in 0.1 V.
    pub decivolts: u8,
    /// Temperature in degrees Celsius.
    pub celsius: u8,
}

impl ArmData {
    /// How many servos the arm has.
    pub const SERVOS: u8 = 8;
    /// The largest position and the largest load either way.
    pub const LIMIT: u16 = 1023;
    const ERROR_BITS: u8 = 0x7F;

    pub(crate) fn write(self, payload: &mut Bytes) {
        let limit = Self::LIMIT.cast_signed();
        let [position_low, position_high] = self.position.min(Self::LIMIT).to_le_bytes();
        let [load_low, load_high] = self.load.clamp(-limit, limit).to_le_bytes();
        *payload = [
            self.servo,
            self.errors & Self::ERROR_BITS,
            position_low,
            position_high,
            load_low,
            load_high,
            self.decivolts,
            self.celsius,
        ];
    }

    pub(crate) fn read(payload: &Bytes) -> Result<Self, Fault> {
        let [servo, errors, p0, p1, l0, l1, decivolts, celsius] = *payload;
        let position = u16::from_le_bytes([p0, p1]);
        let load = i16::from_le_bytes([l0, l1]);
        if servo == 0 || servo > Self::SERVOS {
            return Err(Fault { index: 0 });
        }
        if errors & !Self::ERROR_BITS != 0 {
            return Err(Fault { index: 1 });
        }
        if position > Self::LIMIT {
            return Err(Fault { index: 3 });
        }
        if load.unsigned_abs() > Self::LIMIT {
            return Err(Fault { index: 5 });
        }
        Ok(Self {
            servo,
            errors,
            position,
            load,
            decivolts,
            celsius,
        })
    }
}

/// The state of a board. The counters run from the board's start and stay at 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BoardStatus {
    /// Why the board started.
    pub reset: ResetCause,
    /// Damaged packets from the Pi.
    pub bad_packets: u8,
    /// Packets from the Pi that never came; there may be more.
    pub lost_packets: u8,
    /// Commands that were refused.
    pub refused: u8,
    /// Line words between the boards that were refused.
    pub exde_errors: u8,
    /// Questions to servos that stayed without an answer.
    pub servo_timeouts: u8,
    /// How much of the time the processor works, 0 to 100 percent. Encoding saturates it.
    pub load_percent: u8,
    /// The longest main loop since the last status, in 0.1 ms.
    pub longest_loop_100us: u8,
}

impl BoardStatus {
    pub(crate) fn write(self, payload: &mut Bytes) {
        *payload = [
            self.reset.code(),
            self.bad_packets,
            self.lost_packets,
            self.refused,
            self.exde_errors,
            self.servo_timeouts,
            self.load_percent.min(100),
            self.longest_loop_100us,
        ];
    }

    pub(crate) fn read(payload: &Bytes) -> Result<Self, Fault> {
        let [
            reset,
            bad_packets,
            lost_packets,
            refused,
            exde_errors,
            servo_timeouts,
            load,
            longest,
        ] = *payload;
        if load > 100 {
            return Err(Fault { index: 6 });
        }
        Ok(Self {
            reset: ResetCause::from_code(reset).ok_or(Fault { index: 0 })?,
            bad_packets,
            lost_packets,
            refused,
            exde_errors,
            servo_timeouts,
            load_percent: load,
            longest_loop_100us: longest,
        })
    }
}
