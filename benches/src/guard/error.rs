//! The errors of the guard. Every message says what to do.

use std::path::{Path, PathBuf};

use lager_benches::BenchError;

/// Why the guard could not do its work.
#[derive(Debug, thiserror::Error)]
pub(crate) enum GuardError {
    #[error("{0} cannot be read ({1})")]
    Unreadable(PathBuf, std::io::Error),
    /// A file of limits, counts or estimates.
    #[error("{0}: {1}")]
    Unusable(PathBuf, String),
    #[error(
        "`{0}` yields `{1}` twice, so a limit would apply to only one of them; give one of the rows another name or variant"
    )]
    Twice(String, String),
    #[error(
        "`rustc -vV` shows neither version nor target ({0}); put the rustc that built the benches into PATH"
    )]
    Rustc(String),
    #[error("cycles: {0}")]
    Chip(BenchError),
    #[error("`--only {0}` selects nothing; the sources that have limits are: {1}")]
    NoSuchSource(String, String),
    #[error(
        "`{0}` was not measured; run `benches/guard`, which does it, or leave it out with --only"
    )]
    NotMeasured(String),
}

/// The text of a file.
pub(crate) fn read(file: &Path) -> Result<String, GuardError> {
    std::fs::read_to_string(file).map_err(|error| GuardError::Unreadable(file.to_owned(), error))
}
