//! Why a recording ends.

use std::io;
use std::path::{Path, PathBuf};

use lager_journal::WriteError;
use lager_ports::{IntrospectError, PlaceError, PortError, ReceiveError};

use crate::disk::{Fate, is_full};

/// Why a recording ended early or did not begin.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file exists already.
    #[error("{} is there already; choose another name, or move it away", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be made.
    #[error("cannot make {}: {error}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// There is no room for a file.
    #[error("there is no room for {}; make room, or record onto another disk", path.display())]
    NoRoom {
        /// The file.
        path: PathBuf,
    },
    /// There is no room for more.
    #[error(
        "the disk is full; {} ends here and is whole. Make room, or record fewer topics with --topic",
        path.display()
    )]
    Full {
        /// The file.
        path: PathBuf,
    },
    /// The file may not become longer.
    #[error(
        "{} may not become longer (`ulimit -f`, or the file system's own limit); it ends here and \
         is whole. Record into several files with --split-size, or raise the limit",
        path.display()
    )]
    TooLong {
        /// The file.
        path: PathBuf,
    },
    /// Somebody took the file away, and the recording went on in another one.
    #[error("{} {fate}; the recording goes on in {}", path.display(), next.display())]
    Gone {
        /// The file.
        path: PathBuf,
        /// What happened to it.
        fate: Fate,
        /// The next file.
        next: PathBuf,
    },
    /// Somebody took the file away, and the recorder cannot make another one in its place.
    #[error("{} {fate}; the recording ends here: {why}", path.display())]
    GoneForGood {
        /// The file.
        path: PathBuf,
        /// What happened to it.
        fate: Fate,
        /// Why the recorder cannot make another file.
        why: Box<RecordError>,
    },
    /// The folder is now on another disk than the recording's first file.
    #[error("its disk is no longer at {}", path.display())]
    OtherDisk {
        /// The folder.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error(
        "cannot write {}: {error}; `lager bag recover` saves what is on the disk",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A message cannot be packed.
    #[error(transparent)]
    Pack(#[from] WriteError),
    /// A sample could not be put into JSON.
    #[error("cannot put a sample into JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// A topic cannot be opened.
    #[error(transparent)]
    Open(#[from] PortError),
    /// A topic cannot be read.
    #[error(transparent)]
    Receive(ReceiveError),
    /// The state of the bus cannot be read.
    #[error(transparent)]
    Look(#[from] IntrospectError),
    /// The place elsewhere where the samples come from says why.
    #[error(transparent)]
    Elsewhere(Box<dyn std::error::Error + Send + Sync>),
    /// The bus is another one now, so no sample will come any more.
    #[error("the bus was damaged and replaced since this recording began; start it again")]
    Cleared,
    /// The system gives no thread for the file.
    #[error("cannot start a thread: {0}")]
    Thread(io::Error),
}

impl From<PlaceError> for RecordError {
    fn from(error: PlaceError) -> Self {
        match error {
            PlaceError::Open(error) => Self::Open(error),
            PlaceError::Look(error) => Self::Look(error),
            PlaceError::Elsewhere(error) => Self::Elsewhere(error),
        }
    }
}

impl RecordError {
    /// The error of the place where samples come from.
    pub(crate) fn of_place(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        PlaceError::of(error).into()
    }

    pub(crate) fn create(path: &Path, error: io::Error) -> Self {
        let path = path.to_owned();
        match error.kind() {
            io::ErrorKind::AlreadyExists => Self::Exists { path },
            io::ErrorKind::FileTooLarge => Self::Create { path, error },
            _ if is_full(&error) => Self::NoRoom { path },
            _ => Self::Create { path, error },
        }
    }

    /// The file had no room for more. It can still be ended.
    pub(crate) fn full(path: &Path, error: &io::Error) -> Self {
        let path = path.to_owned();
        match error.kind() {
            io::ErrorKind::FileTooLarge => Self::TooLong { path },
            _ => Self::Full { path },
        }
    }
}
