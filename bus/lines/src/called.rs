//! What a person calls a product: its number, or the name that its warehouse gives it (AMB-38).
//!
//! Robot and GaG know numbers only, so a name is looked up where a person uses it, and a number
//! goes on from there. A name is no number, has neither comma, semicolon nor line break and no
//! blank at an end, as in the goods string (M3), and no two products of a warehouse share one.
//!
//! ```
//! use lager_lines::{Called, ProductId};
//!
//! let goods = [(7, Some("screws")), (12, None)];
//! let number = |text: &str| text.parse::<Called>().unwrap().among(goods);
//! assert_eq!(number("screws"), Ok(ProductId::new(7).unwrap()));
//! assert_eq!(number("12"), Ok(ProductId::new(12).unwrap()));
//! assert_eq!(
//!     number("nails").unwrap_err().to_string(),
//!     "the warehouse has no product nails; it has 7 (screws), 12",
//! );
//! assert_eq!(
//!     "-1".parse::<Called>().unwrap_err().to_string(),
//!     "-1 is no product's number; products are numbered from 0 to 2147483647",
//! );
//! ```

use core::fmt::{self, Write as _};
use core::str::FromStr;
use std::collections::BTreeSet;

use thiserror::Error;

use crate::strings::{LabelError, check_label};
use crate::warehouse::ProductId;

/// A product as a person calls it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Called {
    /// By its number.
    Number(ProductId),
    /// By its name.
    Name(String),
}

/// Why nothing can be called so.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum CalledError {
    /// It is a number, and none of a product.
    #[error("{text} is no product's number; products are numbered from 0 to 2147483647")]
    Number {
        /// As given.
        text: String,
    },
    /// It cannot stand for a product.
    #[error(transparent)]
    Label(#[from] LabelError),
}

/// Why a warehouse cannot have these names.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NamesError {
    /// Nothing can be called so.
    #[error("a product is named {name:?}: {why}")]
    Unfit {
        /// The name.
        name: String,
        /// Why not.
        why: CalledError,
    },
    /// It would be taken for a number.
    #[error("a product is named {name:?}, which would be taken for its number; use a letter")]
    Number {
        /// The name.
        name: String,
    },
    /// Two have it.
    #[error("two products are named {name:?}; every name needs to be another one")]
    Twice {
        /// The name.
        name: String,
    },
}

/// There is no product that is called so.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the warehouse has no product {called}; it has {known}")]
pub struct UnknownProduct {
    /// What was called.
    pub called: Called,
    /// The products that there are, as people call them.
    pub known: String,
}

impl FromStr for Called {
    type Err = CalledError;

    fn from_str(text: &str) -> Result<Self, CalledError> {
        let digits = text.strip_prefix('-').unwrap_or(text);
        if !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()) {
            let number = text.parse().ok().and_then(ProductId::new);
            let text = text.to_owned();
            return number.map(Self::Number).ok_or(CalledError::Number { text });
        }
        check_label(text)?;
        Ok(Self::Name(text.to_owned()))
    }
}

impl fmt::Display for Called {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(formatter),
            Self::Name(name) => formatter.write_str(name),
        }
    }
}

impl From<ProductId> for Called {
    fn from(number: ProductId) -> Self {
        Self::Number(number)
    }
}

impl Called {
    /// The number of the one that is called so among `products`, each with its number and name.
    ///
    /// # Errors
    ///
    /// When none of them is.
    pub fn among<'n>(
        &self,
        products: impl IntoIterator<Item = (i32, Option<&'n str>)> + Clone,
    ) -> Result<ProductId, UnknownProduct> {
        let is_it = |(number, name): &(i32, Option<&str>)| match self {
            Self::Number(wanted) => wanted.get() == *number,
            Self::Name(wanted) => *name == Some(wanted.as_str()),
        };
        let found = products.clone().into_iter().find(is_it);
        found
            .and_then(|(number, _)| ProductId::new(number))
            .ok_or_else(|| UnknownProduct {
                called: self.clone(),
                known: listed(products),
            })
    }
}

/// Finds out whether a warehouse can have these names.
///
/// # Errors
///
/// When one of them is none, or two are the same.
pub fn check_names<'n>(names: impl IntoIterator<Item = &'n str>) -> Result<(), NamesError> {
    let mut seen = BTreeSet::new();
    for name in names {
        let owned = || name.to_owned();
        match name.parse() {
            Ok(Called::Name(_)) => {}
            Ok(Called::Number(_)) => return Err(NamesError::Number { name: owned() }),
            Err(why) => {
                let name = owned();
                return Err(NamesError::Unfit { name, why });
            }
        }
        if !seen.insert(name) {
            return Err(NamesError::Twice { name: owned() });
        }
    }
    Ok(())
}

/// Products in a row, as in `7 (screws), 12`.
fn listed<'n>(products: impl IntoIterator<Item = (i32, Option<&'n str>)>) -> String {
    let mut list = String::new();
    for (number, name) in products {
        let comma = if list.is_empty() { "" } else { ", " };
        // Writing to a String cannot fail.
        let _ = write!(list, "{comma}{number}");
        if let Some(name) = name {
            let _ = write!(list, " ({name})");
        }
    }
    match list.is_empty() {
        true => "none".to_owned(),
        false => list,
    }
}
