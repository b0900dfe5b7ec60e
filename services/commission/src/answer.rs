//! [`Answer`]: what a person may say, and how it is read from a line.

use crate::step::Takes;
use crate::words::Said;

/// Which way the wheels of a side turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// As if the robot drove forwards.
    Forwards,
    /// The other way round.
    Backwards,
    /// Not at all.
    Still,
}

/// What a person says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// It is so, or: now.
    Yes,
    /// It is not so, or: stand.
    No,
    /// A measure in the unit that the question names.
    Number(f32),
    /// The ways of the left and the right wheels.
    Ways([Way; 2]),
    /// The person holds the button: the joint moves on for a moment.
    Hold,
    /// This step from its beginning, with what held before it.
    Again,
    /// The step before, with what held before that.
    Back,
    /// The next step; what held before this one stays.
    Skip,
}

impl Answer {
    /// The answer in a line, in either language, to a question that takes `takes`.
    ///
    /// # Errors
    /// It is no answer to such a question.
    pub fn read(line: &str, takes: Takes) -> Result<Self, Said> {
        let line = line.trim().to_lowercase();
        let is = |words: [&str; 3]| words.contains(&line.as_str());
        let unfit = || Said::new("answer_unfit", &[("text", &line)]);
        if is(["yes", "y", "ja"]) && takes != Takes::Ways {
            return Ok(Self::Yes);
        }
        if is(["no", "n", "nej"]) {
            return Ok(Self::No);
        }
        for (words, answer) in [
            (["again", "a", "igen"], Self::Again),
            (["back", "undo", "tillbaka"], Self::Back),
            (["skip", "s", "hoppa"], Self::Skip),
        ] {
            if is(words) {
                return Ok(answer);
            }
        }
        match takes {
            // An empty line comes again and again while a person holds the enter key, and the word
            // while he holds a button of a page.
            Takes::Hold if line.is_empty() || line == "hold" => Ok(Self::Hold),
            Takes::Yes | Takes::Hold => Err(unfit()),
            Takes::Number => number(&line).map(Self::Number).ok_or_else(unfit),
            Takes::Ways => {
                let mut letters = line.chars().map(|letter| match letter {
                    'f' => Some(Way::Forwards),
                    'b' => Some(Way::Backwards),
                    '0' => Some(Way::Still),
                    _ => None,
                });
                match (letters.next(), letters.next(), letters.next()) {
                    (Some(Some(left)), Some(Some(right)), None) => Ok(Self::Ways([left, right])),
                    _ => Err(unfit()),
                }
            }
        }
    }
}

/// A number with a decimal point or a decimal comma, and nothing else: whoever writes both means
/// thousands by one of them, and nobody knows by which.
fn number(line: &str) -> Option<f32> {
    let marks = line.chars().filter(|c| [',', '.'].contains(c)).count();
    let is_plain = |c: char| c.is_ascii_digit() || [',', '.'].contains(&c);
    (marks <= 1 && line.chars().all(is_plain))
        .then(|| line.replace(',', ".").parse().ok())
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_comma_is_a_point_and_thousands_are_refused() {
        let read = |line| Answer::read(line, Takes::Number);
        assert_eq!(read("12,34"), Ok(Answer::Number(12.34)));
        assert_eq!(read("12.34"), Ok(Answer::Number(12.34)));
        for wrong in [
            "1.234,5", "1,234.5", "", ".", "inf", "-3", "1e3", "nan", "12 cm",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn both_languages_are_read_and_only_what_the_question_takes() {
        use Way::{Backwards, Forwards, Still};
        assert_eq!(Answer::read(" Ja ", Takes::Yes), Ok(Answer::Yes));
        assert_eq!(Answer::read("igen", Takes::Ways), Ok(Answer::Again));
        let ways = |line| Answer::read(line, Takes::Ways);
        assert_eq!(ways("FB"), Ok(Answer::Ways([Forwards, Backwards])));
        assert_eq!(ways("0f"), Ok(Answer::Ways([Still, Forwards])));
        for wrong in ["f", "ffb", "yes", "12"] {
            assert!(ways(wrong).is_err(), "{wrong}");
        }
        assert!(Answer::read("12", Takes::Yes).is_err());
        for held in ["", "hold"] {
            assert_eq!(Answer::read(held, Takes::Hold), Ok(Answer::Hold));
        }
        assert_eq!(Answer::read("ja", Takes::Hold), Ok(Answer::Yes));
        for wrong in ["", "hold"] {
            assert!(Answer::read(wrong, Takes::Yes).is_err());
        }
    }
}
