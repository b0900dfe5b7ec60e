//! The common part of the readers of a file's index.

use mcap::McapError;

use crate::walk::Damage;

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
    /// The file does not begin or end as an MCAP file does.
    #[error("it is not an MCAP file, or was cut off; `lager bag recover` saves what is whole")]
    NotWhole,
    /// Its end does not say what the file contains, which is allowed. Read the whole file instead.
    #[error("its end does not say what the file contains")]
    NoIndex,
    /// Messages stand outside of chunks.
    #[error(
        "its messages stand outside of chunks, where their time does not find them; `lager bag \
         recover` makes a copy that has them in chunks"
    )]
    Loose,
    /// Its chunks are packed in a way that this program cannot open.
    #[error("its chunks are packed with `{0}`, which this program does not read")]
    Packed(String),
    /// It is damaged.
    #[error(
        "it is damaged ({0}); `lager bag check` says where, `lager bag recover` saves the rest"
    )]
    Damaged(String),
}

impl From<McapError> for ReadError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::BadMagic | McapError::BadFooter | McapError::UnexpectedEof => Self::NotWhole,
            // An index may repeat the channels without their schemas.
            McapError::UnknownSchema(..) => Self::NoIndex,
            McapError::UnsupportedCompression(with) => Self::Packed(with),
            other => Self::Damaged(other.to_string()),
        }
    }
}

impl From<Damage> for ReadError {
    fn from(damage: Damage) -> Self {
        match damage {
            Damage::NotMcap | Damage::Cut { .. } => Self::NotWhole,
            Damage::Packed { with, .. } => Self::Packed(with),
            other => Self::Damaged(other.to_string()),
        }
    }
}
