//! What a page is told: steps, questions and sentences by their names, and what has been found out.
//!
//! A page shows every step and every question in the same way, so a new one needs nothing here but
//! its sentences.

use std::path::Path;

use lager_orders::Reason;

use crate::machine::Commissioning;
use crate::step::{Question, Step, Takes};
use crate::words::{Said, sentences};

/// `LineSway` as `line_sway`.
fn word(name: &str) -> String {
    let mut word = String::new();
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !word.is_empty() {
            word.push('_');
        }
        word.push(letter.to_ascii_lowercase());
    }
    word
}

impl Step {
    /// Its name; the sentence `step_` and this name says what it finds out.
    pub fn name(self) -> String {
        word(&format!("{self:?}"))
    }
}

impl Question {
    /// The name of its sentence.
    pub fn name(self) -> &'static str {
        self.sentence()
    }
}

impl Takes {
    /// Its name.
    pub fn name(self) -> String {
        word(&format!("{self:?}"))
    }
}

/// How a commissioning ends.
impl Said {
    /// Its result is in this file.
    pub fn kept(path: &Path) -> Self {
        Self::new("ended_kept", &[("path", &path.display())])
    }

    /// The file is as it was before.
    pub fn undone(path: &Path) -> Self {
        Self::new("ended_undone", &[("path", &path.display())])
    }

    /// The same, but the line sensors' thresholds are those of the last calibration.
    pub fn undone_but_thresholds(path: &Path) -> Self {
        Self::new("ended_undone_but", &[("path", &path.display())])
    }

    /// The robot starts again, with what is saved.
    pub fn restarted() -> Self {
        "ended_restarted".into()
    }

    /// Nothing is written.
    pub fn nothing() -> Self {
        "ended_nothing".into()
    }

    /// It could not begin, or its result could not be written.
    pub fn failed(why: &str) -> Self {
        Self::new("ended_failed", &[("text", &why)])
    }

    /// Whether it is a result, and not why something does not go on.
    pub fn is_result(&self) -> bool {
        self.name().starts_with("found_")
    }

    /// Whether it says why a step begins anew.
    pub fn is_end(&self) -> bool {
        self.name() == "ended"
    }

    /// As a code with its values, in which a line carries it: in the order in which the English
    /// sentence uses them first.
    pub fn reason(&self) -> Reason {
        let (name, values) = match self {
            Self::Here { name, values } => (*name, values),
            Self::Order(reason) => return reason.clone(),
            Self::Plain(text) => return Reason::read(text),
        };
        let sentence = sentences().find(|sentence| sentence.name == name);
        let mut keys = sentence
            .into_iter()
            .flat_map(lager_orders::Sentence::keys)
            .peekable();
        let mut line = name.to_owned();
        while let Some(key) = keys.next() {
            let value = values.iter().find(|(of, _)| *of == key);
            let value = value.map_or_else(String::new, |(_, said)| said.reason().as_str().into());
            line.push(' ');
            line.push_str(&match keys.peek() {
                None => value.replace(['\r', '\n'], " "),
                Some(_) => value.replace('%', "%25").replace([' ', '\r', '\n'], "%20"),
            });
        }
        Reason::read(&line)
    }
}

/// What has been found out, with the step of each. What a person takes back by going back is gone.
#[derive(Clone, Debug, Default)]
pub struct Results(Vec<(Step, Said)>);

impl Results {
    /// Takes what `step` has found out. What the steps after it have found does not hold any more.
    pub fn found(&mut self, step: Step, said: Said) {
        self.0.retain(|(other, _)| *other <= step);
        self.0.push((step, said));
    }

    /// Step `now` begins anew: of it and of those after it nothing holds any more.
    pub fn from(&mut self, now: Step) {
        self.0.retain(|(step, _)| *step < now);
    }

    /// All of it, in the order of the steps.
    pub fn all(&self) -> &[(Step, Said)] {
        &self.0
    }
}

impl Commissioning {
    /// Which one the present step is, from 1, and how many there are.
    pub fn place(&self) -> [u8; 2] {
        [self.step() as usize + 1, Step::ALL.len()].map(|number| number as u8)
    }
}

#[cfg(test)]
mod tests {
    use lager_orders::Language;

    use super::*;

    #[test]
    fn each_step_has_its_name_in_both_languages() {
        let titles = sentences().filter(|sentence| sentence.name.starts_with("step_"));
        let titles: Vec<_> = titles.map(|sentence| sentence.name.to_owned()).collect();
        let steps = Step::ALL.map(|step| format!("step_{}", step.name()));
        assert_eq!(titles, steps, "in the order of the steps");
    }

    #[test]
    fn a_sentence_in_a_sentence_is_told_by_its_code() {
        let board = |build: u8| Said::new("board_up", &[("build", &build)]);
        let boards = [("sensor", board(7)), ("steering", "board_gone".into())];
        let live = Said::of("live_boards", boards);
        assert_eq!(
            live.reason().as_str(),
            "live_boards board_up%207 board_gone"
        );
        let mixed = Said::new("line_mixed", &[("sensors", &"1, 2")]);
        let ended = Said::of("ended", [("why", mixed)]);
        assert_eq!(ended.reason().as_str(), "ended line_mixed 1, 2");
        let order = Said::from(Reason::from(lager_orders::Code::DriveOver));
        assert_eq!(order.reason().as_str(), "drive_over");
        assert!(!order.text(Language::Swedish).is_empty());
    }

    #[test]
    fn what_is_found_again_replaces_what_came_after_it() {
        let mut results = Results::default();
        let said = |results: &Results| -> Vec<_> {
            results.all().iter().map(|(_, said)| said.name()).collect()
        };
        results.found(Step::Line, "found_polarity_low".into());
        results.found(Step::Battery, "found_divider".into());
        results.found(Step::Turn, "found_turn".into());
        results.from(Step::Battery);
        results.found(Step::Battery, "found_no_divider".into());
        assert_eq!(said(&results), ["found_polarity_low", "found_no_divider"]);
        results.found(Step::Distance, "found_model".into());
        assert_eq!(said(&results), ["found_polarity_low", "found_model"]);
    }
}
