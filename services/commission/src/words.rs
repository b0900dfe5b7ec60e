//! [`Said`]: a sentence of this crate's table, with its values.

use lager_orders::{Language, Reason, Sentence};

const TABLE: &str = include_str!("../sentences.txt");

/// Every sentence of the table.
pub fn sentences() -> impl Iterator<Item = Sentence> {
    Sentence::in_table(TABLE)
}

/// A sentence with its values, in no language yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Said {
    /// A sentence of this crate's table.
    Here {
        /// Its name.
        name: &'static str,
        /// Its values by their keys.
        values: Vec<(&'static str, Said)>,
    },
    /// A sentence of the table of orders.
    Order(Reason),
    /// Text that is the same in every language.
    Plain(String),
}

impl Said {
    /// The sentence `name`, with values by their keys.
    pub(crate) fn new(name: &'static str, values: &[(&'static str, &dyn ToString)]) -> Self {
        let plain =
            |(key, value): &(&'static str, &dyn ToString)| (*key, Self::Plain(value.to_string()));
        Self::Here {
            name,
            values: values.iter().map(plain).collect(),
        }
    }

    /// The sentence `name`, with other sentences as values.
    pub(crate) fn of(name: &'static str, values: impl Into<Vec<(&'static str, Self)>>) -> Self {
        Self::Here {
            name,
            values: values.into(),
        }
    }

    /// The name of its sentence in this crate's table.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Here { name, .. } => name,
            Self::Order(_) | Self::Plain(_) => "",
        }
    }

    /// The name of the sentence that says why, if it is one of this crate's table.
    pub fn cause(&self) -> &'static str {
        let inner = match self {
            Self::Here { values, .. } => values.iter().find(|(key, _)| *key == "why"),
            Self::Order(_) | Self::Plain(_) => None,
        };
        inner.map_or(self.name(), |(_, why)| why.cause())
    }

    /// The sentence in this language.
    pub fn text(&self, language: Language) -> String {
        let (name, values) = match self {
            Self::Here { name, values } => (*name, values),
            Self::Order(reason) => return reason.sentence(language),
            Self::Plain(text) => return text.clone(),
        };
        let Some(sentence) = sentences().find(|sentence| sentence.name == name) else {
            return name.to_owned();
        };
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = sentence.put(language, &mut text, &mut |key, to| {
            let value = values.iter().find(|(of, _)| *of == key);
            value.map_or(Ok(()), |(_, said)| to.write_str(&said.text(language)))
        });
        text
    }
}

impl From<&'static str> for Said {
    fn from(name: &'static str) -> Self {
        Self::new(name, &[])
    }
}

impl From<Reason> for Said {
    fn from(reason: Reason) -> Self {
        Self::Order(reason)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_sentence_stands_in_both_languages_with_the_same_values_and_is_used() {
        let sources = [
            include_str!("machine.rs"),
            include_str!("machine/answers.rs"),
            include_str!("machine/shown.rs"),
            include_str!("machine/tells.rs"),
            include_str!("step.rs"),
            include_str!("told.rs"),
            include_str!("line.rs"),
            include_str!("range.rs"),
            include_str!("wheels.rs"),
            include_str!("answer.rs"),
            include_str!("arm.rs"),
            include_str!("machine/arm.rs"),
            include_str!("machine/buttons.rs"),
        ];
        let mut names = BTreeSet::new();
        for sentence in sentences() {
            assert!(names.insert(sentence.name), "{} twice", sentence.name);
            let keys = |text: &'static str| {
                let parts = text.split('{').skip(1);
                parts
                    .filter_map(|rest| rest.split('}').next())
                    .collect::<BTreeSet<_>>()
            };
            assert_eq!(keys(sentence.english), keys(sentence.swedish));
            assert_ne!(sentence.swedish, "", "{}", sentence.name);
            let quoted = format!("\"{}\"", sentence.name);
            // A step's name is made of the step, and the panel's own tests look for the page's words.
            let is_elsewhere = ["step_", "page_"]
                .iter()
                .any(|begin| sentence.name.starts_with(begin));
            let is_used = is_elsewhere || sources.iter().any(|source| source.contains(&quoted));
            assert!(is_used, "nobody says {}", sentence.name);
        }
    }

    #[test]
    fn a_sentence_within_a_sentence_has_the_readers_language() {
        let said = Said::of("ended", [("why", "wheel_still".into())]);
        let english = said.text(Language::English);
        assert!(
            english.contains("stands: a wheel did not turn"),
            "{english}"
        );
        let swedish = said.text(Language::Swedish);
        assert!(
            swedish.contains("står: ett hjul snurrade inte"),
            "{swedish}"
        );
    }
}
