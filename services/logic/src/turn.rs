//! Finds out how many quarters a turn has made, after its end.
//!
//! The steering board turns by time and ends early when the tape comes under its centre sensors
//! (AMB-22). So "done" alone does not say where the robot looks: a cross bar, a spot of dirt or an
//! interruption can end a turn anywhere. The angle from dead reckoning tells whole quarters from
//! fragments, and the rest counts for the next quarter of the same turn.
//!
//! ```text
//!   0        60         80    90         150         172  180
//!   | fragment | by line | one quarter     | by line   | two quarters
//! ```
//!
//! One turn makes two quarters if there was no tape at the first, or if an interrupted turn is
//! given again.
//!
//! A quarter that ended by time, with no tape in sight, has not shown where the robot really looks.
//! So the error of dead reckoning in the first of two quarters adds to that of the second: tape
//! that comes in sight 15 degrees before a half turn is over may seem to come after only 140
//! degrees.

use lager_wire::LineState;

use lager_floor::Spin;

/// Below this a turn has not found its tape: the tape behind is seen up to 15 degrees, the tape
/// ahead from 75.
const FRAGMENT_DEG: f32 = 60.0;
/// The same after a quarter that ended without tape: the old tape is far away by then.
const FRAGMENT_BEYOND_BARE_DEG: f32 = 40.0;
/// From here the line control can correct the rest, if it has the tape in sight.
const QUARTER_DEG: f32 = 80.0;
/// From here tape under the sensors belongs to the second quarter.
const BEYOND_DEG: f32 = 150.0;
/// From here the rest of a half turn is small enough.
const HALF_DEG: f32 = 172.0;

/// What to do about a turn that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turned {
    /// The heading is still the old one: turn again the same way.
    Fragment,
    /// This many quarters are done.
    Quarters(u8),
}

/// Whether no tape is under the sensors.
pub fn is_bare(seen: LineState) -> bool {
    matches!(seen, LineState::NotOnLine | LineState::DropStation)
}

/// Judges a turn that the board carried out, with `seen` under the sensors. `turned_deg` is
/// positive in the direction of the turn. `from_bare`: the quarter before it ended without tape.
pub fn done(turned_deg: f32, seen: LineState, from_bare: bool) -> Turned {
    let on_tape = !is_bare(seen);
    let fragment_deg = match from_bare && on_tape {
        true => FRAGMENT_BEYOND_BARE_DEG,
        false => FRAGMENT_DEG,
    };
    match turned_deg {
        angle if angle < fragment_deg => Turned::Fragment,
        angle if angle >= HALF_DEG || (angle >= BEYOND_DEG && on_tape) => Turned::Quarters(2),
        _ => Turned::Quarters(1),
    }
}

/// Judges a turn that was cut short, once the robot stands and `seen` is under its sensors.
///
/// A further turn from the new tape would lead past it to the next one. So the tape counts when it
/// is in the middle or already on the far side. If no tape is in sight the turn goes on, whatever
/// dead reckoning says: after several interruptions dead reckoning is the less reliable of the two,
/// and a turn that is given again ends on tape, at the first quarter or at the second.
pub fn interrupted(turned_deg: f32, spin: Spin, seen: LineState) -> Turned {
    let beyond = match spin {
        Spin::Left => LineState::LeftOfLine,
        Spin::Right => LineState::RightOfLine,
    };
    let on_it = seen == LineState::OnLine || seen == beyond;
    let in_sight = !matches!(seen, LineState::NotOnLine | LineState::DropStation);
    if (turned_deg >= QUARTER_DEG && in_sight) || (turned_deg >= FRAGMENT_DEG && on_it) {
        done(turned_deg, seen, false)
    } else {
        Turned::Fragment
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_that_ended_on_the_cross_bar_is_no_quarter() {
        assert_eq!(done(20.0, LineState::OnLine, false), Turned::Fragment);
        assert_eq!(done(84.0, LineState::OnLine, false), Turned::Quarters(1));
        assert_eq!(
            done(110.0, LineState::NotOnLine, false),
            Turned::Quarters(1)
        );
    }

    #[test]
    fn two_quarters_in_one_turn_end_on_the_second_tape() {
        assert_eq!(
            done(168.0, LineState::NotOnLine, false),
            Turned::Quarters(1)
        );
        assert_eq!(
            done(168.0, LineState::RightOfLine, false),
            Turned::Quarters(2)
        );
        assert_eq!(
            done(174.0, LineState::NotOnLine, false),
            Turned::Quarters(2)
        );
    }

    #[test]
    fn behind_a_quarter_without_tape_the_next_tape_may_come_early() {
        assert_eq!(done(57.0, LineState::OnLine, false), Turned::Fragment);
        assert_eq!(done(57.0, LineState::OnLine, true), Turned::Quarters(1));
        assert_eq!(done(57.0, LineState::NotOnLine, true), Turned::Fragment);
        assert_eq!(done(30.0, LineState::OnLine, true), Turned::Fragment);
    }

    #[test]
    fn an_interrupted_turn_counts_when_the_new_tape_is_reached() {
        use LineState::{LeftOfLine, NotOnLine, OnLine, RightOfLine};
        let table = [
            // It is still on the old tape, whatever that looks like.
            (10.0, OnLine, Turned::Fragment),
            (40.0, NotOnLine, Turned::Fragment),
            // When it turns right, the new tape comes in from the right: the robot is left of it.
            (78.0, LeftOfLine, Turned::Fragment),
            (78.0, OnLine, Turned::Quarters(1)),
            (78.0, RightOfLine, Turned::Quarters(1)),
            (85.0, LeftOfLine, Turned::Quarters(1)),
            (88.0, NotOnLine, Turned::Fragment),
            (168.0, NotOnLine, Turned::Fragment),
            (168.0, OnLine, Turned::Quarters(2)),
        ];
        for (angle, seen, expected) in table {
            assert_eq!(
                interrupted(angle, Spin::Right, seen),
                expected,
                "{angle} {seen:?}"
            );
        }
        assert_eq!(
            interrupted(78.0, Spin::Left, LeftOfLine),
            Turned::Quarters(1)
        );
        assert_eq!(interrupted(78.0, Spin::Left, RightOfLine), Turned::Fragment);
    }
}
