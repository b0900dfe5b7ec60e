//! The conversation of a robot with the external computer (C1-C9): the lines of either side, and
//! which answer is awaited.
//!
//! The robot connects by TCP and asks; Robert, the server, answers, from what GaG answers him or
//! from what he knows (C1). The lines are those of [`gag`](crate::gag), with the robot in Robert's
//! place and Robert in GaG's. This is a robot that fetches product 7, `>` its lines, `<` Robert's:
//!
//! ```text
//! > sidelength                     (C3)
//! < sidelength 40
//! > karta                          (C6; only where the map is not known)
//! < karta 4 3 0 0
//! > prodlis
//! < prodlis 2 7 1 0 down 12 0 1 left
//! > fetchprod                      held until the user has chosen (AMB-43)
//! < fetchprod 7
//! > set_robot 1 0                  the next node (C8, L500)
//! > set_heading right
//! > thought I am in position
//! > armcomm                        (C7)
//! < armcomm 11110100
//! > armcomm
//! < pickup_done                    (AMB-44)
//! > thought Product 7 is delivered
//! > fetchprod                      only now again (C6)
//! ```
//!
//! - One question is held at a time (C4, C5). A new one takes the place of the one before, as when
//!   the robot is switched to manual while `fetchprod` is held: then it asks `styrcomm` (L436), and
//!   an answer to `fetchprod` that is under way is passed over.
//! - While either of `styrcomm` and `armcomm` is held, a command of the other kind answers it as
//!   well, because a person drives and moves the arm by one keyboard. `pickup_done` answers
//!   `armcomm` alone.
//! - `thought`, `set_robot` and `set_heading` may come at any time and are not answered.
//! - `styrcomm 1` makes the robot stand. It latches nothing: the next command moves it again.
//!
//! What is an extension of this stands in [`extension`](crate::extension); a peer that knows only
//! the lines above never meets it but for one line, which it does not answer.
//!
//! ```
//! use lager_lines::conversation::{AnswerRefused, Held, RobotLine, StationLine};
//! use lager_lines::gag::{Answer, Query, Request};
//!
//! let mut held = Held::default();
//! let asked = RobotLine::read("styrcomm").unwrap();
//! assert_eq!(asked, RobotLine::Request(Request::Query(Query::Wheels)));
//! held.ask(Query::Wheels);
//!
//! let StationLine::Answer(step) = StationLine::read("armcomm F3").unwrap() else { panic!() };
//! let StationLine::Answer(late) = StationLine::read("fetchprod 7").unwrap() else { panic!() };
//! assert_eq!(held.answer(&late), Err(AnswerRefused::Other { held: Query::Wheels }));
//! assert_eq!(held.answer(&step), Ok(Query::Wheels));
//! assert_eq!(held.answer(&step), Err(AnswerRefused::NothingHeld));
//! ```

use core::fmt;

use thiserror::Error;

use crate::extension::{ActionError, Hello, Order, Report};
use crate::gag::{Answer, AnswerError, Query, Request};
use crate::misread::Misread;

/// A line of the robot.
#[derive(Clone, Debug, PartialEq)]
pub enum RobotLine {
    /// A question or telemetry of the document.
    Request(Request),
    /// That the robot speaks the extension.
    Hello(Hello),
    /// A line of the extension.
    Report(Report),
}

impl RobotLine {
    /// Reads a line without its end.
    ///
    /// # Errors
    ///
    /// When a robot has no such line.
    pub fn read(line: &str) -> Result<Self, Misread> {
        if let Some(hello) = Hello::read(line) {
            return hello.map(Self::Hello);
        }
        match Report::read(line) {
            Some(report) => report.map(Self::Report),
            None => Request::read(line).map(Self::Request),
        }
    }
}

impl fmt::Display for RobotLine {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Request(request) => request.fmt(formatter),
            Self::Hello(hello) => hello.fmt(formatter),
            Self::Report(report) => report.fmt(formatter),
        }
    }
}

/// A line of the external computer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StationLine {
    /// An answer of the document.
    Answer(Answer),
    /// That the station speaks the extension.
    Hello(Hello),
    /// A line of the extension.
    Order(Order),
}

/// Why a line is none of the external computer's.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StationLineError {
    /// It announces the extension wrongly.
    #[error(transparent)]
    Hello(Misread),
    /// Its first word is none of the extension's, and it is no answer.
    #[error(transparent)]
    Answer(AnswerError),
    /// It orders nothing that can be done.
    #[error(transparent)]
    Order(ActionError),
}

impl StationLineError {
    /// Whether its first word is none that an external computer says, as where a peer answers the
    /// extension's first line that it does not understand it.
    pub fn is_of_nobody(&self) -> bool {
        matches!(self, Self::Answer(AnswerError::Misread(misread)) if misread.column == 1)
    }
}

impl StationLine {
    /// Reads a line without its end.
    ///
    /// # Errors
    ///
    /// When an external computer has no such line.
    pub fn read(line: &str) -> Result<Self, StationLineError> {
        if let Some(hello) = Hello::read(line) {
            return hello.map(Self::Hello).map_err(StationLineError::Hello);
        }
        match Order::read(line) {
            Some(order) => order.map(Self::Order).map_err(StationLineError::Order),
            None => Answer::read(line)
                .map(Self::Answer)
                .map_err(StationLineError::Answer),
        }
    }
}

impl fmt::Display for StationLine {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Answer(answer) => answer.fmt(formatter),
            Self::Hello(hello) => hello.fmt(formatter),
            Self::Order(order) => order.fmt(formatter),
        }
    }
}

/// Which question is held. Both sides keep one: the robot to know what an answer is to, Robert to
/// know what he may answer.
///
/// ```text
///            ask                      ask: takes its place
///  nothing ───────> a question is held ────┐
///     ▲                  │    ▲            │
///     └──────────────────┘    └────────────┘
///        an answer to it
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held(Option<Query>);

/// Why a line that is an answer answers nothing. It is passed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum AnswerRefused {
    /// No question is held.
    #[error("nothing is asked; wait for a question")]
    NothingHeld,
    /// Another question is held.
    #[error("`{held}` is asked, and this does not answer it")]
    Other {
        /// What is held.
        held: Query,
    },
}

impl Held {
    /// The question that is held.
    pub const fn get(self) -> Option<Query> {
        self.0
    }

    /// `query` is asked; it takes the place of one that is held.
    pub fn ask(&mut self, query: Query) {
        self.0 = Some(query);
    }

    /// Nothing is asked any more, as when a connection ends.
    pub fn clear(&mut self) {
        self.0 = None;
    }

    /// Takes an answer and gives the question it is to, which is then no longer held.
    ///
    /// # Errors
    ///
    /// When this answers no question that is held; the question stays.
    pub fn answer(&mut self, answer: &Answer) -> Result<Query, AnswerRefused> {
        let held = self.0.ok_or(AnswerRefused::NothingHeld)?;
        let of_a_person = [Query::Arm, Query::Wheels];
        let is_command = matches!(answer, Answer::Command(_));
        if answer.is_to(held) || (is_command && of_a_person.contains(&held)) {
            self.0 = None;
            return Ok(held);
        }
        Err(AnswerRefused::Other { held })
    }
}
