//! What the readers of a file's index share.

use mcap::McapError;

/// Bytes of the file that a reader needs next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Where they begin.
    pub at: u64,
    /// How many there are; at the file's end there may be fewer.
    pub length: usize,
}

/// Why a file's index cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file does not begin or end as MCAP does.
    #[error("it is not an MCAP file, or was cut off; `lager bag recover` saves what is whole")]
    NotWhole,
    /// It has an end and no index.
    #[error("it has no index; `lager bag recover` makes a copy that has one")]
    NoIndex,
    /// It is damaged.
    #[error(
        "it is damaged ({0}); `lager bag check` says where, `lager bag recover` saves the rest"
    )]
    Damaged(McapError),
}

impl From<McapError> for ReadError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::BadMagic | McapError::BadFooter | McapError::UnexpectedEof => Self::NotWhole,
            other => Self::Damaged(other),
        }
    }
}
