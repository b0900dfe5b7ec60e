//! How long the ways must be so that a robot has room beside things and beside shelves.
//!
//! ```text
//!      |   .- - -.   |        A robot that turns on a crossing sweeps a circle as wide as its
//!   ---+--'-(o)---'--#---     front corners reach. A thing on the next way, and a shelf on the far
//!      |   `- - -'   |        side of a square, must stand outside it. The ranger looks ahead, so
//!      |             |        a robot cannot know what stands beside it before it turns there.
//! ```
//! It knows only lengths; other modules refuse a warehouse that is too small.

/// The shortest side in cm of a square if things stand in the middle of edges.
pub const LEAST_SIDE_WITH_THINGS_CM: u16 = 50;
/// The shortest side in cm of a square in which goods stand.
pub const LEAST_SIDE_WITH_GOODS_CM: u16 = 45;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{FRONT, HALF_WIDTH, REAR};
    use crate::scene::{OBSTACLE_ALONG, SHELF, STAND};

    /// A robot stands at most this far from the middle of its crossing, station or line, in mm.
    const OFF: f64 = 15.0;

    /// The shortest whole side in cm that leaves enough room; `room` gives the rest in mm.
    fn least_cm(room: impl Fn(f64) -> f64) -> Option<u16> {
        (1..=100).find(|side| room(f64::from(*side) * 10.0) >= 0.0)
    }

    #[test]
    fn a_robot_can_turn_beside_a_thing_on_the_shortest_way_that_may_have_one() {
        let corner = FRONT.hypot(HALF_WIDTH) + OFF;
        let on_a_crossing = least_cm(|side| side / 2.0 - OBSTACLE_ALONG / 2.0 - corner);
        // A robot that halts in front of a thing turns beside the square's opposite shelf.
        let between = least_cm(|side| side - STAND - SHELF / 2.0 - corner);
        assert_eq!(on_a_crossing.max(between), Some(LEAST_SIDE_WITH_THINGS_CM));
    }

    #[test]
    fn a_robot_can_pass_and_turn_in_on_the_far_side_of_the_smallest_square_with_goods() {
        let corner = REAR.hypot(HALF_WIDTH) + OFF;
        let turned_in = least_cm(|side| side - STAND - SHELF / 2.0 - corner);
        let passed = least_cm(|side| side - STAND - SHELF / 2.0 - HALF_WIDTH - OFF);
        assert_eq!(turned_in.max(passed), Some(LEAST_SIDE_WITH_GOODS_CM));
        assert!(
            STAND - SHELF / 2.0 > FRONT.hypot(HALF_WIDTH) + OFF,
            "its own shelf"
        );
    }
}
