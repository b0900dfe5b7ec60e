//! [`Product`]: a product and the place where it is picked.

use core::fmt;

use crate::edge::Edge;
use crate::error::FloorError;
use crate::heading::Heading;
use crate::node::Node;

/// The number of a product and of its pick station, 0 to 2 147 483 647 (G2, G5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ProductId(i32);

impl ProductId {
    /// The product with this number; `None` for a negative one, because -1 means no product.
    pub const fn new(number: i32) -> Option<Self> {
        if number < 0 { None } else { Some(Self(number)) }
    }

    /// The number.
    pub const fn get(self) -> i32 {
        self.0
    }
}

impl TryFrom<i32> for ProductId {
    type Error = FloorError;

    fn try_from(number: i32) -> Result<Self, FloorError> {
        Self::new(number).ok_or(FloorError::ProductNegative { number })
    }
}

impl fmt::Display for ProductId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.0)
    }
}

/// A product and its pick station (G5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Product {
    /// Its number.
    pub id: ProductId,
    /// The square in which it stands.
    pub square: Node,
    /// The side of the square from which it is reached.
    pub side: Heading,
}

impl Product {
    /// The edge on which it is picked. Its mark is at the middle of this edge.
    pub const fn edge(&self) -> Edge {
        Edge::of(self.square, self.side)
    }
}
