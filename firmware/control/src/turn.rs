//! Timed turns on the spot that end early on tape (W4, AMB-22).
//!
//! ```text
//!                first word: centre off tape
//!   started ------------------------------------.
//!      | first word: centre on tape             v      centre on tape
//!      '--> leaving ------------------------> open ------------------> over
//!             two words off tape in a row       '------- time is up ----^
//! ```
//!
//! Without words from the sensor board a turn is purely timed.

use lager_wire::LineBits;

use crate::line::centre_on_tape;
use crate::time::reached;

/// A full turn at the standard duty takes twelve seconds (W4, `STANDARD_THREESIXTY`).
pub const FULL_TURN_US: u32 = 12_000_000;

/// Words without tape before a turn that began on tape may end on it.
const WORDS_OFF: u8 = 2;

/// Which way a turn goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Counter-clockwise seen from above.
    Left,
    /// Clockwise.
    Right,
}

/// How far a turn goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Angle {
    /// 45 degrees, 1.5 s.
    Diagonal,
    /// 90 degrees, 3 s.
    Perpendicular,
}

impl Angle {
    /// How long the turn lasts at most.
    #[must_use]
    pub const fn duration_us(self) -> u32 {
        match self {
            Self::Diagonal => FULL_TURN_US / 8,
            Self::Perpendicular => FULL_TURN_US / 4,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tape {
    Unknown,
    Leaving { off: u8 },
    Open,
    Found,
}

/// One turn under way.
#[derive(Debug, Clone)]
pub struct Turn {
    way: Way,
    ends_us: u32,
    tape: Tape,
}

impl Turn {
    /// A turn that begins now.
    #[must_use]
    pub fn new(way: Way, angle: Angle, now_us: u32) -> Self {
        Self {
            way,
            ends_us: now_us.wrapping_add(angle.duration_us()),
            tape: Tape::Unknown,
        }
    }

    /// Which way it goes.
    #[must_use]
    pub fn way(&self) -> Way {
        self.way
    }

    /// A word from the sensor board.
    pub fn on_word(&mut self, bits: LineBits) {
        self.tape = match (self.tape, centre_on_tape(bits)) {
            (Tape::Unknown | Tape::Leaving { .. }, true) => Tape::Leaving { off: 0 },
            (Tape::Unknown, false) => Tape::Open,
            (Tape::Leaving { off }, false) if off + 1 < WORDS_OFF => Tape::Leaving { off: off + 1 },
            (Tape::Leaving { .. } | Tape::Open, false) => Tape::Open,
            (Tape::Open | Tape::Found, true) | (Tape::Found, false) => Tape::Found,
        };
    }

    /// Whether it has come to its end.
    #[must_use]
    pub fn is_over(&self, now_us: u32) -> bool {
        self.tape == Tape::Found || reached(now_us, self.ends_us)
    }

    /// When it ends at the latest.
    #[must_use]
    pub fn ends_us(&self) -> u32 {
        self.ends_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: LineBits = LineBits(0b000_0111_0000);
    const ASIDE: LineBits = LineBits(0b110_0000_0000);

    fn words(words: &[LineBits]) -> bool {
        let mut turn = Turn::new(Way::Left, Angle::Perpendicular, 0);
        for word in words {
            turn.on_word(*word);
        }
        turn.is_over(1)
    }

    #[test]
    fn a_turn_is_over_when_its_time_is() {
        for (angle, duration) in [
            (Angle::Diagonal, 1_500_000),
            (Angle::Perpendicular, 3_000_000),
        ] {
            let start = u32::MAX - 1_000;
            let turn = Turn::new(Way::Right, angle, start);
            assert!(!turn.is_over(start));
            assert!(!turn.is_over(start.wrapping_add(duration - 1)));
            assert!(turn.is_over(start.wrapping_add(duration)));
        }
    }

    #[test]
    fn tape_found_ends_it() {
        assert!(!words(&[ASIDE]));
        assert!(words(&[ASIDE, LINE]));
        assert!(words(&[ASIDE, LINE, ASIDE]), "found stays found");
    }

    #[test]
    fn the_tape_it_began_on_must_be_left_for_two_words() {
        assert!(!words(&[LINE, LINE, LINE]));
        assert!(!words(&[LINE, ASIDE, LINE]));
        assert!(!words(&[LINE, ASIDE, LINE, ASIDE, LINE]));
        assert!(!words(&[LINE, ASIDE, ASIDE]));
        assert!(words(&[LINE, ASIDE, ASIDE, LINE]));
    }

    #[test]
    fn only_the_three_centre_sensors_count() {
        for index in 0..11_u8 {
            let bits = LineBits(1 << (10 - index));
            assert_eq!(
                words(&[LineBits(0), bits]),
                (4..=6).contains(&index),
                "sensor {index}"
            );
        }
    }
}
