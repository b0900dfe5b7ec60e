//! One message: a sample's stamp and payload, and how many samples are missing before it.

use std::collections::BTreeMap;
use std::sync::Arc;

use lager_sample::{Description, Field, Stamp, describe};
use serde::{Deserialize, Serialize};
use serde_json::json;

/// A message. `P` is anything that serde writes or reads as a payload.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Envelope<P> {
    /// The sample's stamp, as its writer sent it.
    pub stamp: Stamp,
    /// Samples of this topic that never reached the recorder, since it began.
    pub lost: u64,
    /// Samples of this topic that the recorder had no time for, since it began.
    pub dropped: u64,
    /// The sample.
    pub payload: P,
}

/// The schema of a topic's messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EnvelopeSchema {
    /// The payload's name, such as `LineFrame`.
    pub name: String,
    /// JSON Schema (2020-12).
    pub text: Arc<[u8]>,
}

impl EnvelopeSchema {
    /// The schema of a payload with this layout. The schema's comment has the layout itself, so
    /// that a program can make payloads of a topic that it was built without.
    ///
    /// # Panics
    /// Never: a schema is always JSON.
    pub fn of(payload: &Description) -> Self {
        let stamp = Description::parse(&describe(&Stamp::MAKE)).expect("our own stamp");
        let count = json!({"type": "integer", "minimum": 0});
        let schema = json!({
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "$comment": payload.text(),
            "title": payload.name(),
            "type": "object",
            "properties": {
                "stamp": as_value(&stamp), "lost": count, "dropped": count,
                "payload": as_value(payload),
            },
            "required": ["stamp", "lost", "dropped", "payload"],
        });
        Self {
            name: payload.name().to_owned(),
            text: schema.to_string().into_bytes().into(),
        }
    }

    /// The payload's layout, if the schema `text` has it.
    pub fn payload(text: &[u8]) -> Option<Description> {
        let schema: serde_json::Value = serde_json::from_slice(text).ok()?;
        Description::parse(schema["$comment"].as_str()?).ok()
    }

    /// Whether messages of a topic with the schema `text` have the same form as these.
    pub fn fits(&self, text: &[u8]) -> bool {
        let parsed = |text| {
            let mut schema: serde_json::Value = serde_json::from_slice(text).ok()?;
            schema.as_object_mut()?.remove("$comment");
            Some(schema)
        };
        // Two builds may write the same members in another order, and older builds write no
        // comment.
        parsed(text).is_some_and(|other| parsed(&self.text) == Some(other))
    }
}

fn as_value(description: &Description) -> serde_json::Value {
    serde_json::to_value(description.json_schema()).expect("a schema is JSON")
}

/// What the messages of a channel are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// Samples of the topic, as they were sent.
    #[default]
    Samples,
    /// The topic's last sample from before the file, with its old stamp. It stands at the file's
    /// beginning so that the file can be used alone. No count has it.
    Repeated,
    /// Messages for viewers, made from the samples of these topics. They are not samples.
    Derived(String),
}

/// The metadata key of a channel of derived messages. The text names the topics.
const DERIVED: &str = "lager.derived";
/// The metadata key of a channel of repeated samples.
const REPEATED: &str = "lager.repeated";

impl Content {
    /// The channel's metadata: what its times mean, and whether its messages are repeated or
    /// derived.
    pub(crate) fn to_notes(&self) -> BTreeMap<String, String> {
        let times = (
            "times",
            "stamp: ns of CLOCK_MONOTONIC; log and publish time: ns since 1970",
        );
        let notes: &[(&str, &str)] = match self {
            Self::Samples => &[times],
            Self::Repeated => &[times, (REPEATED, "the last sample before this file began")],
            Self::Derived(from) => &[(DERIVED, from)],
        };
        let notes = notes.iter();
        notes
            .map(|(name, text)| ((*name).to_owned(), (*text).to_owned()))
            .collect()
    }

    pub(crate) fn of_notes(notes: &BTreeMap<String, String>) -> Self {
        match notes.get(DERIVED) {
            Some(from) => Self::Derived(from.clone()),
            None if notes.contains_key(REPEATED) => Self::Repeated,
            None => Self::Samples,
        }
    }
}

#[cfg(test)]
mod tests {
    use lager_topics::LineFrame;

    use super::*;

    #[test]
    fn a_channels_metadata_says_what_its_messages_are() {
        let derived = Content::Derived("nav/map".to_owned());
        for content in [Content::Samples, Content::Repeated, derived] {
            assert_eq!(Content::of_notes(&content.to_notes()), content);
        }
        assert_eq!(Content::of_notes(&BTreeMap::new()), Content::Samples);
    }

    #[test]
    fn a_schema_has_the_layout_in_its_comment_and_fits_one_without() {
        let schema = EnvelopeSchema::of(&Description::of::<LineFrame>());
        let mut value: serde_json::Value = serde_json::from_slice(&schema.text).expect("JSON");
        let layout = EnvelopeSchema::payload(&schema.text).expect("a layout");
        assert_eq!(layout.name(), "LineFrame");
        assert_eq!(layout.size(), size_of::<LineFrame>());
        value.as_object_mut().expect("an object").remove("$comment");
        assert!(schema.fits(value.to_string().as_bytes()));
        value["title"] = "Other".into();
        assert!(!schema.fits(value.to_string().as_bytes()));
    }
}
