//! Finds the sentences of `lager-orders` for the codes in samples, by their names.

use lager_orders::Reason;
use lager_sample::{Coded, Tag};

/// The word for a code: `waiting_for_order` for `WaitingForOrder`. `None` for an unknown code.
pub fn word<E: Coded>(tag: Tag<E>) -> Option<String> {
    let mut word = String::new();
    for letter in tag.get()?.name().chars() {
        if letter.is_ascii_uppercase() && !word.is_empty() {
            word.push('_');
        }
        word.push(letter.to_ascii_lowercase());
    }
    Some(word)
}

/// The name of a code's sentence: `phase_waiting_for_order`.
pub(crate) fn name<E: Coded>(prefix: &str, tag: Tag<E>) -> String {
    format!("{prefix}_{}", word(tag).as_deref().unwrap_or("unknown"))
}

/// The reason for a code whose sentence has no values.
pub(crate) fn reason<E: Coded>(prefix: &str, tag: Tag<E>) -> Reason {
    Reason::read(&name(prefix, tag))
}

#[cfg(test)]
mod tests {
    use lager_orders::Sentence;

    use lager_floor::Heading;

    use super::*;
    use crate::*;

    fn all_are_said<E: Coded>(prefix: &str) {
        for (variant, _) in E::VARIANTS {
            let name = name(prefix, Tag::from(*variant));
            assert!(Sentence::of(&name).is_some(), "{name} has no sentence");
        }
    }

    #[test]
    fn every_code_that_a_person_reads_has_a_sentence() {
        all_are_said::<ThoughtKind>("thought");
        all_are_said::<FailureKind>("failure");
        all_are_said::<Remedy>("remedy");
        all_are_said::<Phase>("phase");
        all_are_said::<StopCause>("stop_cause");
        all_are_said::<Joint>("joint");
        all_are_said::<Heading>("looks");
        all_are_said::<Refusal>("refusal");
        all_are_said::<Outcome>("outcome");
        all_are_said::<WorldRefusal>("world");
        all_are_said::<Finish>("finish");
    }
}
