//! A file in place of a board's EEPROM, so that what the board keeps survives the process as a real
//! board's settings survive a power cut.
//!
//! A file is replaced in one step, so a kill leaves either the old or the new content. A missing
//! file stands for an EEPROM that was never written.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// How many bytes the chip has; those behind the ones that a program uses stay as they are.
const LENGTH: usize = 4_096;
/// What a byte holds that was never written.
const ERASED: u8 = 0xFF;

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
pub struct EepromFile {
    path: PathBuf,
    content: Vec<u8>,
}

impl EepromFile {
    /// Reads the file of the board with this name in `folder`.
    ///
    /// # Errors
    /// The file is there and cannot be read.
    pub fn open(folder: &Path, board: &str) -> Result<Self, EepromError> {
        let path = folder.join(board).with_extension("eeprom");
        let mut content = match fs::read(&path) {
            Ok(content) => content,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(source) => return Err(EepromError { path, source }),
        };
        content.resize(LENGTH, ERASED);
        Ok(Self { path, content })
    }

    /// All bytes of the EEPROM.
    #[must_use]
    pub fn content(&self) -> &[u8] {
        &self.content
    }

    /// Writes the file if `used`, the first bytes of the EEPROM, have changed.
    ///
    /// # Errors
    /// The file cannot be written. The next save tries it again.
    pub fn save(&mut self, used: &[u8]) -> Result<(), EepromError> {
        if self.content.starts_with(used) {
            return Ok(());
        }
        let mut content = self.content.clone();
        let count = used.len().min(LENGTH);
        content[..count].copy_from_slice(&used[..count]);
        let mut fresh = self.path.clone().into_os_string();
        fresh.push(".new");
        fs::write(&fresh, &content)
            .and_then(|()| fs::rename(&fresh, &self.path))
            .map_err(|source| EepromError {
                path: self.path.clone(),
                source,
            })?;
        self.content = content;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_saved_is_there_again_and_the_rest_stays_erased() {
        let folder = std::env::temp_dir().join(format!("lager-eeprom-{}", std::process::id()));
        let mut file = EepromFile::open(&folder, "steering").expect("nothing is there");
        file.save(&[ERASED; 3]).expect("nothing to write");
        assert!(file.save(&[1, 2, 3]).is_err(), "there is no folder");
        fs::create_dir(&folder).expect("a folder");
        file.save(&[1, 2, 3]).expect("the next save writes it");
        let again = EepromFile::open(&folder, "steering").expect("a file");
        assert_eq!(again.content()[..4], [1, 2, 3, ERASED]);
        assert_eq!(again.content().len(), LENGTH);
        let other = EepromFile::open(&folder, "sensor").expect("nothing is there");
        assert_eq!(other.content(), [ERASED; LENGTH]);
        fs::remove_dir_all(&folder).expect("a folder");
    }
}
