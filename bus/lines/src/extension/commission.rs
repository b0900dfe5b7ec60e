//! A commissioning of the robot: what a person says to it, and how far it is.
//!
//! ```text
//! station to robot, an action:
//!   commission begin | undo | here | stand | quit
//!   commission answer <int> <answer>     the number of what is asked, and the answer
//!   <answer> ::= 1 to 16 of a-z, 0-9, `.`, `,` and `-`, such as yes, no, 12.5, fb, hold, again, back, skip
//!
//! robot to station:
//!   commission {<key>=<value>}           see `Commissioning`; without a field, none is at work
//!   found <int> {<step> <sentence>}      what has been found out: how much, and the last of it
//!   kept <int> <int> [<text>]            a line of the description that was saved, its number from
//!                                        1 and how many there are
//! <sentence> ::= <reason>                of the table of the crate `lager-commission`, in one word
//! ```
//!
//! A movement of a commissioning goes on only while the robot hears `here`, at least twice a second.
//! When it has not heard it for ten seconds, the boards are told what they were told before.

use core::fmt;

use lager_orders::{AnswerWord, Commission, Reason};

use super::fields::{Value, fields, number};
use crate::misread::Misread;
use crate::reader::Reader;
use crate::text::{Name, Text};

fields! {
    /// How far a commissioning is. `None` is not known, or does not apply.
    pub struct Commissioning {
        /// The number of what is asked; it grows each time that something is asked.
        asked: u32 = "a number from 0 to 4294967295",
        /// What is found out now, such as `line`.
        step: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// Which one of the steps that is, from 1.
        place: u8 = "a number from 0 to 255",
        /// How many steps there are.
        steps: u8 = "a number from 0 to 255",
        /// What is asked, by the name of its sentence. Without one, something must happen first.
        question: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// What that is about, if the question alone does not say so.
        about: Reason = "a sentence in one word",
        /// What it takes for an answer, such as `yes`, `number` or `ways`.
        takes: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
        /// Whether the robot moves until an answer comes, or by itself for a moment.
        moves: bool = "0 or 1",
        /// The values that belong to the step.
        shows: Reason = "a sentence in one word",
        /// Why the step has begun anew, or an answer was none.
        why: Reason = "a sentence in one word",
        /// How it has ended; the last line of a commissioning.
        ended: Reason = "a sentence in one word",
    }
}

/// What a commissioning has found out, with the step of each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FoundOut {
    total: u32,
    last: Vec<(Name, Reason)>,
}

impl FoundOut {
    /// How many bytes of a line are there for them.
    const ROOM: usize = 960;

    /// All of it, of which as much is kept as fits in a line: the last.
    pub fn new(all: &[(Name, Reason)]) -> Self {
        let mut room = Self::ROOM;
        let fits = all.iter().rev().take_while(|one| {
            let needed = Item(one).to_string().len();
            room.checked_sub(needed)
                .inspect(|left| room = *left)
                .is_some()
        });
        let count = fits.count();
        Self {
            total: u32::try_from(all.len()).unwrap_or(u32::MAX),
            last: all[all.len() - count..].to_vec(),
        }
    }

    /// The last of it, as much as the line has.
    pub fn last(&self) -> &[(Name, Reason)] {
        &self.last
    }

    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        let total = number(reader)?;
        let mut last = Vec::new();
        while !reader.ahead().text.is_empty() {
            if last.len() as u64 == u64::from(total) {
                return Err(reader.ahead().misread("the end of the line"));
            }
            let step = reader.word();
            let step = step.read(Name::WANTED, |name| Name::new(name).ok())?;
            let said = reader
                .word()
                .read("a sentence in one word", <Reason as Value>::of)?;
            last.push((step, said));
        }
        Ok(Self { total, last })
    }
}

impl fmt::Display for FoundOut {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.total)?;
        let mut last = self.last.iter();
        last.try_for_each(|one| Item(one).fmt(formatter))
    }
}

/// A finding with its step, and a blank before each.
struct Item<'a>(&'a (Name, Reason));

impl fmt::Display for Item<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (step, said) = self.0;
        write!(formatter, " {step} ")?;
        said.put(formatter)
    }
}

/// A line of the description of a robot that was saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeptLine {
    /// Its number, from 1.
    pub number: u32,
    /// How many lines there are.
    pub of: u32,
    /// What stands in it.
    pub text: Text,
}

impl KeptLine {
    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
        Ok(Self {
            number: number(reader)?,
            of: number(reader)?,
            text: reader.rest_as_text()?,
        })
    }
}

impl fmt::Display for KeptLine {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { number, of, text } = self;
        match text.as_str() {
            "" => write!(formatter, "{number} {of}"),
            text => write!(formatter, "{number} {of} {text}"),
        }
    }
}

pub(super) fn read(reader: &mut Reader<'_>) -> Result<Commission, Misread> {
    let word = reader.word();
    Ok(match word.text {
        "begin" => Commission::Begin,
        "undo" => Commission::Undo,
        "restart" => Commission::Restart,
        "here" => Commission::Here,
        "stand" => Commission::Stand,
        "quit" => Commission::Quit,
        "answer" => Commission::Answer {
            asked: number(reader)?,
            word: reader.word().read(
                "an answer of 1 to 16 of a-z, 0-9, the point, the comma and -",
                AnswerWord::new,
            )?,
        },
        _ => return Err(word.misread("one of begin, undo, restart, here, stand, quit and answer")),
    })
}

pub(super) fn put(said: Commission, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
    formatter.write_str(match said {
        Commission::Begin => "begin",
        Commission::Undo => "undo",
        Commission::Restart => "restart",
        Commission::Here => "here",
        Commission::Stand => "stand",
        Commission::Quit => "quit",
        Commission::Answer { asked, word } => {
            return write!(formatter, "answer {asked} {}", word.as_str());
        }
    })
}
