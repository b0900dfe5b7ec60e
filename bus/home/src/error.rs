//! [`HomeError`]: why a bus's folder cannot be used. Every message says what to do.

use std::path::PathBuf;

/// Why the folder in which a bus lives cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HomeError {
    /// The folder is not an absolute path.
    #[error("`{0}` cannot be the bus's folder; give an absolute path, in UTF-8")]
    RelativeFolder(PathBuf),
    /// The folder's path is so long that no socket's name fits behind it.
    #[error("the bus's folder {folder} is too long; use at most {limit} bytes")]
    FolderTooLong {
        /// The folder.
        folder: PathBuf,
        /// The longest that works, in bytes.
        limit: usize,
    },
    /// The path is a file or a symbolic link.
    #[error(
        "{0} is a file or a symbolic link and cannot be the bus's folder; remove it, or use another folder"
    )]
    NoFolder(PathBuf),
    /// The folder belongs to another user.
    #[error(
        "{folder} belongs to UID {uid} ({name}); use the bus as that user (`sudo -u {name}`), or use another folder"
    )]
    ForeignFolder {
        /// The folder.
        folder: PathBuf,
        /// Its owner.
        uid: u32,
        /// The owner's name, as `sudo -u` takes it.
        name: String,
    },
    /// Other users may enter it.
    #[error(
        "other users may enter the bus's folder {folder} (mode {mode:04o}); use `chmod 700 {folder}`, if nobody else's files are in it"
    )]
    SharedFolder {
        /// The folder.
        folder: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// Another user has put a segment among the bus's segments.
    #[error(
        "{path} belongs to UID {uid} ({name}), who could end every process of this bus with it; remove it (`sudo rm {path}`), or use another folder"
    )]
    ForeignSegment {
        /// The segment.
        path: PathBuf,
        /// Its owner.
        uid: u32,
        /// The owner's name.
        name: String,
    },
    /// The folder cannot be made or examined.
    #[error(
        "the bus's folder {folder} cannot be used ({detail}); make it for this user, or use another one"
    )]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The system's reason.
        detail: String,
    },
}
