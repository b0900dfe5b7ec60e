//! Timed turns on the spot that end early on tape (W4, AMB-22).
//!
//! ```text
//!                first word: centre off tape
//!   started ------------------------------------.
//!      | first word: centre on tape             v      centre on tape
//!      '--> leaving ------------------------> open ------------------> over
//!             off tape for 5 ms                 '------- time is up ----^
//! ```
//!
//! Without words from the sensor board only the time ends a turn. With words, a turn that has not
//! seen its tape gets three eighths of its time more: motors and batteries differ, and a robot that
//! turns too little stands without a line.

use lager_wire::LineBits;

use crate::line::centre_on_tape;
use crate::time::reached;

/// A turn that began on tape may end on tape only after the centre was off it this long, in
/// microseconds: longer than a stain, and two words of a board that sends one every 5 ms.
const OFF_US: u32 = 4_500;

/// Direction of a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rotation {
    /// Counter-clockwise seen from above.
    Left,
    /// Clockwise.
    Right,
}

/// Angle of a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Angle {
    /// 45 degrees.
    Diagonal,
    /// 90 degrees.
    Perpendicular,
}

impl Angle {
    /// The time after which the turn ends without tape, if a full turn takes `full_turn_us` (W4,
    /// `STANDARD_THREESIXTY`).
    #[must_use]
    pub const fn duration_us(self, full_turn_us: u32) -> u32 {
        match self {
            Self::Diagonal => full_turn_us / 8,
            Self::Perpendicular => full_turn_us / 4,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tape {
    Unknown,
    /// `off_since_us`: the first of the latest words in a row that show no tape.
    Leaving {
        off_since_us: Option<u32>,
    },
    Open,
    Found,
}

/// One turn under way.
#[derive(Debug, Clone)]
pub struct Turn {
    rotation: Rotation,
    ends_us: u32,
    /// Additional time while words show that the tape has not come.
    more_us: u32,
    tape: Tape,
}

impl Turn {
    /// A turn that begins now and is over after `duration_us` ([`Angle::duration_us`]).
    #[must_use]
    pub fn new(rotation: Rotation, duration_us: u32, now_us: u32) -> Self {
        Self {
            rotation,
            ends_us: now_us.wrapping_add(duration_us),
            more_us: duration_us / 8 * 3,
            tape: Tape::Unknown,
        }
    }

    /// The turn's direction.
    #[must_use]
    pub fn rotation(&self) -> Rotation {
        self.rotation
    }

    /// Takes in a word that came from the sensor board at `at_us`.
    pub fn on_word(&mut self, bits: LineBits, at_us: u32) {
        self.tape = match (self.tape, centre_on_tape(bits)) {
            (Tape::Unknown | Tape::Leaving { .. }, true) => Tape::Leaving { off_since_us: None },
            (Tape::Unknown, false) => Tape::Open,
            (Tape::Leaving { off_since_us }, false) => {
                let since_us = off_since_us.unwrap_or(at_us);
                if at_us.wrapping_sub(since_us) < OFF_US {
                    Tape::Leaving {
                        off_since_us: Some(since_us),
                    }
                } else {
                    Tape::Open
                }
            }
            (Tape::Open, false) => Tape::Open,
            (Tape::Open | Tape::Found, true) | (Tape::Found, false) => Tape::Found,
        };
    }

    /// Whether the turn has ended.
    #[must_use]
    pub fn is_over(&self, now_us: u32) -> bool {
        self.tape == Tape::Found || reached(now_us, self.ends_us())
    }

    /// When the turn ends at the latest.
    #[must_use]
    pub fn ends_us(&self) -> u32 {
        match self.tape {
            Tape::Open => self.ends_us.wrapping_add(self.more_us),
            Tape::Unknown | Tape::Leaving { .. } | Tape::Found => self.ends_us,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: LineBits = LineBits(0b000_0111_0000);
    const ASIDE: LineBits = LineBits(0b110_0000_0000);

    fn words(words: &[LineBits]) -> bool {
        let mut turn = Turn::new(Rotation::Left, 3_000_000, 0);
        for (word, at_us) in words.iter().zip((0..).step_by(5_000)) {
            turn.on_word(*word, at_us);
        }
        turn.is_over(1)
    }

    #[test]
    fn a_turn_is_over_when_its_time_is() {
        for (angle, full_turn, duration) in [
            (Angle::Diagonal, 12_000_000, 1_500_000),
            (Angle::Perpendicular, 12_000_000, 3_000_000),
            (Angle::Perpendicular, 8_000_000, 2_000_000),
        ] {
            let start = u32::MAX - 1_000;
            let turn = Turn::new(Rotation::Right, angle.duration_us(full_turn), start);
            assert!(!turn.is_over(start));
            assert!(!turn.is_over(start.wrapping_add(duration - 1)));
            assert!(turn.is_over(start.wrapping_add(duration)));
        }
    }

    #[test]
    fn a_turn_that_sees_no_tape_takes_longer() {
        let mut turn = Turn::new(Rotation::Left, 3_000_000, 0);
        turn.on_word(ASIDE, 5_000);
        assert!(!turn.is_over(4_124_999));
        assert_eq!(turn.ends_us(), 4_125_000);
        assert!(turn.is_over(4_125_000));
    }

    #[test]
    fn tape_found_ends_it() {
        assert!(!words(&[ASIDE]));
        assert!(words(&[ASIDE, LINE]));
        assert!(words(&[ASIDE, LINE, ASIDE]), "found stays found");
    }

    #[test]
    fn how_often_words_come_does_not_matter() {
        for period_us in [450, 5_000, 12_000_u32] {
            let mut turn = Turn::new(Rotation::Left, 3_000_000, 0);
            turn.on_word(LINE, 0);
            // A stain: 4 ms without tape.
            turn.on_word(ASIDE, period_us);
            turn.on_word(ASIDE, period_us + 4_000);
            turn.on_word(LINE, period_us + 4_400);
            assert!(!turn.is_over(100_000), "{period_us}");
            turn.on_word(ASIDE, 50_000);
            turn.on_word(ASIDE, 50_000 + 4_500_u32.next_multiple_of(period_us));
            turn.on_word(LINE, 70_000);
            assert!(turn.is_over(100_000), "{period_us}");
        }
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
