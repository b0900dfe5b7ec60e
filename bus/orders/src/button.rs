//! How the robot's own buttons are connected, and what their lines show.
//!
//! ```text
//!                     rests    pressed, or at "drives by itself"
//!   closed = low      high     low      the contact pulls the line to ground
//!   closed = high     low      high     the contact pulls it to 3.3 V
//! ```
//! A contact that is closed drives its line. So a broken cable looks like a button that nobody
//! presses, and like a switch that stands at manual.

use serde::{Deserialize, Serialize};

/// A level of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Ground.
    #[default]
    Low,
    /// 3.3 V.
    High,
}

impl Level {
    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Low => Self::High,
            Self::High => Self::Low,
        }
    }
}

/// A contact at a line of the Pi.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contact {
    /// The line's offset on its chip, the number of the Pi's GPIO.
    pub line: u8,
    /// Where the closed contact pulls the line.
    pub closed: Level,
}

/// What a mode switch tells by its contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SwitchKind {
    /// A switch that stays where it is moved: its position is the mode.
    #[default]
    Position,
    /// A button that springs back: each press toggles the mode.
    Press,
}

/// The buttons of a robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Buttons {
    /// The number of their chip, as in `/dev/gpiochip0`.
    pub chip: u8,
    /// The reset button.
    pub reset: Option<Contact>,
    /// The mode switch or mode button.
    pub mode: Option<(Contact, SwitchKind)>,
}

/// What the first 32 lines of a chip show. A line that nothing drives is open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Levels {
    /// A bit for each line that something pulls to ground.
    pub low: u32,
    /// A bit for each line that something pulls to 3.3 V.
    pub high: u32,
}

impl Levels {
    /// How many lines there are.
    pub const LINES: u8 = 32;

    /// What a line shows; `None` if it is open.
    pub const fn of(&self, line: u8) -> Option<Level> {
        if line >= Self::LINES {
            return None;
        }
        match (self.low >> line & 1, self.high >> line & 1) {
            (1, 0) => Some(Level::Low),
            (0, 1) => Some(Level::High),
            _ => None,
        }
    }

    /// A line shows this from now on.
    pub const fn set(&mut self, line: u8, level: Option<Level>) {
        if line >= Self::LINES {
            return;
        }
        let bit = 1 << line;
        self.low &= !bit;
        self.high &= !bit;
        match level {
            Some(Level::Low) => self.low |= bit,
            Some(Level::High) => self.high |= bit,
            None => {}
        }
    }

    /// A bit for each line that shows something else there.
    pub const fn differ(&self, there: &Self) -> u32 {
        (self.low ^ there.low) | (self.high ^ there.high)
    }
}

/// The numbers of the lines with a bit, in rising order.
pub fn lines(bits: u32) -> impl Iterator<Item = u8> {
    (0..Levels::LINES).filter(move |line| bits >> line & 1 != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_low_high_or_open() {
        let mut levels = Levels::default();
        for level in [Some(Level::Low), Some(Level::High), None] {
            levels.set(31, level);
            assert_eq!((levels.of(31), levels.of(30)), (level, None));
        }
        let before = levels;
        levels.set(4, Some(Level::High));
        levels.set(17, Some(Level::Low));
        assert!(lines(levels.differ(&before)).eq([4, 17]));
        assert_eq!(levels.differ(&levels), 0);
    }
}
