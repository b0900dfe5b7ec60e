//! The robots' queues, in a file beside the warehouse's file. So orders are not lost when a station
//! is killed.
//!
//! ```toml
//! r1 = [3, 1, 2]                # the next one first
//! r2 = [7]
//! ```
//!
//! The station tells a robot its product first, and saves the file then. If the station is killed
//! in between, it tells the robot this product again. No product is lost.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::files::{self, ReadError};
use crate::warehouse::{SaveError, save_toml};

/// The products that wait, by robot, without the robots that have none.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Queues(pub BTreeMap<String, Vec<i32>>);

impl Queues {
    /// The queues' file for the warehouse in the file `warehouse`.
    pub fn beside(warehouse: &Path) -> PathBuf {
        files::beside(warehouse, "queue")
    }

    /// Reads the queues; no file means no queues. If the file holds something else, the station
    /// moves it aside and logs that its orders are lost. Everything else goes on.
    ///
    /// # Errors
    ///
    /// The file exists and cannot be read.
    pub fn load(path: &Path) -> Result<Self, ReadError> {
        match files::read_toml(path) {
            Err(ReadError::Read { error, .. }) if error.kind() == io::ErrorKind::NotFound => {
                Ok(Self::default())
            }
            Err(error) if error.is_damage() => {
                let aside = files::set_aside(path).map_err(|error| ReadError::Read {
                    path: path.to_owned(),
                    error,
                })?;
                let aside = aside.display();
                tracing::warn!("the orders that waited are lost: {error}; the file is now {aside}");
                Ok(Self::default())
            }
            read => read,
        }
    }

    /// Saves the queues in the same way as the warehouse.
    ///
    /// # Errors
    ///
    /// The disk refuses the file.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        save_toml(path, self)
    }
}
