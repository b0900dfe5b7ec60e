//! The warehouse as the lines tell of it: nodes and squares, directions, map, products.
//!
//! ```text
//!   y                                    size 2 1: two squares side by side
//!   ^   (0,1)----(1,1)----(2,1)          nodes from (0,0) to (2,1)
//!   |     | square | square |            the square (1,0) has its lower left corner
//!   |     | (0,0)  | (1,0)  |            at the node (1,0)
//!   +-- (0,0)----(1,0)----(2,0) --> x    delivery at one of the four corner nodes (M2)
//! ```

use core::fmt;
use std::collections::BTreeSet;

use thiserror::Error;

use crate::misread::Misread;
use crate::reader::{Reader, Word};

/// A node, a square by its lower left node, or a size: x to the right, y up (AMB-36).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Coord {
    /// Column, 0 to 255.
    pub x: u8,
    /// Row, 0 to 255.
    pub y: u8,
}

impl Coord {
    pub(crate) fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let x = reader.word().number("an x from 0 to 255", 0, 255)?;
        let y = reader.word().number("a y from 0 to 255", 0, 255)?;
        Ok(Self { x, y })
    }
}

impl fmt::Display for Coord {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.x, self.y)
    }
}

/// Where something looks, or the side of a square (G2, G5, M3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Direction {
    /// Towards smaller x; 0 in the goods string.
    Left,
    /// Towards greater y; 1 in the goods string.
    Up,
    /// Towards greater x; 2 in the goods string.
    Right,
    /// Towards smaller y; 3 in the goods string.
    Down,
}

impl Direction {
    /// Every direction, clockwise, in the order of their numbers (M3).
    pub const ALL: [Self; 4] = [Self::Left, Self::Up, Self::Right, Self::Down];
    pub(crate) const WANTED: &str = "left, up, right or down";

    /// The word of the grammar (G2).
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Up => "up",
            Self::Right => "right",
            Self::Down => "down",
        }
    }

    /// The number of the goods string (M3), 0 to 3.
    pub const fn number(self) -> u8 {
        match self {
            Self::Left => 0,
            Self::Up => 1,
            Self::Right => 2,
            Self::Down => 3,
        }
    }

    /// The direction with this number (M3).
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// The direction with this word (G2).
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.as_str() == word)
    }

    pub(crate) fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        reader.word().read(Self::WANTED, Self::from_word)
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

/// The side of a square in whole centimetres, 1 to 65 535 (G2, G4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SideLength(u16);

impl SideLength {
    /// A side of `cm` centimetres; `None` for 0.
    pub const fn new(cm: u16) -> Option<Self> {
        if cm == 0 { None } else { Some(Self(cm)) }
    }

    /// The side in cm.
    pub const fn cm(self) -> u16 {
        self.0
    }

    pub(crate) fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let wanted = "a side of 1 to 65535 cm";
        reader.word().number(wanted, 1, 65_535).map(Self)
    }
}

impl fmt::Display for SideLength {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.0)
    }
}

/// The number of a product and of its pick station, 0 to 2 147 483 647 (G2, G5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ProductId(i32);

impl ProductId {
    pub(crate) const WANTED: &str = "a product's number from 0 to 2147483647";

    /// The product with this number; `None` for a negative one.
    pub const fn new(number: i32) -> Option<Self> {
        if number < 0 { None } else { Some(Self(number)) }
    }

    /// The number.
    pub const fn get(self) -> i32 {
        self.0
    }

    pub(crate) fn from_word(word: Word<'_>) -> Result<Self, Misread> {
        word.number(Self::WANTED, 0, i64::from(i32::MAX)).map(Self)
    }
}

impl fmt::Display for ProductId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.0)
    }
}

/// How large the warehouse is and at which of its corners it is left (M1, M2, G3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Map {
    size: Coord,
    delivery: Coord,
}

/// Why there is no such warehouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum MapError {
    /// It has no squares.
    #[error(
        "a warehouse of {} x {} squares has none; each must be from 1 to 255",
        .size.x, .size.y
    )]
    Empty {
        /// As given.
        size: Coord,
    },
    /// The delivery is not at a corner (M2).
    #[error(
        "({}, {}) is no corner of the warehouse; \
         the delivery is at (0, 0), (0, {}), ({}, 0) or ({}, {})",
        .delivery.x, .delivery.y, .size.y, .size.x, .size.x, .size.y
    )]
    Delivery {
        /// The warehouse's size.
        size: Coord,
        /// As given.
        delivery: Coord,
    },
}

impl Map {
    /// A warehouse of `size` squares, 1 to 255 each way, delivering at the node `delivery`.
    ///
    /// # Errors
    ///
    /// When it has no squares or the delivery is not one of (0, 0), (0, Y), (X, 0), (X, Y).
    pub const fn new(size: Coord, delivery: Coord) -> Result<Self, MapError> {
        if size.x == 0 || size.y == 0 {
            return Err(MapError::Empty { size });
        }
        let at_side = delivery.x == 0 || delivery.x == size.x;
        if !at_side || (delivery.y != 0 && delivery.y != size.y) {
            return Err(MapError::Delivery { size, delivery });
        }
        Ok(Self { size, delivery })
    }

    /// Squares each way, 1 to 255.
    pub const fn size(self) -> Coord {
        self.size
    }

    /// The node of the delivery corner.
    pub const fn delivery(self) -> Coord {
        self.delivery
    }
}

impl fmt::Display for Map {
    /// As in the document's grammar (G3).
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.size, self.delivery)
    }
}

/// A product and its pick station (G5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Product {
    /// Its number.
    pub id: ProductId,
    /// The square it stands in.
    pub square: Coord,
    /// The side of the square from which it is reached.
    pub side: Direction,
}

impl fmt::Display for Product {
    /// As in the document's grammar (G5).
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {} {}", self.id, self.square, self.side)
    }
}

/// Products, each with a number of its own, in the order in which they were given.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Products(Vec<Product>);

/// Why this is no list of products.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ProductsError {
    /// Two have the same number (G5).
    #[error("product {id} is listed twice; every product needs a number of its own")]
    Twice {
        /// The number.
        id: ProductId,
        /// Which product of the list is the second one with it, from 0.
        index: usize,
    },
}

impl Products {
    /// The list of these products; there may be none (AMB-41).
    ///
    /// # Errors
    ///
    /// When two have the same number.
    pub fn new(products: Vec<Product>) -> Result<Self, ProductsError> {
        let mut seen = BTreeSet::new();
        match products.iter().position(|product| !seen.insert(product.id)) {
            Some(index) => Err(ProductsError::Twice {
                id: products[index].id,
                index,
            }),
            None => Ok(Self(products)),
        }
    }

    /// The products.
    pub fn as_slice(&self) -> &[Product] {
        &self.0
    }

    /// The first product whose square is not one of `map`'s.
    pub fn outside(&self, map: Map) -> Option<&Product> {
        let size = map.size();
        let mut products = self.0.iter();
        products.find(|product| product.square.x >= size.x || product.square.y >= size.y)
    }
}
