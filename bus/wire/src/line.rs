//! The sensor board's messages to the Pi: line state, raw line bits, the reading of each line
//! sensor during a calibration, and the distance (U5, U13, AMB-11, AMB-13).
//!
//! ```text
//! line reading   sensor  reading  lowest  highest  tells apart  0 0 0     version 1 only
//! ```

use core::fmt;

use crate::bytes::{Bytes, Fault, unused_from};
use crate::coded::coded;
use crate::handshake::Version;

coded! {
    /// The robot's position on the line (U13), seen from the robot: `LeftOfLine` means that the
    /// robot is to the left of the tape (AMB-19).
    pub enum LineState {
        /// The tape is under the middle of the sensor.
        OnLine = 0,
        /// No tape is under the sensor.
        NotOnLine = 1,
        /// The robot is left of the line.
        LeftOfLine = 2,
        /// The robot is right of the line.
        RightOfLine = 3,
        /// A mark, or a crossing's arm, on the left side only.
        StationToLeft = 4,
        /// A mark, or a crossing's arm, on the right side only.
        StationToRight = 5,
        /// Tape on both sides and the line goes on.
        FourWay = 6,
        /// Tape was on both sides and the line has ended: the delivery bar.
        DropStation = 7,
    }
}

#[cfg(feature = "lager-sample")]
lager_sample::coded_as_is!(LineState {
    OnLine,
    NotOnLine,
    LeftOfLine,
    RightOfLine,
    StationToLeft,
    StationToRight,
    FourWay,
    DropStation,
});

impl LineState {
    pub(crate) fn write(self, payload: &mut Bytes) {
        payload[0] = self.code();
    }

    pub(crate) fn read(version: Version, payload: &Bytes) -> Result<Self, Fault> {
        if version == Version::One {
            unused_from(1, payload)?;
        }
        Self::from_code(payload[0]).ok_or(Fault { index: 0 })
    }
}

/// One reading of the eleven line sensors; a set bit is tape (S6). Bit 10 is the leftmost sensor
/// (AMB-17).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct LineBits(pub u16);

impl LineBits {
    /// The number of sensors in the row (S5).
    pub const SENSORS: u8 = 11;
    /// The bits of the sensors.
    pub const MASK: u16 = (1 << Self::SENSORS) - 1;

    /// A reading from the low eleven bits; the higher bits are dropped.
    pub const fn new(bits: u16) -> Self {
        Self(bits & Self::MASK)
    }

    /// Whether sensor `index` sees tape: 0 is the leftmost, 10 the rightmost. Others see none.
    pub const fn sensor(self, index: u8) -> bool {
        index < Self::SENSORS && self.0 & (1 << (Self::SENSORS - 1 - index)) != 0
    }

    pub(crate) fn write(self, payload: &mut Bytes) {
        payload[..2].copy_from_slice(&Self::new(self.0).0.to_le_bytes());
    }

    pub(crate) fn read(version: Version, payload: &Bytes, given: usize) -> Result<Self, Fault> {
        if given < 2 {
            return Err(Fault { index: 1 });
        }
        if version == Version::One {
            unused_from(2, payload)?;
        }
        let bits = u16::from_le_bytes([payload[0], payload[1]]);
        if bits & !Self::MASK != 0 {
            return Err(Fault { index: 1 });
        }
        Ok(Self(bits))
    }
}

/// The readings of one line sensor in the present calibration, in steps of the converter, 0 to 255;
/// tape reads higher than floor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct LineReading {
    /// The sensor: 0 is the leftmost, 10 the rightmost. The receiver refuses other numbers.
    pub sensor: u8,
    /// The present reading.
    pub reading: u8,
    /// The lowest reading, at most `reading`.
    pub lowest: u8,
    /// The highest reading, at least `reading`.
    pub highest: u8,
    /// Whether the two lie so far apart that the board takes them for floor and tape.
    pub tells_apart: bool,
}

impl LineReading {
    pub(crate) fn write(self, payload: &mut Bytes) {
        payload[..5].copy_from_slice(&[
            self.sensor,
            self.reading,
            self.lowest,
            self.highest,
            self.tells_apart.into(),
        ]);
    }

    pub(crate) fn read(payload: &Bytes) -> Result<Self, Fault> {
        let [sensor, reading, lowest, highest, tells_apart, ..] = *payload;
        if sensor >= LineBits::SENSORS {
            return Err(Fault { index: 0 });
        }
        if lowest > reading {
            return Err(Fault { index: 2 });
        }
        if highest < reading {
            return Err(Fault { index: 3 });
        }
        if tells_apart > 1 {
            return Err(Fault { index: 4 });
        }
        unused_from(5, payload)?;
        Ok(Self {
            sensor,
            reading,
            lowest,
            highest,
            tells_apart: tells_apart == 1,
        })
    }
}

/// A distance in whole centimetres, as the IR sensor gives it (S8, AMB-13).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Centimetres(pub u8);

impl Centimetres {
    /// Nothing in range, or no valid reading.
    pub const NONE: Self = Self(255);

    /// The distance, if there is one.
    pub const fn get(self) -> Option<u8> {
        if self.0 == Self::NONE.0 {
            None
        } else {
            Some(self.0)
        }
    }

    pub(crate) fn write(self, payload: &mut Bytes) {
        payload[0] = self.0;
    }

    pub(crate) fn read(version: Version, payload: &Bytes) -> Result<Self, Fault> {
        if version == Version::One {
            unused_from(1, payload)?;
        }
        Ok(Self(payload[0]))
    }
}

impl fmt::Display for Centimetres {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.get() {
            Some(distance) => write!(formatter, "{distance} cm"),
            None => formatter.write_str("none"),
        }
    }
}
