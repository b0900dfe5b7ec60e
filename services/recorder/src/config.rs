//! What the recorder records, and into which file.

use std::path::PathBuf;
use std::time::Duration;

/// How many names the recorder tries.
const MOST_NAMES: u32 = 1_000;

/// When the recorder ends a file and begins the next one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Split {
    /// When the file has so many bytes.
    pub bytes: Option<u64>,
    /// When the recorder has written to it for so long.
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

/// What the recorder records, and into which file.
#[derive(Clone, Debug)]
pub struct RecordConfig {
    /// The file; it must not exist yet. If the recording is split, each file gets a number.
    pub file: PathBuf,
    /// Take another name if the file exists: nobody has chosen this name.
    pub or_another: bool,
    /// Names of topics. Empty means all, also those that somebody opens later.
    pub topics: Vec<String>,
    /// When to begin a new file.
    pub split: Split,
    /// How many samples may wait for the disk.
    pub queue: usize,
    /// How often the recorder writes the samples to the disk.
    pub flush: Duration,
}

impl RecordConfig {
    /// The path of that file of the recording.
    pub(crate) fn path(&self, part: u32) -> PathBuf {
        if !self.split.is_wanted() {
            return self.file.clone();
        }
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        self.file.with_file_name(format!("{stem}-{part:03}.mcap"))
    }

    /// The names to try, the wished one first: `tour.mcap`, `tour-2.mcap`.
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
