//! The boards' EEPROM in files, so that settings outlive the process as they outlive a real
//! board's power.
//!
//! A file is replaced in one step, so a kill leaves the old content or the new. A missing file is
//! an EEPROM that was never written.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::chip::{Chip, EEPROM};

/// Why an EEPROM cannot be kept.
#[derive(Debug, Error)]
#[error("cannot keep the EEPROM {path}: {source}; is its folder there and writable?")]
pub struct EepromError {
    /// The file.
    path: PathBuf,
    /// What the system says.
    source: io::Error,
}

/// One board's EEPROM.
#[derive(Debug)]
pub(crate) struct EepromFile {
    path: PathBuf,
    saved: Vec<u8>,
}

impl EepromFile {
    /// Fills a chip that has not run with what the file holds.
    pub(crate) fn load(path: &Path, chip: &Chip) -> Result<Self, EepromError> {
        let path = path.to_owned();
        match fs::read(&path) {
            Ok(content) => chip.set_eeprom(&content),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(source) => return Err(EepromError { path, source }),
        }
        let saved = chip.eeprom(EEPROM);
        Ok(Self { path, saved })
    }

    /// Writes the file if the chip has changed its EEPROM.
    pub(crate) fn save(&mut self, chip: &Chip) -> Result<(), EepromError> {
        let content = chip.eeprom(EEPROM);
        if content == self.saved {
            return Ok(());
        }
        let mut fresh = self.path.clone().into_os_string();
        fresh.push(".new");
        fs::write(&fresh, &content)
            .and_then(|()| fs::rename(&fresh, &self.path))
            .map_err(|source| EepromError {
                path: self.path.clone(),
                source,
            })?;
        self.saved = content;
        Ok(())
    }
}
