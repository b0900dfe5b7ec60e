//! What a sample means in words, where its payload says something to people: a thought, or what is
//! wrong. The language is chosen here and nowhere before.

use lager_topics::{Failure, LogThought, MissionEvent, NavStatus, Thought, Topic};
use serde_json::Value;

/// What makes a sentence of a sample of `T` in JSON; `None` from it where nothing is to be said.
pub(crate) fn of<T: Topic>() -> fn(&Value) -> Option<String> {
    match T::NAME {
        LogThought::NAME => thought,
        MissionEvent::NAME | NavStatus::NAME => failure,
        _ => |_| None,
    }
}

fn thought(sample: &Value) -> Option<String> {
    let thought: Thought = serde_json::from_value(sample.clone()).ok()?;
    Some(thought.to_string())
}

fn failure(sample: &Value) -> Option<String> {
    let failure: Failure = serde_json::from_value(sample.get("failure")?.clone()).ok()?;
    let remedy = failure.remedy.get()?;
    (!failure.is_none()).then(|| format!("{failure}. {remedy}"))
}
