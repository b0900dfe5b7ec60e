//! Settings of a board at run time, and its answers (E9, E10). Version 1 only.
//!
//! ```text
//! setting   key  seq  value low  value high  !key    !seq  0  0
//! reply     key  seq  value low  value high  status  0     0  0
//! ```

use crate::coded::coded;
use crate::payload::{Bytes, Fault, unused_from};

coded! {
    /// What can be set.
    pub enum SettingKey {
        /// The line regulator's proportional gain, 0 to 255; 2 at start.
        GainP = 1,
        /// The line regulator's derivative gain, 0 to 255; 2 at start.
        GainD = 2,
        /// 1: the sensor board sends raw line packets too. 0: it does not.
        RawLine = 3,
        /// Starts the line sensor's calibration.
        Calibrate = 4,
    }
}

coded! {
    /// What became of a setting.
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
    /// What is set.
    pub key: SettingKey,
    /// The setting's number, which the answer repeats.
    pub seq: u8,
    /// The value wanted.
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

/// A board's answer to a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SettingReply {
    /// What was to be set.
    pub key: SettingKey,
    /// The number of the setting that is answered.
    pub seq: u8,
    /// The value now in force.
    pub value: i16,
    /// What became of it.
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
