//! How lines write a floor: nodes and squares, headings and sides, sizes and products.
//!
//! [`lager_floor`] says which floors are possible. A line with an impossible floor is refused.

use core::fmt;

use lager_floor::{FloorError, Grid, Heading, Node, Place, Product, ProductId, SideLength};

use crate::misread::Misread;
use crate::reader::{Reader, Word};

/// What should stand where a heading or a side is read.
pub(crate) const HEADING: &str = "left, up, right or down";
/// What should stand where a product's number is read.
pub(crate) const PRODUCT: &str = "a product's number from 0 to 2147483647";

/// A value that lines write in words.
pub(crate) trait Spelled: Sized {
    /// Reads its words.
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread>;
    /// Writes its words, with blanks between.
    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result;
}

/// A value in the form of its words in a line.
pub(crate) struct Words<'a, T>(pub(crate) &'a T);

impl<T: Spelled> fmt::Display for Words<'_, T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.write(formatter)
    }
}

impl Spelled for Node {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let x = reader.word().number("an x from 0 to 255", 0, 255)?;
        let y = reader.word().number("a y from 0 to 255", 0, 255)?;
        Ok(Self { x, y })
    }

    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.x, self.y)
    }
}

impl Spelled for Heading {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        reader.word().read(HEADING, Self::from_word)
    }

    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

impl Spelled for Place {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        Ok(Self::new(Node::read(reader)?, Heading::read(reader)?))
    }

    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", Words(&self.node), self.heading)
    }
}

impl Spelled for SideLength {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let word = reader.word();
        let wanted = "a side of 40 to 500 cm";
        let cm = word.number(wanted, 0, i64::from(u16::MAX))?;
        Self::new(cm).map_err(|_| word.misread(wanted))
    }

    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

impl Spelled for ProductId {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        reader.word().read(PRODUCT, product)
    }

    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

impl Spelled for Product {
    fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        Ok(Self {
            id: ProductId::read(reader)?,
            square: Node::read(reader)?,
            side: Heading::read(reader)?,
        })
    }

    fn write(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, square, side } = self;
        write!(formatter, "{id} {} {side}", Words(square))
    }
}

/// The product with the number in this word.
pub(crate) fn product(word: &str) -> Option<ProductId> {
    let is_number = word.bytes().all(|byte| byte.is_ascii_digit());
    let number = word.parse().ok().filter(|_| is_number);
    number.and_then(ProductId::new)
}

/// The floor that four numbers describe: its size and its delivery corner. An error comes with the
/// column of the two numbers that are wrong.
pub(crate) fn grid<'a, E: From<Misread>>(
    mut field: impl FnMut() -> Word<'a>,
    delivery: [&'static str; 2],
    refused: impl FnOnce(usize, FloorError) -> E,
) -> Result<Grid, E> {
    let (width, height) = (field(), field());
    let size = Node {
        x: width.number("a width of 1 to 99 squares", 0, 255)?,
        y: height.number("a height of 1 to 99 squares", 0, 255)?,
    };
    let (x, y) = (field(), field());
    let delivery = Node {
        x: x.number(delivery[0], 0, 255)?,
        y: y.number(delivery[1], 0, 255)?,
    };
    Grid::new(size, delivery).map_err(|refusal| {
        let at = match refusal {
            FloorError::Delivery { .. } => x,
            _ => width,
        };
        refused(at.column(), refusal)
    })
}

/// Products with different numbers, in the order of the line. The list may be empty (AMB-41).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Products(Vec<Product>);

impl Products {
    /// The list of these products.
    ///
    /// # Errors
    ///
    /// There are too many, or two have the same number.
    pub fn new(products: Vec<Product>) -> Result<Self, FloorError> {
        Grid::check_numbers(&products).map(|()| Self(products))
    }

    /// The products.
    pub fn as_slice(&self) -> &[Product] {
        &self.0
    }
}
