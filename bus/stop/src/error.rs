//! [`StopError`]: why the stop word cannot be used. Every message says what to do.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use lager_home::Shortage;

/// Why the stop word cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StopError {
    /// The disk has no room for the file.
    #[error(
        "there is no room for the stop word {path}: make some (`df {path}` shows where), or switch the robot off at its battery"
    )]
    Full {
        /// The file.
        path: PathBuf,
    },
    /// The user has no permission to use the file.
    #[error(
        "this user may not use the stop word {path}: stop the robot as the user who runs it (sudo -u USER)"
    )]
    Permission {
        /// The file.
        path: PathBuf,
    },
    /// The process can open no more files.
    #[error("the stop word {path} cannot be used: {shortage}")]
    Short {
        /// The file.
        path: PathBuf,
        /// The resource of which there is too little.
        shortage: Shortage,
    },
    /// Any other error of the system.
    #[error("the stop word {path} cannot be used ({detail}); check that its folder exists")]
    System {
        /// The file.
        path: PathBuf,
        /// The system's message.
        detail: String,
    },
}

impl StopError {
    /// The error for the file at `path` that the system's `error` means.
    pub(crate) fn new(path: &Path, error: &Error) -> Self {
        let path = path.to_owned();
        if let Some(shortage) = Shortage::behind(error) {
            return Self::Short { path, shortage };
        }
        match error.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Self::Full { path },
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                Self::Permission { path }
            }
            _ => Self::System {
                path,
                detail: error.to_string(),
            },
        }
    }
}
