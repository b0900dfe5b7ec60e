//! Every sample of a recording in the order of its time, for tools that show one.

use std::collections::BTreeMap;
use std::path::Path;

use lager_journal::{Envelope, EnvelopeSchema, Selection, TopicOverview};
use lager_topics::Description;
use serde_json::Value;

use crate::bag::{Bag, BagError};

/// A sample of a recording.
#[derive(Debug)]
pub struct FileSample<'a> {
    /// The robot's name.
    pub robot: &'a str,
    /// The topic.
    pub topic: &'a str,
    /// Whether it was sent before the file began, and stands in an earlier one as well.
    pub is_repeated: bool,
    /// The message. What it says to be missing is what this file lacks up to it.
    pub envelope: Envelope<Value>,
}

/// Hands each sample over. Returns the layout of each topic whose layout the file has.
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
    // A message counts from the recording's begin. What was missing before a later file is not
    // known of each topic; that file counts from its first sample.
    let mut before: BTreeMap<String, (u64, u64)> = BTreeMap::new();
    bag.ordered(&overview, &Selection::default(), |placed| {
        // What is in the same file and no sample of a topic is passed over.
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
