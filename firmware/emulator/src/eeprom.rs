//! Keeps the boards' EEPROM in files, so that settings survive the process as a real board's
//! settings survive a power cut.
//!
//! A file is replaced in one step, so a kill leaves either the old or the new content. A missing
//! file stands for an EEPROM that was never written.

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
    /// The system's error.
    source: io::Error,
}

/// One board's EEPROM.
#[derive(Debug)]
pub(crate) struct EepromFile {
    path: PathBuf,
    saved: Vec<u8>,
}

impl EepromFile {
    /// Fills the EEPROM of a chip that has not run yet with the file's content.
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
