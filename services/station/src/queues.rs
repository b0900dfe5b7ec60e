//! The robots' queues as they lie in a file beside the warehouse's, so that orders outlive a
//! station that was killed.
//!
//! ```toml
//! r1 = [3, 1, 2]                # the next one first
//! r2 = [7]
//! ```
//!
//! It is saved after robots have been told. So a product that a robot was told at the last moment
//! may still be in the file and be told again, but none is lost.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::files::{self, ReadError};
use crate::warehouse::{SaveError, save_toml};

/// The products that wait, by robot; robots for which none waits are left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Queues(pub BTreeMap<String, Vec<i32>>);

impl Queues {
    /// Where they lie for the warehouse of `warehouse`.
    pub fn beside(warehouse: &Path) -> PathBuf {
        files::beside(warehouse, "queue")
    }

    /// Reads them; none where there is no file. A file that holds something else is moved out of
    /// the way, which is said: what waited is lost, and everything else goes on.
    ///
    /// # Errors
    ///
    /// When the file is there and is not read.
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
                tracing::warn!("what waited to be fetched is lost: {error}; it is now {aside}");
                Ok(Self::default())
            }
            read => read,
        }
    }

    /// Saves them as the warehouse is saved.
    ///
    /// # Errors
    ///
    /// When the disk does not take them.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        save_toml(path, self)
    }
}
