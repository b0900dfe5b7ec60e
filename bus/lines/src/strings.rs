//! Map and goods as one string each (M1-M3), as the document passes them to the logic unit.
//!
//! ```text
//! map    "X,Y,x,y"                        X, Y = size in squares, x, y = node of the delivery (M1)
//! goods  "v1,x1,y1,s1;v2,x2,y2,s2;..."    v = number or name, x, y = square, s = side (M3)
//! ```
//!
//! - X and Y are 1 to 99; (x, y) is one of (0, 0), (0, Y), (X, 0), (X, Y) (M2).
//! - s is 0 to 3, clockwise: 0 left, 1 up, 2 right, 3 down.
//! - v is any text without a comma, a semicolon or a line break, and is not empty. GaG's grammar
//!   has only numbers (AMB-38), so [`Products`] cannot hold a list with names.
//! - Blanks around a field are ignored. A semicolon after the last product may stand there. This
//!   crate writes neither. An empty string is an empty list of goods.
//!
//! ```
//! use lager_floor::Node;
//! use lager_lines::strings::{Goods, map_string, read_map};
//!
//! let map = read_map("4,3,0,3").unwrap();
//! assert_eq!(map.size(), Node::new(4, 3));
//! assert_eq!(map_string(map), "4,3,0,3");
//!
//! let goods = Goods::read("7,1,0,3;skruvar,0,1,0;").unwrap();
//! assert_eq!(goods.to_string(), "7,1,0,3;skruvar,0,1,0");
//! assert_eq!(
//!     goods.products().unwrap_err().to_string(),
//!     "\"skruvar\" is a name; GaG's grammar has only numbers from 0 to 2147483647",
//! );
//! assert_eq!(
//!     Goods::read("7,1,0,4").unwrap_err().to_string(),
//!     "column 7: \"4\" stands here, but a side from 0 to 3 belongs here",
//! );
//! ```

use core::fmt;

use lager_floor::{Grid, Heading, Node, Product, ProductId};
use lager_orders::Reason;
use thiserror::Error;

use crate::floor::{Products, grid, product};
use crate::misread::Misread;
use crate::reader::{Reader, Word};

/// The map as a string (M1).
pub fn map_string(map: Grid) -> String {
    let Node {
        x: width,
        y: height,
    } = map.size();
    let Node { x, y } = map.delivery();
    format!("{width},{height},{x},{y}")
}

/// Why a string is not a map.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MapStringError {
    /// A field is wrong.
    #[error(transparent)]
    Misread(#[from] Misread),
    /// Such a warehouse cannot exist.
    #[error("column {column}: {error}")]
    Map {
        /// Where the wrong size or delivery begins, in characters from 1.
        column: usize,
        /// What is wrong with it.
        error: Reason,
    },
}

/// Reads a map (M1).
///
/// # Errors
///
/// It is not four numbers with commas between, or such a warehouse cannot exist.
pub fn read_map(text: &str) -> Result<Grid, MapStringError> {
    let mut fields = fields_of(Reader::whole(text));
    let delivery = [
        "the x of the delivery, 0 to 255",
        "the y of the delivery, 0 to 255",
    ];
    let map = grid(
        || fields.next(),
        delivery,
        |column, error| MapStringError::Map {
            column,
            error: error.into(),
        },
    )?;
    fields.end("the end of the map behind its fourth number")?;
    Ok(map)
}

/// A product with a number or a name.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Good {
    label: String,
    /// The square in which it stands.
    pub square: Node,
    /// The side of the square from which the robot reaches it.
    pub side: Heading,
}

/// Why a text cannot stand for a product.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "{label:?} cannot stand for a product; it must have a character and neither comma, semicolon, \
     line break nor a blank at its ends"
)]
pub struct LabelError {
    /// The text.
    pub label: String,
}

impl Good {
    /// A product with the number or name `label`.
    ///
    /// # Errors
    ///
    /// The label is empty, has a blank at an end, or has a comma, a semicolon or a line break.
    pub fn new(label: impl Into<String>, square: Node, side: Heading) -> Result<Self, LabelError> {
        let label = label.into();
        check_label(&label)?;
        Ok(Self {
            label,
            square,
            side,
        })
    }

    /// Its number or name.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Its number, if it has one.
    pub fn id(&self) -> Option<ProductId> {
        product(&self.label)
    }
}

impl From<&Product> for Good {
    fn from(product: &Product) -> Self {
        Self {
            label: product.id.to_string(),
            square: product.square,
            side: product.side,
        }
    }
}

impl fmt::Display for Good {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            label,
            square: Node { x, y },
            side,
        } = self;
        write!(formatter, "{label},{x},{y},{}", side.number())
    }
}

/// Checks whether a text can stand for a product.
pub(crate) fn check_label(label: &str) -> Result<(), LabelError> {
    let blank = [' ', '\t'];
    let is_bare = !label.starts_with(blank) && !label.ends_with(blank);
    if label.is_empty() || !is_bare || label.contains([',', ';', '\r', '\n']) {
        let label = label.to_owned();
        return Err(LabelError { label });
    }
    Ok(())
}

/// The products of a warehouse as the goods string lists them (M3).
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Goods(pub Vec<Good>);

/// Why a string is not a list of goods.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum GoodsError {
    /// A field is wrong.
    #[error(transparent)]
    Misread(#[from] Misread),
    /// The text before a first comma cannot stand for a product.
    #[error("column {column}: {error}")]
    Label {
        /// Where it begins, in characters from 1.
        column: usize,
        /// What is wrong with it.
        error: LabelError,
    },
}

/// Why GaG's grammar cannot list these goods.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TranslateError {
    /// A product has a name and no number (AMB-38).
    #[error("{label:?} is a name; GaG's grammar has only numbers from 0 to 2147483647")]
    Name {
        /// The name.
        label: String,
    },
    /// Such a list of products cannot exist.
    #[error(transparent)]
    Products(#[from] Reason),
}

impl Goods {
    /// Reads a goods string (M3).
    ///
    /// # Errors
    ///
    /// A product does not have four fields, or one of them is wrong.
    pub fn read(text: &str) -> Result<Self, GoodsError> {
        let whole = Reader::whole(text).trimmed();
        let whole = whole.without_last(';');
        if whole.text.is_empty() {
            return Ok(Self::default());
        }
        let goods: Result<_, GoodsError> = whole.parts(';').map(read_good).collect();
        goods.map(Self)
    }

    /// The same list in the form of GaG's grammar (AMB-39).
    ///
    /// # Errors
    ///
    /// A product has a name, or two have the same number.
    pub fn products(&self) -> Result<Products, TranslateError> {
        let product = |good: &Good| match good.id() {
            Some(id) => Ok(Product {
                id,
                square: good.square,
                side: good.side,
            }),
            None => Err(TranslateError::Name {
                label: good.label.clone(),
            }),
        };
        let products: Result<_, _> = self.0.iter().map(product).collect();
        Ok(Products::new(products?).map_err(Reason::from)?)
    }
}

impl From<&Products> for Goods {
    fn from(products: &Products) -> Self {
        Self(products.as_slice().iter().map(Good::from).collect())
    }
}

impl fmt::Display for Goods {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, good) in self.0.iter().enumerate() {
            if index > 0 {
                formatter.write_str(";")?;
            }
            good.fmt(formatter)?;
        }
        Ok(())
    }
}

fn read_good(text: Word<'_>) -> Result<Good, GoodsError> {
    let mut fields = fields_of(text);
    let label = fields.next();
    let square = Node {
        x: fields
            .next()
            .number("the x of its square, 0 to 255", 0, 255)?,
        y: fields
            .next()
            .number("the y of its square, 0 to 255", 0, 255)?,
    };
    let side = fields.next();
    let wanted = "a side from 0 to 3";
    let number = side.number(wanted, 0, 3)?;
    let side = side.read(wanted, |_| Heading::from_number(number))?;
    fields.end("the end of the product behind its side")?;
    Good::new(label.text, square, side).map_err(|error| GoodsError::Label {
        column: label.column(),
        error,
    })
}

/// The fields of a string with commas between them.
struct Fields<'a, I: Iterator<Item = Word<'a>>> {
    parts: I,
    /// The empty place behind the last field.
    end: Word<'a>,
}

fn fields_of<'a>(text: Word<'a>) -> Fields<'a, impl Iterator<Item = Word<'a>>> {
    Fields {
        parts: text.parts(','),
        end: text.end(),
    }
}

impl<'a, I: Iterator<Item = Word<'a>>> Fields<'a, I> {
    /// The next field without blanks around it; after the last one an empty field.
    fn next(&mut self) -> Word<'a> {
        self.parts.next().unwrap_or(self.end).trimmed()
    }

    fn end(mut self, wanted: &'static str) -> Result<(), Misread> {
        match self.parts.next() {
            Some(field) => Err(field.trimmed().misread(wanted)),
            None => Ok(()),
        }
    }
}
