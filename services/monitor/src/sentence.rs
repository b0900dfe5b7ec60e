//! Says in words what a sample means, for the payloads that speak to people: thoughts and failures.
//! Only this file chooses a language.

use lager_sample::Topic;
use lager_topics::{Failure, LogThought, MissionEvent, NavStatus, Thought};
use serde_json::Value;

/// The function that makes a sentence of a sample of `T` in JSON, if `T` has one. It returns `None`
/// for a sample that says nothing.
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
