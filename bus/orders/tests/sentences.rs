//! The table of sentences is complete, and reasons are read as they were written.

use std::collections::BTreeSet;

use lager_orders::{Code, Language, Reason, Sentence};

/// The keys in a text.
fn keys(text: &str) -> BTreeSet<&str> {
    let parts = text.split('{').skip(1);
    parts.filter_map(|rest| rest.split('}').next()).collect()
}

#[test]
fn every_sentence_stands_in_both_languages_with_the_same_values() {
    let mut names = BTreeSet::new();
    for sentence in Sentence::all() {
        assert!(
            names.insert(sentence.name),
            "{} stands twice",
            sentence.name
        );
        assert!(
            !sentence.name.contains(' ') && !sentence.swedish.is_empty(),
            "{sentence:?}"
        );
        assert_eq!(
            keys(sentence.english),
            keys(sentence.swedish),
            "{}",
            sentence.name
        );
        // Words that only English uses.
        let english = [" the ", " is ", " it ", " are ", " has "];
        let left = english.iter().any(|word| sentence.swedish.contains(word));
        assert!(!left, "{}", sentence.swedish);
        // A page has buttons instead of a terminal's commands.
        for command in ["`lager resume", "`lager map", "`lager mode", "`lager queue"] {
            assert!(!sentence.english.contains(command), "{}", sentence.name);
        }
    }
    for code in Code::ALL {
        assert!(names.contains(code.as_str()), "{code:?} has no sentence");
    }
}

#[test]
fn a_reason_is_a_sentence_in_the_readers_language() {
    let late = Reason::new(Code::Late, &[&340]);
    assert_eq!(late.as_str(), "late 340");
    assert_eq!(late.to_string(), "came 340 ms late; give it anew");
    let stopped = Reason::read("refusal_stop_latched");
    let nested = Reason::new(Code::NotPossible, &[&"forward", &stopped.as_str()]);
    assert_eq!(
        nested.to_string(),
        "forward is not possible now: the robot is stopped"
    );
    assert_eq!(
        Reason::read(nested.as_str()).sentence(Language::Swedish),
        "framåt går inte nu: roboten är stoppad"
    );
    let file = Reason::new(Code::SaveFailed, &[&"/a b/100%.toml", &"no space left"]);
    assert_eq!(
        file.as_str(),
        "save_failed /a%20b/100%25.toml no space left"
    );
    assert_eq!(
        file.to_string(),
        "/a b/100%.toml is not saved: no space left"
    );
    assert_eq!(
        Reason::read("something older").to_string(),
        "something older"
    );
}
