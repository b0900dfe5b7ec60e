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
//! What else stands in the file, such as the way out of a simulated warehouse, is kept as it is.
//! Comments are not.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use lager_lines::gag::{Answer, ListWord};
use lager_lines::{
    Called, Coord, Direction, Map, MapError, NamesError, Product, ProductId, Products,
    ProductsError, SideLength, UnknownProduct, check_names, to_line,
};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A warehouse as its file has it. [`Warehouse::check`] says what of it cannot be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// What only others read.
    #[serde(flatten)]
    pub rest: toml::Table,
}

/// One product of the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
    /// The file is not read.
    #[error("cannot read {}: {error}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// It is no warehouse.
    #[error("{}: {error}", .path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        error: toml::de::Error,
    },
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
    let at = || path.to_owned();
    let text = fs::read_to_string(path).map_err(|error| LoadError::Read { path: at(), error })?;
    let warehouse: Warehouse =
        toml::from_str(&text).map_err(|error| LoadError::Toml { path: at(), error })?;
    let checked = warehouse.check();
    checked.map_err(|error| LoadError::Warehouse { path: at(), error })?;
    Ok(warehouse)
}

/// Why a warehouse or a queue is not saved. The file is as it was; if only its folder could not be
/// synchronised it is the new one, which a loss of power may undo.
#[derive(Debug, Error)]
pub enum SaveError {
    /// There can be no such warehouse.
    #[error("the warehouse is not saved: {0}")]
    Warehouse(#[from] WarehouseError),
    /// It cannot be written as TOML.
    #[error("it is not saved: {0}")]
    Toml(#[from] toml::ser::Error),
    /// The disk did not take it.
    #[error("{} is not saved: {error}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
}

/// Saves a warehouse so that whoever reads the file, even after a loss of power, finds the one
/// before or this one and nothing between: a new file beside it is written and synchronised, takes
/// its name, and the folder is synchronised.
///
/// One process saves at a time. If it is killed half way, the file beside stays and is replaced by
/// the next one that saves.
///
/// # Errors
///
/// When there can be no such warehouse or the disk does not take it.
pub fn save(path: &Path, warehouse: &Warehouse) -> Result<(), SaveError> {
    warehouse.check()?;
    replace_with(path, &toml::to_string(warehouse)?)
}

/// Replaces a file by one with `text` in it, as [`save`] has it.
pub(crate) fn replace_with(path: &Path, text: &str) -> Result<(), SaveError> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    let beside = PathBuf::from(beside);
    replace(path, &beside, text.as_bytes()).map_err(|error| {
        // What could not be finished is of no use, and its name is free again.
        let _ = fs::remove_file(&beside);
        SaveError::Write {
            path: path.to_owned(),
            error,
        }
    })
}

fn replace(path: &Path, beside: &Path, text: &[u8]) -> io::Result<()> {
    let mut file = File::create(beside)?;
    file.write_all(text)?;
    file.sync_all()?;
    fs::rename(beside, path)?;
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}
