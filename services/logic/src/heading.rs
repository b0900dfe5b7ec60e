//! The four directions of a grid, and the turns between them.
//!
//! The enum itself is the bus's; this file adds the arithmetic of quarter turns, so that no
//! other file counts directions modulo four.

use lager_topics::Heading;

use crate::node::Node;

/// The four headings, clockwise.
pub const HEADINGS: [Heading; 4] = [Heading::Left, Heading::Up, Heading::Right, Heading::Down];

/// Which way a quarter turn goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spin {
    /// Counter-clockwise.
    Left,
    /// Clockwise.
    Right,
}

impl Spin {
    /// +1 clockwise, -1 counter-clockwise.
    pub fn sign(self) -> f32 {
        match self {
            Self::Left => -1.0,
            Self::Right => 1.0,
        }
    }
}

/// Arithmetic of headings. Up is towards greater y (AMB-36).
pub trait Compass: Sized {
    /// The heading `quarters` quarter turns away.
    #[must_use]
    fn turned(self, spin: Spin, quarters: u8) -> Self;

    /// The heading to one's right.
    #[must_use]
    fn right(self) -> Self {
        self.turned(Spin::Right, 1)
    }

    /// The heading to one's left.
    #[must_use]
    fn left(self) -> Self {
        self.turned(Spin::Left, 1)
    }

    /// The heading behind one.
    #[must_use]
    fn back(self) -> Self {
        self.turned(Spin::Right, 2)
    }

    /// Quarter turns to the right from here to `other`, 0..=3.
    fn quarters_right_to(self, other: Self) -> u8;

    /// The coordinates one square away; `None` below zero or above 255.
    fn step_from(self, node: Node) -> Option<Node>;
}

impl Compass for Heading {
    fn turned(self, spin: Spin, quarters: u8) -> Self {
        let clockwise = match spin {
            Spin::Right => quarters % 4,
            Spin::Left => (4 - quarters % 4) % 4,
        };
        HEADINGS[(self as usize + usize::from(clockwise)) % 4]
    }

    fn quarters_right_to(self, other: Self) -> u8 {
        (other as u8 + 4 - self as u8) % 4
    }

    fn step_from(self, node: Node) -> Option<Node> {
        let Node { x, y } = node;
        Some(match self {
            Self::Left => Node::new(x.checked_sub(1)?, y),
            Self::Up => Node::new(x, y.checked_add(1)?),
            Self::Right => Node::new(x.checked_add(1)?, y),
            Self::Down => Node::new(x, y.checked_sub(1)?),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_and_turns_agree_with_the_plane() {
        // heading, to its left, to its right, behind it, one step from (4, 4)
        let table = [
            (
                Heading::Left,
                Heading::Down,
                Heading::Up,
                Heading::Right,
                (3, 4),
            ),
            (
                Heading::Up,
                Heading::Left,
                Heading::Right,
                Heading::Down,
                (4, 5),
            ),
            (
                Heading::Right,
                Heading::Up,
                Heading::Down,
                Heading::Left,
                (5, 4),
            ),
            (
                Heading::Down,
                Heading::Right,
                Heading::Left,
                Heading::Up,
                (4, 3),
            ),
        ];
        for (heading, left, right, back, (x, y)) in table {
            assert_eq!(heading.left(), left);
            assert_eq!(heading.right(), right);
            assert_eq!(heading.back(), back);
            assert_eq!(heading.step_from(Node::new(4, 4)), Some(Node::new(x, y)));
        }
    }

    #[test]
    fn turning_by_the_difference_ends_at_the_target() {
        for from in HEADINGS {
            for to in HEADINGS {
                let quarters = from.quarters_right_to(to);
                assert_eq!(from.turned(Spin::Right, quarters), to);
                assert_eq!(from.turned(Spin::Left, (4 - quarters) % 4), to);
            }
        }
    }

    #[test]
    fn there_is_nothing_below_zero() {
        assert_eq!(Heading::Left.step_from(Node::new(0, 3)), None);
        assert_eq!(Heading::Down.step_from(Node::new(3, 0)), None);
        assert_eq!(Heading::Right.step_from(Node::new(255, 0)), None);
        assert_eq!(Heading::Up.step_from(Node::new(0, 255)), None);
    }
}
