//! Settings that the Pi sends to a board at run time, and the replies (E9, E10). Version 1 only.
//!
//! ```text
//! setting   key  seq  value low  value high  !key    !seq  0  0
//! reply     key  seq  value low  value high  status  0     0  0
//! ```
//!
//! The keys from [`SettingKey::ArmTorqueLimit`] on are the values of a [`crate::Profile`].

use crate::bytes::{Bytes, Fault, unused_from};
use crate::coded::coded;

coded! {
    /// The name of a setting.
    pub enum SettingKey {
        /// The line regulator's proportional gain, 0 to 255; 2 at start.
        GainP = 1,
        /// The line regulator's derivative gain, 0 to 255; 2 at start.
        GainD = 2,
        /// 1: the sensor board sends raw line packets too. 0: it does not.
        RawLine = 3,
        /// Starts the line sensor's calibration.
        Calibrate = 4,
        /// Puts the arm's profile that was sent before in force. The value is the profile's check
        /// value ([`crate::Profile::check`]).
        ArmProfile = 15,
        /// Torque limit of the arm's servos, 1 to 1023, or 0: they have no torque.
        ArmTorqueLimit = 16,
        /// Load that ends a squeeze, 1 to 1023.
        ArmSqueezeLoad = 17,
        /// Position of the open gripper.
        ArmGripperOpen = 18,
        /// Position of the gripper closed on nothing.
        ArmGripperClosed = 19,
        /// Least position of the base.
        ArmBaseLowest = 20,
        /// Greatest position of the base.
        ArmBaseHighest = 21,
        /// Least position of the shoulder.
        ArmShoulderLowest = 22,
        /// Greatest position of the shoulder.
        ArmShoulderHighest = 23,
        /// Least position of the elbow.
        ArmElbowLowest = 24,
        /// Greatest position of the elbow.
        ArmElbowHighest = 25,
        /// Least position of the wrist.
        ArmWristLowest = 26,
        /// Greatest position of the wrist.
        ArmWristHighest = 27,
        /// Least position of the rotation.
        ArmRotationLowest = 28,
        /// Greatest position of the rotation.
        ArmRotationHighest = 29,
        /// Least position of the gripper.
        ArmGripperLowest = 30,
        /// Greatest position of the gripper.
        ArmGripperHighest = 31,
        /// Position of the base in the neutral pose.
        ArmNeutralBase = 32,
        /// Position of the shoulder in the neutral pose.
        ArmNeutralShoulder = 33,
        /// Position of the elbow in the neutral pose.
        ArmNeutralElbow = 34,
        /// Position of the wrist in the neutral pose.
        ArmNeutralWrist = 35,
        /// Position of the base in the drop pose.
        ArmDropBase = 36,
        /// Position of the shoulder in the drop pose.
        ArmDropShoulder = 37,
        /// Position of the elbow in the drop pose.
        ArmDropElbow = 38,
        /// Position of the wrist in the drop pose.
        ArmDropWrist = 39,
        /// Id of the servo of the base, + 256 if it counts the other way.
        ArmServo1 = 40,
        /// The same of the shoulder, the first of a pair.
        ArmServo2 = 41,
        /// The same of the shoulder, the second of a pair, or 512.
        ArmServo3 = 42,
        /// The same of the elbow, the first of a pair.
        ArmServo4 = 43,
        /// The same of the elbow, the second of a pair, or 512.
        ArmServo5 = 44,
        /// The same of the wrist.
        ArmServo6 = 45,
        /// The same of the rotation.
        ArmServo7 = 46,
        /// The same of the gripper.
        ArmServo8 = 47,
        /// Puts the description of the wheels that was sent before in force.
        Steering = 48,
        /// 1: each motor hangs at the driver of the other side.
        SteeringSwapped = 49,
        /// 1: the left motor turns the other way round.
        SteeringLeftReversed = 50,
        /// 1: the right motor turns the other way round.
        SteeringRightReversed = 51,
        /// Duty of a driving motor, of 255.
        SteeringDuty = 52,
        /// Time of a full turn on the spot, in ms.
        SteeringFullTurn = 53,
        /// 1: a quarter of the battery's voltage is at the board's input.
        SteeringDivider = 54,
        /// Puts the description of the sensors that was sent before in force.
        Sensors = 64,
        /// 1: a line sensor reads high over dark tape. 0: it reads low.
        SensorsDarkHigh = 65,
        /// The IR ranger's model, an [`crate::IrModel`].
        SensorsIrModel = 66,
        /// The near distance of an own curve, in cm ...
        SensorsNearCm = 67,
        /// ... and what the ranger reads there.
        SensorsNearAdc = 68,
        /// The far distance of an own curve, in cm ...
        SensorsFarCm = 69,
        /// ... and what the ranger reads there.
        SensorsFarAdc = 70,
    }
}

coded! {
    /// The result of a setting.
    pub enum SettingStatus {
        /// It is in force.
        Accepted = 0,
        /// The value is not allowed; the old one stays.
        OutOfRange = 1,
        /// This board has no such setting.
        NotHere = 2,
    }
}

/// A setting to a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Setting {
    /// The setting's name.
    pub key: SettingKey,
    /// The setting's number, which the reply repeats.
    pub seq: u8,
    /// The new value.
    pub value: i16,
}

impl Setting {
    pub(crate) fn write(self, payload: &mut Bytes) {
        let key = self.key.code();
        let [low, high] = self.value.to_le_bytes();
        *payload = [key, self.seq, low, high, !key, !self.seq, 0, 0];
    }

    pub(crate) fn read(payload: &Bytes) -> Result<Self, Fault> {
        let key = SettingKey::from_code(payload[0]).ok_or(Fault { index: 0 })?;
        if payload[4] != !payload[0] {
            return Err(Fault { index: 4 });
        }
        if payload[5] != !payload[1] {
            return Err(Fault { index: 5 });
        }
        unused_from(6, payload)?;
        Ok(Self {
            key,
            seq: payload[1],
            value: i16::from_le_bytes([payload[2], payload[3]]),
        })
    }
}

/// A board's reply to a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SettingReply {
    /// The setting's name.
    pub key: SettingKey,
    /// The number of the setting that this answers.
    pub seq: u8,
    /// The value now in force.
    pub value: i16,
    /// The result.
    pub status: SettingStatus,
}

impl SettingReply {
    pub(crate) fn write(self, payload: &mut Bytes) {
        let [low, high] = self.value.to_le_bytes();
        let (key, status) = (self.key.code(), self.status.code());
        *payload = [key, self.seq, low, high, status, 0, 0, 0];
    }

    pub(crate) fn read(payload: &Bytes) -> Result<Self, Fault> {
        unused_from(5, payload)?;
        Ok(Self {
            key: SettingKey::from_code(payload[0]).ok_or(Fault { index: 0 })?,
            seq: payload[1],
            value: i16::from_le_bytes([payload[2], payload[3]]),
            status: SettingStatus::from_code(payload[4]).ok_or(Fault { index: 4 })?,
        })
    }
}
