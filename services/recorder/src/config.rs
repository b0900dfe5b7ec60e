//! What is recorded, and where to.

use std::path::PathBuf;
use std::time::Duration;

/// So many names are tried.
const MOST_NAMES: u32 = 1_000;

/// When a file is ended and the next one begun.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Split {
    /// When it has so many bytes.
    pub bytes: Option<u64>,
    /// When it has been written to for so long.
    pub time: Option<Duration>,
}

impl Split {
    pub(crate) fn is_due(&self, bytes: u64, age: Duration) -> bool {
        self.bytes.is_some_and(|most| bytes >= most) || self.time.is_some_and(|most| age >= most)
    }

    fn is_wanted(&self) -> bool {
        self.bytes.is_some() || self.time.is_some()
    }
}

/// What is recorded, and where to.
#[derive(Clone, Debug)]
pub struct RecordConfig {
    /// The file; it must not be there yet. If files are split, each gets a number.
    pub file: PathBuf,
    /// Take another name if the file is there already: nobody has asked for this one.
    pub or_another: bool,
    /// Names of topics; empty for all, those included that are opened later.
    pub topics: Vec<String>,
    /// When a new file is begun.
    pub split: Split,
    /// Samples that may wait for the disk.
    pub queue: usize,
    /// How often what has come is put on the disk.
    pub flush: Duration,
}

impl RecordConfig {
    /// Where that file of the recording is.
    pub(crate) fn path(&self, part: u32) -> PathBuf {
        if !self.split.is_wanted() {
            return self.file.clone();
        }
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        self.file.with_file_name(format!("{stem}-{part:03}.mcap"))
    }

    /// The names that it may have, the first one as it was asked for: `tour.mcap`, `tour-2.mcap`.
    pub(crate) fn names(&self) -> impl Iterator<Item = Self> {
        (1..=MOST_NAMES).map(|number| {
            let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
            let file = match number {
                1 => self.file.clone(),
                _ => self.file.with_file_name(format!("{stem}-{number}.mcap")),
            };
            Self {
                file,
                ..self.clone()
            }
        })
    }
}
