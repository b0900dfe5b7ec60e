//! [`OpenCalibration`]: what must outlive a commissioning that is killed.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// The note beside a description that the line sensors were calibrated, and that this was neither
/// saved nor taken back. Their board keeps its thresholds, whoever dies. The next commissioning finds
/// the note, and can still take them back.
#[derive(Clone, Debug)]
pub struct OpenCalibration(PathBuf);

impl OpenCalibration {
    /// Of the robot that this file describes, or would describe.
    pub fn beside(description: &Path) -> Self {
        let mut name = description.as_os_str().to_owned();
        name.push(".calibrated");
        Self(name.into())
    }

    /// Whether there is such a calibration.
    pub fn is_there(&self) -> bool {
        self.0.exists()
    }

    /// One begins.
    ///
    /// # Errors
    /// The disk refuses the note.
    pub fn begin(&self) -> Result<()> {
        let write = || format!("cannot write {}", self.0.display());
        if let Some(folder) = self.0.parent() {
            fs::create_dir_all(folder).with_context(write)?;
        }
        fs::write(&self.0, "").with_context(write)
    }

    /// It is saved, or taken back.
    ///
    /// # Errors
    /// The note stays.
    pub fn end(&self) -> Result<()> {
        match fs::remove_file(&self.0) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(error).with_context(|| format!("cannot remove {}", self.0.display()))
            }
            _ => Ok(()),
        }
    }
}
