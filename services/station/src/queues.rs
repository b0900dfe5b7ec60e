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
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::warehouse::{LoadError, SaveError, replace_with};

/// The products that wait, by robot; robots for which none waits are left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Queues(pub BTreeMap<String, Vec<i32>>);

impl Queues {
    /// Where they lie for the warehouse of `warehouse`.
    pub fn beside(warehouse: &Path) -> PathBuf {
        let mut path = OsString::from(warehouse);
        path.push(".queue");
        path.into()
    }

    /// Reads them; none where there is no file.
    ///
    /// # Errors
    ///
    /// When the file is not read or holds something else.
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        if !path.exists() {
            return Ok(Self::default());
        }
        let at = || path.to_owned();
        let text =
            fs::read_to_string(path).map_err(|error| LoadError::Read { path: at(), error })?;
        toml::from_str(&text).map_err(|error| LoadError::Toml { path: at(), error })
    }

    /// Saves them as the warehouse is saved.
    ///
    /// # Errors
    ///
    /// When the disk does not take them.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        let text = toml::to_string(self)?;
        replace_with(path, &text)
    }
}
