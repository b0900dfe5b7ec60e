//! The metadata record `lager.counts`: how many samples of each topic a file has, and how many are
//! missing.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The record's name.
pub(crate) const NAME: &str = "lager.counts";

/// What happened to the samples of one topic while a file was recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// Samples that reached the recorder.
    pub received: u64,
    /// Samples that were overwritten before the recorder read them, as gaps in the numbers show.
    pub lost: u64,
    /// Samples that reached the recorder and are not in the file, because its queue was full.
    pub dropped: u64,
}

impl Count {
    /// Samples that the file should have and does not have.
    pub const fn missing(&self) -> u64 {
        self.lost.saturating_add(self.dropped)
    }
}

/// By topic.
pub type Counts = BTreeMap<String, Count>;

/// As MCAP keeps metadata: names and texts, here JSON.
pub(crate) fn to_texts(counts: &Counts) -> BTreeMap<String, String> {
    let texts = counts.iter().map(|(topic, count)| {
        let text = serde_json::to_string(count).expect("three numbers are JSON");
        (topic.clone(), text)
    });
    texts.collect()
}

/// Leaves out a topic whose text cannot be read.
pub(crate) fn of_texts(texts: &BTreeMap<String, String>) -> Counts {
    let counts = texts.iter().filter_map(|(topic, text)| {
        let count = serde_json::from_str(text).ok()?;
        Some((topic.clone(), count))
    });
    counts.collect()
}
