//! The table of sentences is complete, and reasons are read as they were written.

use std::collections::BTreeSet;

use lager_orders::{Code, EventKind, Language, Reason, Sentence};

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
    }
    for code in Code::ALL {
        assert!(names.contains(code.as_str()), "{code:?} has no sentence");
    }
    for kind in EventKind::ALL {
        let name = format!("event_{}", kind.as_str());
        assert!(names.contains(name.as_str()), "{kind:?} has no sentence");
    }
}

/// The one sentence whose reader writes lines of text: it answers a program that connects.
const FOR_PROGRAMS: &str = "hello_first";

#[test]
fn a_page_is_told_no_command_of_a_terminal() {
    for sentence in Sentence::all().filter(|sentence| sentence.name != FOR_PROGRAMS) {
        // In Swedish the name of the program is also the word for a warehouse.
        let names_one = sentence.english.contains("lager ");
        let quotes_one = [sentence.english, sentence.swedish].map(|text| text.contains('`'));
        assert!(!names_one && quotes_one == [false; 2], "{sentence:?}");
    }
}

#[test]
fn only_thoughts_are_of_the_first_person_and_all_call_goods_goods() {
    for sentence in Sentence::all() {
        let words = |text: &'static str| text.split(|c: char| !c.is_alphabetic());
        if !sentence.name.starts_with("thought_") {
            let is_first = |word: &str| ["I", "me", "my"].contains(&word);
            assert!(!words(sentence.english).any(is_first), "{sentence:?}");
            let is_first = |word: &str| {
                ["jag", "mig", "min", "mitt", "mina"].contains(&word.to_lowercase().as_str())
            };
            assert!(!words(sentence.swedish).any(is_first), "{sentence:?}");
        }
        let english = sentence.english.replace("{product}", "");
        assert!(!english.to_lowercase().contains("product"), "{sentence:?}");
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
