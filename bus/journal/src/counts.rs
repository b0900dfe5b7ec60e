//! How many samples of each topic a file has and lacks, as the metadata record `lager.counts`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The record's name.
pub(crate) const NAME: &str = "lager.counts";

/// What became of the samples of one topic that were sent while a file was recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// Samples that reached the recorder.
    pub received: u64,
    /// Samples that were overwritten before the recorder looked, by the gaps in their numbers.
    pub lost: u64,
    /// Samples that reached the recorder and are not in the file, because its queue was full.
    pub dropped: u64,
}

impl Count {
    /// Samples that the file should have and does not.
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

/// A topic whose text is not readable is left out.
pub(crate) fn of_texts(texts: &BTreeMap<String, String>) -> Counts {
    let counts = texts.iter().filter_map(|(topic, text)| {
        let count = serde_json::from_str(text).ok()?;
        Some((topic.clone(), count))
    });
    counts.collect()
}
