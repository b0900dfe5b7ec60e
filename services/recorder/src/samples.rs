//! Every sample of a recording in the order of its time, for tools that show one.

use std::collections::BTreeMap;
use std::path::Path;

use lager_journal::{Envelope, EnvelopeSchema, Selection, TopicOverview};
use lager_topics::Description;
use serde_json::Value;

use crate::bag::{Bag, BagError};

/// Hands each sample over: the robot, the topic and the message. Returns the layout of each topic
/// whose layout the file has.
///
/// # Errors
/// The file cannot be read, was cut off, or another program recorded it.
pub fn samples(
    file: &Path,
    take: &mut dyn FnMut(&str, &str, Envelope<Value>),
) -> Result<BTreeMap<String, Description>, BagError> {
    let bag = Bag::open(file)?;
    let overview = bag.overview()?;
    let foreign = || BagError::Foreign {
        path: file.to_owned(),
    };
    let start = overview.start.as_ref().ok_or_else(foreign)?;
    bag.ordered(&overview, &Selection::default(), |topic, _, message| {
        // What is in the same file and no sample of a topic is passed over.
        if let Ok(envelope) = serde_json::from_slice(message) {
            take(&start.robot, topic, envelope);
        }
        Ok::<bool, BagError>(true)
    })?;
    let layout = |topic: &TopicOverview| {
        let layout = EnvelopeSchema::payload(&topic.schema_text)?;
        Some((topic.name.clone(), layout))
    };
    Ok(overview.topics.iter().filter_map(layout).collect())
}
