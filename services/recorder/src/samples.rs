//! Every sample of a recording, in the order of time.

use std::collections::BTreeMap;
use std::path::Path;

use lager_journal::{Envelope, EnvelopeSchema, Selection, TopicOverview};
use lager_sample::Description;
use serde_json::Value;

use crate::bag::{Bag, BagError};

/// A sample of a recording.
#[derive(Debug)]
pub struct FileSample<'a> {
    /// The robot's name.
    pub robot: &'a str,
    /// The topic.
    pub topic: &'a str,
    /// Whether it is repeated from an earlier file.
    pub is_repeated: bool,
    /// The message. Its losses count from the beginning of this file.
    pub envelope: Envelope<Value>,
}

/// Calls a function with each sample. Returns the layouts of the topics, where the file has them.
///
/// # Errors
/// The file cannot be read, was cut off, or another program recorded it.
pub fn samples(
    file: &Path,
    take: &mut dyn FnMut(FileSample<'_>),
) -> Result<BTreeMap<String, Description>, BagError> {
    let bag = Bag::open(file)?;
    let overview = bag.overview()?;
    let foreign = || BagError::Foreign {
        path: file.to_owned(),
    };
    let start = overview.start.as_ref().ok_or_else(foreign)?;
    // A message counts losses from the recording's beginning. A later file does not say them for
    // each topic, so they count from the topic's first sample in that file.
    let mut before: BTreeMap<String, (u64, u64)> = BTreeMap::new();
    bag.ordered(&overview, &Selection::default(), |placed| {
        // Skip derived messages.
        if let Ok(mut envelope) = serde_json::from_slice::<Envelope<Value>>(placed.message) {
            if placed.is_repeated {
                (envelope.lost, envelope.dropped) = (0, 0);
            } else if start.part > 0 {
                let first = (envelope.lost, envelope.dropped);
                let before = *before.entry(placed.topic.to_owned()).or_insert(first);
                envelope.lost = envelope.lost.saturating_sub(before.0);
                envelope.dropped = envelope.dropped.saturating_sub(before.1);
            }
            take(FileSample {
                robot: &start.robot,
                topic: placed.topic,
                is_repeated: placed.is_repeated,
                envelope,
            });
        }
        Ok::<bool, BagError>(true)
    })?;
    let layout = |topic: &TopicOverview| {
        let layout = EnvelopeSchema::payload(&topic.schema_text)?;
        Some((topic.name.clone(), layout))
    };
    Ok(overview.topics.iter().filter_map(layout).collect())
}
