//! [`FloorError`]: why no floor can be like this. `lager-orders` has a sentence for each error.

use crate::node::Node;

/// Why no floor can be like this.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FloorError {
    /// The floor has no squares, or too many.
    Size {
        /// The size that was given.
        size: Node,
    },
    /// The side of the squares is too short or too long.
    Side {
        /// The side that was given, in cm.
        cm: u16,
    },
    /// The delivery is not at a corner (M2).
    Delivery {
        /// The size of the floor.
        size: Node,
        /// The node that was given.
        delivery: Node,
    },
    /// There are more products than a robot's map holds.
    TooManyProducts {
        /// How many there are.
        count: usize,
    },
    /// A product has a negative number.
    ProductNegative {
        /// The number that was given.
        number: i32,
    },
    /// Two products have the same number (G5).
    ProductTwice {
        /// The number that both have.
        id: i32,
        /// The place of the second one in the list, from 0.
        index: usize,
    },
    /// A product stands in a square that does not exist.
    ProductOutside {
        /// Its number.
        id: i32,
        /// The square that was given.
        square: Node,
        /// The size of the floor, which has at least one square.
        size: Node,
    },
}
