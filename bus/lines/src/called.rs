//! How a person names a product: by its number, or by the name that the warehouse gives it
//! (AMB-38).
//!
//! Robot and GaG know only numbers. So a name is turned into its number where a person uses it. A
//! name is not a number, has no comma, semicolon or line break and no blank at its ends, as in the
//! goods string (M3). No two products of a warehouse have the same name.
//!
//! ```
//! use lager_floor::ProductId;
//! use lager_lines::Called;
//!
//! let goods = [(7, Some("screws")), (12, None)];
//! let number = |text: &str| text.parse::<Called>().unwrap().among(goods);
//! assert_eq!(number("screws"), Ok(ProductId::new(7).unwrap()));
//! assert_eq!(number("12"), Ok(ProductId::new(12).unwrap()));
//! assert_eq!(
//!     number("nails").unwrap_err().to_string(),
//!     "the warehouse has no goods nails; it has 7 (screws), 12",
//! );
//! assert_eq!(
//!     "-1".parse::<Called>().unwrap_err().to_string(),
//!     "-1 is no number of goods; goods are numbered from 0 to 2147483647",
//! );
//! ```

use core::fmt::{self, Write as _};
use core::str::FromStr;
use std::collections::BTreeSet;

use lager_floor::ProductId;
use lager_orders::{Code, Reason};
use thiserror::Error;

use crate::strings::{LabelError, check_label};

/// A product as a person names it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Called {
    /// By its number.
    Number(ProductId),
    /// By its name.
    Name(String),
}

/// Why no product can have such a name or number.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum CalledError {
    /// It is a number that no product can have.
    #[error("{text} is no number of goods; goods are numbered from 0 to 2147483647")]
    Number {
        /// The text.
        text: String,
    },
    /// No product can have such a name.
    #[error(transparent)]
    Label(#[from] LabelError),
}

/// No product has this name or number.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the warehouse has no goods {called}; it has {known}")]
pub struct UnknownProduct {
    /// The name or number.
    pub called: Called,
    /// The warehouse's products, with their names.
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
    /// The number of the product with this name or number, from `products` with their names.
    ///
    /// # Errors
    ///
    /// No product has it.
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

/// Checks whether a warehouse can have these names.
///
/// # Errors
///
/// A name is not valid, or two products have the same name.
pub fn check_names<'n>(names: impl IntoIterator<Item = &'n str>) -> Result<(), Reason> {
    let mut seen = BTreeSet::new();
    for name in names {
        let why = match name.parse() {
            Ok(Called::Name(_)) if seen.insert(name) => continue,
            Ok(Called::Name(_)) => Code::NameTwice,
            Ok(Called::Number(_)) => Code::NameNumber,
            Err(_) => Code::NameUnfit,
        };
        return Err(Reason::new(why, &[&name]));
    }
    Ok(())
}

/// Products as a list, such as `7 (screws), 12`.
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
