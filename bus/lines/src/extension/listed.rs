//! Lists that a line may not hold as a whole: how many there are, and the first of them.

use core::fmt;

use lager_floor::{Node, Place, ProductId};

use crate::floor::{Spelled, Words};
use crate::misread::Misread;
use crate::reader::Reader;

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
                read_each(reader)
            }
        }

        impl fmt::Display for Listed<$item> {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write_each(self, formatter)
            }
        }
    };
}

listed!(Node, 120);
listed!(Block, 40);
listed!(Queued, 45);
listed!(Place, 64);
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
}

fn read_each<T: Spelled>(reader: &mut Reader<'_>) -> Result<Listed<T>, Misread> {
    let wanted = "their number from 0 to 4294967295";
    let total = reader.word().number(wanted, 0, i64::from(u32::MAX))?;
    let mut first = Vec::new();
    while !reader.ahead().text.is_empty() {
        if first.len() as u64 == u64::from(total) {
            return Err(reader.ahead().misread("the end of the line"));
        }
        first.push(T::read(reader)?);
    }
    Ok(Listed { total, first })
}

fn write_each<T: Spelled>(listed: &Listed<T>, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(formatter, "{}", listed.total)?;
    let mut first = listed.first.iter();
    first.try_for_each(|item| write!(formatter, " {}", Words(item)))
}

/// A way that is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Block {
    /// The way.
    pub way: Place,
    /// Since when, in s of the robot's clock, as `time_ms` of its state counts.
    pub since_s: u32,
}

impl Spelled for Block {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let wanted = "a time from 0 to 4294967295 s";
        Ok(Self {
            way: Place::read(reader)?,
            since_s: reader.word().number(wanted, 0, i64::from(u32::MAX))?,
        })
    }

    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", Words(&self.way), self.since_s)
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

impl Spelled for Queued {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let wanted = "an order from 0 to 4294967295";
        Ok(Self {
            order: reader.word().number(wanted, 0, i64::from(u32::MAX))?,
            product: ProductId::read(reader)?,
        })
    }

    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.order, self.product)
    }
}
