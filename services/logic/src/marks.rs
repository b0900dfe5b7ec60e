//! Marks on the floor: makes one mark with its sides out of single line states, judged once.
//!
//! The sensors take about 200 ms to cross a tape. At an angle, a crossing first shows one side;
//! frames get lost; and noise shows marks that do not exist. So this file counts the sides while a
//! mark lasts, and reports the mark when it has ended:
//!
//! ```text
//!  OnLine OnLine StationToLeft FourWay FourWay StationToRight OnLine
//!                left 1        2       3                      \
//!                        right 1       2       3               -> Mark { both sides }
//! ```
//!
//! [`crate::judge`] and the map decide whether the mark means a station, a node or nothing.

use lager_wire::LineState;

/// How many frames must show a side before it counts.
const BELIEVED: u8 = 3;
/// Where counting stops; the status keeps two bits for each side.
const MOST: u8 = 3;

/// Sides of the line, as seen in driving direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sides {
    /// Something to the left.
    pub left: bool,
    /// Something to the right.
    pub right: bool,
}

impl Sides {
    /// Neither side.
    pub const NONE: Self = Self {
        left: false,
        right: false,
    };
    /// The left side alone.
    pub const LEFT: Self = Self {
        left: true,
        right: false,
    };
    /// The right side alone.
    pub const RIGHT: Self = Self {
        left: false,
        right: true,
    };
    /// Both sides.
    pub const BOTH: Self = Self {
        left: true,
        right: true,
    };

    /// Whether nothing is set.
    pub fn is_empty(self) -> bool {
        self == Self::NONE
    }

    /// Whether `other` has every side of this.
    pub fn is_within(self, other: Self) -> bool {
        (!self.left || other.left) && (!self.right || other.right)
    }

    /// Bit 0 = left, bit 1 = right.
    pub fn to_bits(self) -> u8 {
        u8::from(self.left) | u8::from(self.right) << 1
    }

    /// Whether a side is set in both.
    pub fn meets(self, other: Self) -> bool {
        (self.left && other.left) || (self.right && other.right)
    }
}

impl core::fmt::Display for Sides {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str(match (self.left, self.right) {
            (true, true) => "both sides",
            (true, false) => "the left",
            (false, true) => "the right",
            (false, false) => "neither side",
        })
    }
}

/// A mark that the sensors have left behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark {
    /// The sides with tape; at least one.
    pub sides: Sides,
    /// The line does not go on behind it.
    pub line_ends: bool,
}

/// Collects the mark under the sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MarkReader {
    left: u8,
    right: u8,
    /// The cross bar that the board still remembers has been reported.
    bar_told: bool,
}

impl MarkReader {
    /// Takes one line state. Returns the mark that ended with it, if any.
    pub fn push(&mut self, state: LineState) -> Option<Mark> {
        self.bar_told &= state == LineState::DropStation;
        match state {
            LineState::StationToLeft => self.count(Sides::LEFT),
            LineState::StationToRight => self.count(Sides::RIGHT),
            LineState::FourWay => self.count(Sides::BOTH),
            LineState::DropStation => {
                // The board remembers that its last tape went to both sides, also if none of those
                // frames arrived here. It says so until it sees tape again.
                if self.bar_told {
                    return None;
                }
                self.count(Sides::BOTH);
                self.bar_told = self.sides() == Sides::BOTH;
                return self.bar_told.then(|| self.end(true)).flatten();
            }
            LineState::NotOnLine => return self.end(true),
            LineState::OnLine | LineState::LeftOfLine | LineState::RightOfLine => {
                return self.end(false);
            }
        }
        None
    }

    /// Takes one line state while no mark can be judged. It counts the mark under the sensors, and
    /// that mark ends with the first state of a later `push`.
    pub fn hold(&mut self, state: LineState) {
        match state {
            LineState::StationToLeft | LineState::StationToRight | LineState::FourWay => {
                self.push(state);
            }
            _ => {}
        }
    }

    /// Forgets what it has collected.
    pub fn clear(&mut self) {
        (self.left, self.right) = (0, 0);
    }

    /// Takes what was seen so far as certain, however short it was: the rest of the mark may have
    /// passed while no process was reading.
    pub fn believe(&mut self) {
        for count in [&mut self.left, &mut self.right] {
            if *count > 0 {
                *count = BELIEVED;
            }
        }
    }

    /// Whether a mark is under the sensors.
    pub fn has_begun(self) -> bool {
        self.left > 0 || self.right > 0
    }

    /// The counts as the status carries them.
    pub fn to_bits(self) -> u8 {
        self.left | self.right << 2 | u8::from(self.bar_told) << 4
    }

    /// The counts from a status.
    pub fn from_bits(bits: u8) -> Self {
        Self {
            left: bits & MOST,
            right: bits >> 2 & MOST,
            bar_told: bits & 1 << 4 != 0,
        }
    }

    fn count(&mut self, sides: Sides) {
        self.left = (self.left + u8::from(sides.left)).min(MOST);
        self.right = (self.right + u8::from(sides.right)).min(MOST);
    }

    fn sides(self) -> Sides {
        Sides {
            left: self.left >= BELIEVED,
            right: self.right >= BELIEVED,
        }
    }

    fn end(&mut self, line_ends: bool) -> Option<Mark> {
        let sides = self.sides();
        self.clear();
        (!sides.is_empty()).then_some(Mark { sides, line_ends })
    }
}

#[cfg(test)]
mod tests {
    use lager_wire::LineState::{
        DropStation, FourWay, LeftOfLine, NotOnLine, OnLine, StationToLeft, StationToRight,
    };
    use proptest::prelude::*;

    use super::*;

    fn read(states: &[LineState]) -> Vec<Mark> {
        let mut reader = MarkReader::default();
        states
            .iter()
            .filter_map(|state| reader.push(*state))
            .collect()
    }

    fn mark(sides: Sides, line_ends: bool) -> Vec<Mark> {
        vec![Mark { sides, line_ends }]
    }

    /// The state, three times.
    fn thrice(states: &[LineState]) -> Vec<LineState> {
        states.iter().flat_map(|state| [*state; 3]).collect()
    }

    #[test]
    fn a_mark_is_given_out_once_when_it_has_ended() {
        let station = thrice(&[OnLine, StationToLeft, OnLine, LeftOfLine]);
        assert_eq!(read(&station), mark(Sides::LEFT, false));
        let corner = thrice(&[OnLine, StationToRight, NotOnLine]);
        assert_eq!(read(&corner), mark(Sides::RIGHT, true));
        let tee = thrice(&[OnLine, FourWay, DropStation, DropStation]);
        assert_eq!(read(&tee), mark(Sides::BOTH, true));
    }

    #[test]
    fn a_crossing_seen_at_an_angle_has_both_sides() {
        let slanted = [StationToLeft, FourWay, FourWay, StationToRight, OnLine];
        assert_eq!(read(&slanted), mark(Sides::BOTH, false));
        let one_after_the_other = thrice(&[StationToLeft, StationToRight, OnLine]);
        assert_eq!(read(&one_after_the_other), mark(Sides::BOTH, false));
    }

    #[test]
    fn one_or_two_frames_are_noise() {
        for noise in [StationToLeft, StationToRight, FourWay] {
            assert_eq!(
                read(&[OnLine, noise, noise, OnLine, OnLine, noise, OnLine]),
                []
            );
        }
        assert_eq!(read(&[OnLine, DropStation, OnLine]), []);
    }

    #[test]
    fn the_boards_memory_replaces_lost_frames() {
        let remembered = [OnLine, DropStation, DropStation, DropStation, DropStation];
        assert_eq!(read(&remembered), mark(Sides::BOTH, true));
        let half_lost = [OnLine, FourWay, DropStation, DropStation, DropStation];
        assert_eq!(read(&half_lost), mark(Sides::BOTH, true));
    }

    #[test]
    fn a_mark_cut_short_by_a_restart_is_believed() {
        let mut reader = MarkReader::default();
        reader.push(StationToLeft);
        reader.believe();
        assert_eq!(
            reader.push(OnLine).map(|mark| mark.sides),
            Some(Sides::LEFT)
        );
        reader.believe();
        assert_eq!(reader.push(OnLine), None);
    }

    #[test]
    fn a_held_mark_is_given_out_when_it_can_be_judged() {
        let mut reader = MarkReader::default();
        for state in thrice(&[OnLine, StationToRight, OnLine]) {
            reader.hold(state);
        }
        assert_eq!(
            reader.push(OnLine).map(|mark| mark.sides),
            Some(Sides::RIGHT)
        );
        assert_eq!(reader.push(OnLine), None);
    }

    fn states() -> impl Strategy<Value = Vec<LineState>> {
        let state = prop::sample::select(vec![
            OnLine,
            NotOnLine,
            LeftOfLine,
            StationToLeft,
            StationToRight,
            FourWay,
            DropStation,
        ]);
        prop::collection::vec(state, 0..40)
    }

    proptest! {
        #[test]
        fn a_reader_restored_at_any_point_reads_the_same(states in states(), cut in 0usize..40) {
            let mut whole = MarkReader::default();
            let mut cut_short = MarkReader::default();
            for (index, state) in states.iter().enumerate() {
                if index == cut {
                    cut_short = MarkReader::from_bits(cut_short.to_bits());
                }
                prop_assert_eq!(whole.push(*state), cut_short.push(*state));
            }
        }

        #[test]
        fn no_mark_without_a_side(states in states()) {
            for found in read(&states) {
                prop_assert!(!found.sides.is_empty());
            }
        }
    }
}
