//! The warehouse as the external computer keeps it: a TOML file, read as a whole and saved
//! atomically.
//!
//! ```toml
//! size = [4, 3]                 # squares each way, 1 to 255
//! side_length_cm = 40           # 1 to 65535
//! delivery = [0, 0]             # a corner node
//!
//! [[product]]
//! id = 7                        # 0 to 2147483647
//! name = "screws"               # for people, as Called has it; robot and GaG know numbers only
//! square = [1, 0]
//! side = "down"                 # from where it is reached: left, up, right, down
//! ```
//!
//! What only a simulated world reads (`[exit]`, `[floor]`, `[[obstacle]]`) is kept as it is.
//! Comments are not. Any other key is an error, as in the simulated world's reading of the file
//! (`lager_plant::Warehouse`): a mistyped one would leave a hall without its goods.

use std::io;
use std::path::{Path, PathBuf};

use lager_lines::gag::{Answer, ListWord};
use lager_lines::{
    Called, Coord, Direction, Map, MapError, NamesError, Product, ProductId, Products,
    ProductsError, SideLength, UnknownProduct, check_names, to_line,
};
use lager_plant::{Exit, Floor, Obstacle};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::files::{self, ReadError};

/// A warehouse as its file has it. [`Warehouse::check`] says what of it cannot be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Warehouse {
    /// Squares in x and in y, 1 to 255 each.
    pub size: [u8; 2],
    /// Side of a square in cm, 1 to 65 535.
    pub side_length_cm: u16,
    /// The corner node of the delivery.
    #[serde(default)]
    pub delivery: [u8; 2],
    /// The goods.
    #[serde(default, rename = "product", skip_serializing_if = "Vec::is_empty")]
    pub products: Vec<StoredProduct>,
    /// The way out of a simulated one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exit: Option<Exit>,
    /// How light a simulated one looks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor: Option<Floor>,
    /// What stands in the way in a simulated one.
    #[serde(default, rename = "obstacle", skip_serializing_if = "Vec::is_empty")]
    pub obstacles: Vec<Obstacle>,
}

/// One product of the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredProduct {
    /// Its number, 0 to 2 147 483 647.
    pub id: i32,
    /// What people call it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The square it stands in.
    pub square: [u8; 2],
    /// The side it is reached from: `left`, `up`, `right` or `down`.
    pub side: String,
}

/// What of a warehouse cannot be.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WarehouseError {
    /// It has no squares, or its delivery is not at a corner.
    #[error(transparent)]
    Map(#[from] MapError),
    /// Squares have a side.
    #[error("side_length_cm is 0; it must be from 1 to 65535 cm")]
    SideLength,
    /// Product numbers are not negative.
    #[error("product {id} has a negative number; numbers start at 0")]
    Negative {
        /// The number.
        id: i32,
    },
    /// There is no such side.
    #[error("product {id} is reached from {side:?}; write left, up, right or down")]
    Side {
        /// The product.
        id: i32,
        /// As given.
        side: String,
    },
    /// A product stands outside.
    #[error(
        "product {id} stands in the square [{x}, {y}], but the last one is [{last_x}, {last_y}]"
    )]
    Outside {
        /// The product.
        id: i32,
        /// As given.
        x: u8,
        /// As given.
        y: u8,
        /// The last square in x.
        last_x: u8,
        /// The last square in y.
        last_y: u8,
    },
    /// Two products have one number.
    #[error(transparent)]
    Products(#[from] ProductsError),
    /// People could not call them so.
    #[error(transparent)]
    Names(#[from] NamesError),
    /// A robot cannot be told of all of them, since they stand in one line.
    #[error(
        "the warehouse has {count} products, which do not fit in one line of the robot's language; \
         list fewer"
    )]
    TooMany {
        /// How many there are.
        count: usize,
    },
}

impl Warehouse {
    /// What robots and GaG are told of it.
    ///
    /// # Errors
    ///
    /// When there can be no such warehouse.
    pub fn check(&self) -> Result<(SideLength, Map, Products), WarehouseError> {
        let coord = |[x, y]: [u8; 2]| Coord { x, y };
        let side = SideLength::new(self.side_length_cm).ok_or(WarehouseError::SideLength)?;
        let map = Map::new(coord(self.size), coord(self.delivery))?;
        let product = |stored: &StoredProduct| {
            let id = stored.id;
            Ok(Product {
                id: ProductId::new(id).ok_or(WarehouseError::Negative { id })?,
                square: coord(stored.square),
                side: Direction::from_word(&stored.side).ok_or_else(|| WarehouseError::Side {
                    id,
                    side: stored.side.clone(),
                })?,
            })
        };
        let products: Result<Vec<_>, WarehouseError> = self.products.iter().map(product).collect();
        let products = Products::new(products?)?;
        check_names(self.called().filter_map(|(_, name)| name))?;
        let list = Answer::Products(ListWord::Prodlist, products.clone());
        if to_line(&list).is_err() {
            return Err(WarehouseError::TooMany {
                count: products.as_slice().len(),
            });
        }
        match products.outside(map) {
            None => Ok((side, map, products)),
            Some(product) => Err(WarehouseError::Outside {
                id: product.id.get(),
                x: product.square.x,
                y: product.square.y,
                last_x: map.size().x - 1,
                last_y: map.size().y - 1,
            }),
        }
    }

    /// The number of the product that a person calls so.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn find(&self, called: &Called) -> Result<ProductId, UnknownProduct> {
        called.among(self.called())
    }

    /// Number and name of each product.
    fn called(&self) -> impl Iterator<Item = (i32, Option<&str>)> + Clone {
        let products = self.products.iter();
        products.map(|product| (product.id, product.name.as_deref()))
    }
}

/// Why a warehouse is not read.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file is not read, or is no warehouse.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There can be no such warehouse.
    #[error("{}: {error}", .path.display())]
    Warehouse {
        /// The file.
        path: PathBuf,
        /// What cannot be.
        error: WarehouseError,
    },
}

/// Reads a warehouse that has been checked.
///
/// # Errors
///
/// When the file is not read, is no warehouse, or describes one that cannot be.
pub fn load(path: &Path) -> Result<Warehouse, LoadError> {
    let warehouse: Warehouse = files::read_toml(path)?;
    let checked = warehouse.check();
    checked.map_err(|error| LoadError::Warehouse {
        path: path.to_owned(),
        error,
    })?;
    Ok(warehouse)
}

/// Why a warehouse or a queue is not saved. The file is as it was ([`files::replace`]).
#[derive(Debug, Error)]
pub enum SaveError {
    /// There can be no such warehouse.
    #[error("the warehouse is not saved: {0}")]
    Warehouse(#[from] WarehouseError),
    /// It cannot be written as TOML.
    #[error("it is not saved: {0}")]
    Toml(#[from] toml::ser::Error),
    /// What would be written could not be read again.
    #[error("{} is not saved: it could not be read again", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
    },
    /// The disk did not take it.
    #[error("{} is not saved: {error}", .path.display())]
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
/// When there can be no such warehouse or the disk does not take it.
pub fn save(path: &Path, warehouse: &Warehouse) -> Result<(), SaveError> {
    warehouse.check()?;
    save_toml(path, warehouse)
}

/// Saves a value as TOML, once it has been read from that text again.
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
