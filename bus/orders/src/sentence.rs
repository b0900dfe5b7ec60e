//! [`Sentence`]: the table `sentences.txt`. Each sentence has a name and a text in each language.

use core::fmt::{self, Write};

const TABLE: &str = include_str!("../sentences.txt");

/// A reader's language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// English.
    English,
    /// Swedish.
    Swedish,
}

/// A sentence of the table. In it `{key}` stands for a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sentence {
    /// Its name.
    pub name: &'static str,
    /// In English.
    pub english: &'static str,
    /// In Swedish.
    pub swedish: &'static str,
}

impl Sentence {
    /// Every sentence, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::in_table(TABLE)
    }

    /// Every sentence of another table of the same form, in its order.
    pub fn in_table(table: &'static str) -> impl Iterator<Item = Self> {
        let mut lines = table
            .lines()
            .filter(|line| !line.is_empty() && !line.starts_with('#'));
        core::iter::from_fn(move || {
            Some(Self {
                name: lines.next()?,
                english: lines.next()?.trim_start(),
                swedish: lines.next()?.trim_start(),
            })
        })
    }

    /// The sentence with this name.
    pub fn of(name: &str) -> Option<Self> {
        Self::all().find(|sentence| sentence.name == name)
    }

    /// The words, in this language.
    pub const fn text(self, language: Language) -> &'static str {
        match language {
            Language::English => self.english,
            Language::Swedish => self.swedish,
        }
    }

    /// The keys of its values, each once, in the order in which the English sentence uses them.
    pub fn keys(self) -> impl Iterator<Item = &'static str> {
        let all = move || {
            self.english
                .split('{')
                .skip(1)
                .filter_map(|rest| rest.split('}').next())
        };
        let is_first =
            move |(place, key): &(usize, &str)| !all().take(*place).any(|other| other == *key);
        all().enumerate().filter(is_first).map(|(_, key)| key)
    }

    /// Writes the sentence in this language. `value` writes the value of a key.
    ///
    /// # Errors
    ///
    /// `to` or `value` fails.
    pub fn put(
        self,
        language: Language,
        to: &mut dyn Write,
        value: &mut dyn FnMut(&str, &mut dyn Write) -> fmt::Result,
    ) -> fmt::Result {
        let mut left = self.text(language);
        while let Some((before, rest)) = left.split_once('{') {
            let (key, after) = rest.split_once('}').unwrap_or((rest, ""));
            to.write_str(before)?;
            value(key, to)?;
            left = after;
        }
        to.write_str(left)
    }
}
