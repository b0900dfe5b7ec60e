//! The warehouse as the external computer keeps it: a TOML file, read as a whole and saved
//! atomically.
//!
//! ```toml
//! size = [4, 3]                 # squares each way, 1 to 99
//! side_length_cm = 40           # 40 to 500
//! delivery = [0, 0]             # a corner node
//!
//! [[product]]
//! id = 7                        # 0 to 2147483647
//! name = "screws"               # for people, as Called has it; robot and GaG know numbers only
//! square = [1, 0]
//! side = "down"                 # from where it is reached: left, up, right, down
//! ```
//!
//! The station keeps the tables that only a simulated world reads (`[exit]`, `[floor]`,
//! `[[obstacle]]`), but no comments. Any other key is an error, because a mistyped key would leave
//! a hall without its goods. All programs read such a file with [`load`].

use std::io;
use std::path::{Path, PathBuf};

use lager_floor::{Grid, ProductId, SideLength};
use lager_lines::gag::{Answer, ListWord};
use lager_lines::{Called, Products, UnknownProduct, check_names, to_line};
use lager_orders::{Code, Reason};
use lager_plant::Warehouse;
use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

use crate::files::{self, ReadError};

/// The part of a warehouse that robots and GaG are told.
///
/// # Errors
///
/// Such a warehouse cannot exist.
pub fn told(warehouse: &Warehouse) -> Result<(SideLength, Grid, Products), Reason> {
    let (side, grid, products) = warehouse.told()?;
    let products = Products::new(products).map_err(Reason::from)?;
    check_names(called(warehouse).filter_map(|(_, name)| name))?;
    let list = Answer::Products(ListWord::Prodlist, products.clone());
    if to_line(&list).is_err() {
        let count = products.as_slice().len();
        return Err(Reason::new(Code::GoodsLine, &[&count]));
    }
    Ok((side, grid, products))
}

/// The number of the product with this name or number.
///
/// # Errors
///
/// There is no such product.
pub fn find(warehouse: &Warehouse, wanted: &Called) -> Result<ProductId, UnknownProduct> {
    wanted.among(called(warehouse))
}

/// Number and name of each product.
fn called(warehouse: &Warehouse) -> impl Iterator<Item = (i32, Option<&str>)> + Clone {
    let products = warehouse.products.iter();
    products.map(|product| (product.id, product.name.as_deref()))
}

/// Why a warehouse could not be read.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file could not be read, or does not hold a warehouse.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Such a warehouse cannot exist.
    #[error("{}: {error}", .path.display())]
    Warehouse {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: Reason,
    },
}

/// Reads a warehouse and checks it.
///
/// # Errors
///
/// The file could not be read, does not hold a warehouse, or such a warehouse cannot exist.
pub fn load(path: &Path) -> Result<Warehouse, LoadError> {
    let warehouse: Warehouse = files::read_toml(path)?;
    told(&warehouse).map_err(|error| LoadError::Warehouse {
        path: path.to_owned(),
        error,
    })?;
    Ok(warehouse)
}

/// Why a warehouse or a queue was not saved. The file is as before ([`files::replace`]).
#[derive(Debug, Error)]
pub enum SaveError {
    /// Such a warehouse cannot exist.
    #[error("{}", Reason::from(self))]
    Warehouse(#[from] Reason),
    /// It cannot be written as TOML.
    #[error("it is not saved: {0}")]
    Toml(#[from] toml::ser::Error),
    /// The text could not be read again.
    #[error("{}", Reason::from(self))]
    Unreadable {
        /// The file.
        path: PathBuf,
    },
    /// The disk refused the file.
    #[error("{}", Reason::from(self))]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
}

/// Saves a warehouse as [`files::replace`] does.
///
/// # Errors
///
/// Such a warehouse cannot exist, or the disk refuses the file.
pub fn save(path: &Path, warehouse: &Warehouse) -> Result<(), SaveError> {
    told(warehouse)?;
    save_toml(path, warehouse)
}

/// Saves a value as TOML, after reading it back from the text as a check.
pub(crate) fn save_toml<T>(path: &Path, value: &T) -> Result<(), SaveError>
where
    T: Serialize + DeserializeOwned + PartialEq,
{
    let text = toml::to_string(value)?;
    let is_too_long = text.len() as u64 > files::MOST_BYTES;
    if is_too_long || toml::from_str::<T>(&text).ok().as_ref() != Some(value) {
        return Err(SaveError::Unreadable {
            path: path.to_owned(),
        });
    }
    files::replace(path, &text).map_err(|error| SaveError::Write {
        path: path.to_owned(),
        error,
    })
}
