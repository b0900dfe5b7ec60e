//! [`Node`]: a crossing of the floor.

use core::fmt;

use serde::{Deserialize, Serialize};

/// A crossing of the floor, or the square whose lower left node it is: x to the right, y up.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(from = "[u8; 2]", into = "[u8; 2]")]
pub struct Node {
    /// Column, from 0 at the left.
    pub x: u8,
    /// Row, from 0 at the bottom.
    pub y: u8,
}

impl Node {
    /// The node at these coordinates.
    pub const fn new(x: u8, y: u8) -> Self {
        Self { x, y }
    }
}

impl From<[u8; 2]> for Node {
    fn from([x, y]: [u8; 2]) -> Self {
        Self { x, y }
    }
}

impl From<Node> for [u8; 2] {
    fn from(Node { x, y }: Node) -> Self {
        [x, y]
    }
}

impl fmt::Display for Node {
    /// Written as `(2, 1)`.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "({}, {})", self.x, self.y)
    }
}
