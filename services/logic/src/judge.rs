//! Decides what a mark means: a pick station, the next node, or neither. The map says which marks
//! may come, and dead reckoning says about where they are.
//!
//! ```text
//!   A ----------------|s------------------ B
//!   0      1/4       1/2       3/4         1        1.3   of the edge
//!          [ stations of this edge )[ the node's sides   ) overdue
//! ```
//!
//! One mark looks like another (AMB-18: a border crossing is a one-sided mark). A mark that is
//! neither expected nor plausible is ignored; the caller reports it and drives on.

use crate::marks::Sides;

/// What the map has on the present edge, seen in driving direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeMarks {
    /// Length from node to node, in mm.
    pub length_mm: f32,
    /// Sides with a pick station at the middle.
    pub stations: Sides,
    /// Sides on which tape leaves the node at the end.
    pub crossing: Sides,
}

/// What a mark is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The pick station at the middle of the edge.
    Station,
    /// The node at the end of the edge.
    Node,
    /// Not on the map.
    Unexpected,
}

/// Judges a mark that was seen `at_mm` behind the last node. Dead reckoning may be wrong by
/// `tolerance`, as a part of the edge.
pub fn judge(edge: &EdgeMarks, sides: Sides, at_mm: f32, tolerance: f32) -> Verdict {
    let near = |middle: f32| (at_mm / edge.length_mm - middle).abs() <= tolerance;
    let past_stations = at_mm >= edge.length_mm * (1.0 - tolerance);
    if past_stations {
        return if sides.meets(edge.crossing) {
            Verdict::Node
        } else {
            Verdict::Unexpected
        };
    }
    if near(0.5) && !sides.is_empty() && sides.is_within(edge.stations) {
        return Verdict::Station;
    }
    // Stations never have tape on both sides (E17), so this can only be the node, and the wheels
    // have slipped.
    let slipped = sides == Sides::BOTH && edge.crossing == Sides::BOTH;
    if slipped && at_mm >= edge.length_mm * 0.5 {
        return Verdict::Node;
    }
    Verdict::Unexpected
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SIDES: [Sides; 4] = [Sides::NONE, Sides::LEFT, Sides::RIGHT, Sides::BOTH];

    fn check(stations: Sides, crossing: Sides, sides: Sides, at_mm: f32, expected: Verdict) {
        let edge = EdgeMarks {
            length_mm: 400.0,
            stations,
            crossing,
        };
        let found = judge(&edge, sides, at_mm, 0.25);
        assert_eq!(found, expected, "{sides} at {at_mm} on {edge:?}");
    }

    #[test]
    fn one_sided_marks_are_told_apart_by_where_they_are() {
        use Verdict::{Node, Station, Unexpected};
        for (at_mm, expected) in [
            (40.0, Unexpected),
            (150.0, Station),
            (200.0, Station),
            (260.0, Station),
            (310.0, Node),
            (400.0, Node),
            (490.0, Node),
        ] {
            check(Sides::LEFT, Sides::LEFT, Sides::LEFT, at_mm, expected);
        }
    }

    #[test]
    fn a_mark_on_the_wrong_side_is_nobodys() {
        check(
            Sides::LEFT,
            Sides::LEFT,
            Sides::RIGHT,
            200.0,
            Verdict::Unexpected,
        );
        check(
            Sides::NONE,
            Sides::BOTH,
            Sides::LEFT,
            200.0,
            Verdict::Unexpected,
        );
        check(
            Sides::NONE,
            Sides::LEFT,
            Sides::RIGHT,
            400.0,
            Verdict::Unexpected,
        );
    }

    #[test]
    fn half_a_crossing_at_its_place_is_the_crossing() {
        check(Sides::NONE, Sides::BOTH, Sides::RIGHT, 400.0, Verdict::Node);
        check(Sides::NONE, Sides::LEFT, Sides::BOTH, 400.0, Verdict::Node);
    }

    #[test]
    fn a_full_crossing_that_comes_early_is_the_node() {
        check(Sides::LEFT, Sides::BOTH, Sides::BOTH, 250.0, Verdict::Node);
        check(
            Sides::LEFT,
            Sides::BOTH,
            Sides::BOTH,
            150.0,
            Verdict::Unexpected,
        );
    }

    proptest! {
        #[test]
        fn true_marks_are_known_within_the_tolerance(
            length_mm in 400.0f32..1500.0,
            error in -0.24f32..0.24,
            stations in 0usize..4,
            crossing in 1usize..4,
            seen in 1usize..4,
        ) {
            let edge = EdgeMarks { length_mm, stations: SIDES[stations], crossing: SIDES[crossing] };
            let node = length_mm * (1.0 + error);
            prop_assert_eq!(judge(&edge, edge.crossing, node, 0.25), Verdict::Node);
            let sides = SIDES[seen];
            if sides.is_within(edge.stations) {
                let station = length_mm * (0.5 + error);
                prop_assert_eq!(judge(&edge, sides, station, 0.25), Verdict::Station);
            }
        }
    }
}
