//! A crossing by its coordinates: what every other file of the floor is written in.

/// A crossing by its coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Node {
    /// Column, from 0 at the left.
    pub x: u8,
    /// Row, from 0 at the bottom.
    pub y: u8,
}

impl Node {
    /// The crossing at these coordinates.
    pub const fn new(x: u8, y: u8) -> Self {
        Self { x, y }
    }
}

impl core::fmt::Display for Node {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(formatter, "({}, {})", self.x, self.y)
    }
}
