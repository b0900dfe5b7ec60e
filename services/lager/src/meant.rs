//! Suggests the right name for a mistyped one, as a part of the sentence that refuses it.

use lager_lines::nearest;
use lager_topics::{TOPICS, UnknownTopic};

/// The one of `candidates` that the user may have meant; empty if none is similar.
pub fn meant<'a>(text: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    let near = nearest(text, candidates);
    near.map(|name| format!(" (did you mean `{name}`?)"))
        .unwrap_or_default()
}

/// Says that there is no such topic, and suggests one of the table or of `others`.
pub fn unknown_topic<'a>(text: &'a str, others: impl IntoIterator<Item = &'a str>) -> String {
    let all = || TOPICS.iter().map(|entry| entry.name);
    // A name without its first part still gets a suggestion.
    let by_end = || all().find(|name| name.rsplit('/').next() == Some(text));
    let unknown = UnknownTopic(text.to_owned());
    match nearest(text, all().chain(others)).or_else(by_end) {
        Some(name) => format!("did you mean `{name}`? {unknown}"),
        None => unknown.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_topic_is_told_with_the_one_that_was_meant() {
        for (text, name) in [
            ("sensor/lime", "sensor/line"),
            ("nav/statsu", "nav/status"),
            ("line", "sensor/line"),
            ("weather/nwo", "weather/now"),
        ] {
            let said = unknown_topic(text, ["weather/now"]);
            assert!(
                said.starts_with(&format!("did you mean `{name}`?")),
                "{said}"
            );
            assert!(said.contains("there is no topic"), "{said}");
        }
        assert!(unknown_topic("xyz", []).starts_with("there is no topic"));
        assert_eq!(
            meant("smal", ["small", "large"]),
            " (did you mean `small`?)"
        );
        assert_eq!(meant("hall.toml", ["small", "large"]), "");
    }
}
