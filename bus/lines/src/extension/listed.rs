//! Lists that a line may not hold as a whole: how many there are, and the first of them.

use core::fmt;

use crate::misread::Misread;
use crate::reader::Reader;
use crate::warehouse::{Coord, Direction, ProductId};

/// How many there are, and the first of them in one line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Listed<T> {
    total: u32,
    first: Vec<T>,
}

/// Lets lines list a type, of which so many always fit in one.
macro_rules! listed {
    ($item:ty, $fit:literal) => {
        impl Listed<$item> {
            /// How many of them always fit in a line.
            pub const FIT: usize = $fit;

            /// The list of `all`, of which the first [`FIT`](Self::FIT) are kept.
            pub fn new(all: &[$item]) -> Self {
                Self {
                    total: u32::try_from(all.len()).unwrap_or(u32::MAX),
                    first: all[..all.len().min(Self::FIT)].to_vec(),
                }
            }

            pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
                Self::read_each(reader, <$item>::read)
            }
        }
    };
}

listed!(Coord, 120);
listed!(Block, 40);
listed!(Queued, 45);
listed!(Edge, 64);
listed!(ProductId, 85);

impl<T> Listed<T> {
    /// How many there are.
    pub const fn total(&self) -> u32 {
        self.total
    }

    /// The first of them, as many as the line has.
    pub fn first(&self) -> &[T] {
        &self.first
    }

    fn read_each(
        reader: &mut Reader<'_>,
        item: fn(&mut Reader<'_>) -> Result<T, Misread>,
    ) -> Result<Self, Misread> {
        let wanted = "their number from 0 to 4294967295";
        let total = reader.word().number(wanted, 0, i64::from(u32::MAX))?;
        let mut first = Vec::new();
        while !reader.ahead().text.is_empty() {
            if first.len() as u64 == u64::from(total) {
                return Err(reader.ahead().misread("the end of the line"));
            }
            first.push(item(reader)?);
        }
        Ok(Self { total, first })
    }
}

impl<T: fmt::Display> fmt::Display for Listed<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.total)?;
        self.first
            .iter()
            .try_for_each(|item| write!(formatter, " {item}"))
    }
}

/// The way from a node to the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Edge {
    /// The node.
    pub node: Coord,
    /// Which way.
    pub way: Direction,
}

impl Edge {
    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        Ok(Self {
            node: Coord::read(reader)?,
            way: Direction::read(reader)?,
        })
    }
}

impl fmt::Display for Edge {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.node, self.way)
    }
}

/// A way that is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Block {
    /// The way.
    pub edge: Edge,
    /// Since when, in s of the robot's clock, as `time_ms` of its state counts.
    pub since_s: u32,
}

impl Block {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let wanted = "a time from 0 to 4294967295 s";
        Ok(Self {
            edge: Edge::read(reader)?,
            since_s: reader.word().number(wanted, 0, i64::from(u32::MAX))?,
        })
    }
}

impl fmt::Display for Block {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.edge, self.since_s)
    }
}

/// A product that is to be fetched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Queued {
    /// The number of the order.
    pub order: u32,
    /// What is fetched.
    pub product: ProductId,
}

impl ProductId {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        Self::from_word(reader.word())
    }
}

impl Queued {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let wanted = "an order from 0 to 4294967295";
        Ok(Self {
            order: reader.word().number(wanted, 0, i64::from(u32::MAX))?,
            product: ProductId::from_word(reader.word())?,
        })
    }
}

impl fmt::Display for Queued {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.order, self.product)
    }
}
