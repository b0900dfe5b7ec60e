//! [`Heading`]: the four directions of a floor, and the turns between them. No other file counts
//! directions modulo four.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::node::Node;

/// The direction in which something looks or leads, or the side of a square in that direction from
/// its middle. Numbered clockwise from the left, as in the goods string (M3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum Heading {
    /// Towards smaller x.
    Left = 0,
    /// Towards greater y.
    Up = 1,
    /// Towards greater x.
    Right = 2,
    /// Towards smaller y.
    Down = 3,
}

#[cfg(feature = "lager-sample")]
lager_sample::coded_as_is!(Heading {
    Left,
    Up,
    Right,
    Down
});

/// The direction of a quarter turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spin {
    /// Counter-clockwise.
    Left,
    /// Clockwise.
    Right,
}

impl Spin {
    /// +1 clockwise, -1 counter-clockwise.
    pub const fn sign(self) -> f32 {
        match self {
            Self::Left => -1.0,
            Self::Right => 1.0,
        }
    }

    /// The opposite way.
    pub const fn back(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

impl Heading {
    /// Every heading, clockwise, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Left, Self::Up, Self::Right, Self::Down];

    /// Its word: `left`, `up`, `right` or `down` (G2).
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Up => "up",
            Self::Right => "right",
            Self::Down => "down",
        }
    }

    /// Its number in the goods string (M3), 0 to 3.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The heading with this number; `None` above 3.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// The heading with this word.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.as_str() == word)
    }

    /// The heading `quarters` quarter turns away.
    #[must_use]
    pub const fn turned(self, spin: Spin, quarters: u8) -> Self {
        let clockwise = match spin {
            Spin::Right => quarters % 4,
            Spin::Left => (4 - quarters % 4) % 4,
        };
        Self::ALL[((self as u8 + clockwise) % 4) as usize]
    }

    /// The heading to the right of this one.
    #[must_use]
    pub const fn right(self) -> Self {
        self.turned(Spin::Right, 1)
    }

    /// The heading to the left of this one.
    #[must_use]
    pub const fn left(self) -> Self {
        self.turned(Spin::Left, 1)
    }

    /// The opposite heading.
    #[must_use]
    pub const fn back(self) -> Self {
        self.turned(Spin::Right, 2)
    }

    /// How many quarter turns to the right lead from here to `other`, 0 to 3.
    pub const fn quarters_right_to(self, other: Self) -> u8 {
        (other as u8 + 4 - self as u8) % 4
    }

    /// Degrees clockwise from up: 0, 90, 180 or 270.
    pub const fn degrees(self) -> i32 {
        Self::Up.quarters_right_to(self) as i32 * 90
    }

    /// The change of x and y in one step.
    pub const fn step(self) -> (i32, i32) {
        match self {
            Self::Left => (-1, 0),
            Self::Up => (0, 1),
            Self::Right => (1, 0),
            Self::Down => (0, -1),
        }
    }

    /// The node one square away; `None` if it would be below 0 or above 255.
    pub fn step_from(self, node: Node) -> Option<Node> {
        let Node { x, y } = node;
        Some(match self {
            Self::Left => Node::new(x.checked_sub(1)?, y),
            Self::Up => Node::new(x, y.checked_add(1)?),
            Self::Right => Node::new(x.checked_add(1)?, y),
            Self::Down => Node::new(x, y.checked_sub(1)?),
        })
    }
}

impl fmt::Display for Heading {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_and_turns_agree_with_the_plane() {
        use Heading::{Down, Left, Right, Up};

        // heading, to its left, to its right, behind it, one step from (4, 4)
        let table = [
            (Left, Down, Up, Right, (3, 4)),
            (Up, Left, Right, Down, (4, 5)),
            (Right, Up, Down, Left, (5, 4)),
            (Down, Right, Left, Up, (4, 3)),
        ];
        for (heading, left, right, back, (x, y)) in table {
            assert_eq!(heading.left(), left);
            assert_eq!(heading.right(), right);
            assert_eq!(heading.back(), back);
            assert_eq!(heading.step_from(Node::new(4, 4)), Some(Node::new(x, y)));
            assert_eq!(heading.step(), (i32::from(x) - 4, i32::from(y) - 4));
        }
        assert_eq!(Heading::ALL.map(Heading::degrees), [270, 0, 90, 180]);
    }

    #[test]
    fn turning_by_the_difference_ends_at_the_target() {
        for from in Heading::ALL {
            for to in Heading::ALL {
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

    #[test]
    fn words_and_numbers_come_back() {
        for heading in Heading::ALL {
            assert_eq!(Heading::from_word(heading.as_str()), Some(heading));
            assert_eq!(Heading::from_number(heading.number()), Some(heading));
        }
        assert_eq!(Heading::from_word("Left"), None);
        assert_eq!(Heading::from_number(4), None);
    }
}
