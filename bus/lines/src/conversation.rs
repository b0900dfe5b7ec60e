//! The conversation of a robot with the external computer (C1-C9): the lines of both sides, and the
//! question that is open.
//!
//! The robot connects by TCP and asks. Robert, the server, answers: from the answers of a GaG, or
//! from what he knows (C1). The lines are those of [`gag`](crate::gag), with the robot in Robert's
//! place and Robert in GaG's. In this example a robot fetches product 7; `>` marks its lines, `<`
//! Robert's:
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
//! > set_robot 1 0                  the next node (C8)
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
//! - One question is open at a time (C4, C5). A new question replaces it. For example, a robot
//!   waits for the answer to `fetchprod` when somebody switches it to manual mode: then it asks
//!   `styrcomm` (C4), and ignores a late answer to `fetchprod`.
//! - A command of either kind answers both `styrcomm` and `armcomm`, because a person drives and
//!   moves the arm with one keyboard. `pickup_done` answers only `armcomm`.
//! - `thought`, `set_robot` and `set_heading` may come at any time. Nobody answers them.
//! - `styrcomm 1` makes the robot stand, until the next command moves it again.
//!
//! [`extension`](crate::extension) has more lines. A peer that knows only the lines above gets one
//! line of the extension, and does not answer it.
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
    /// The robot speaks the extension.
    Hello(Hello),
    /// A line of the extension.
    Report(Report),
}

impl RobotLine {
    /// Reads a line without its end.
    ///
    /// # Errors
    ///
    /// A robot never says such a line.
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
    /// The station speaks the extension.
    Hello(Hello),
    /// A line of the extension.
    Order(Order),
}

/// Why an external computer cannot have said this line.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StationLineError {
    /// Its announcement of the extension is wrong.
    #[error(transparent)]
    Hello(Misread),
    /// It is neither a line of the extension nor an answer.
    #[error(transparent)]
    Answer(AnswerError),
    /// It gives an order that does not exist.
    #[error(transparent)]
    Order(ActionError),
}

impl StationLineError {
    /// Whether an external computer never begins a line with this word. A peer that does not know
    /// the extension may answer its first line like that.
    pub fn is_of_nobody(&self) -> bool {
        matches!(self, Self::Answer(AnswerError::Misread(misread)) if misread.column == 1)
    }
}

impl StationLine {
    /// Reads a line without its end.
    ///
    /// # Errors
    ///
    /// An external computer never says such a line.
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

/// The question that is open. Both sides keep one: the robot knows by it what an answer means, and
/// Robert knows what he may answer.
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

/// Why an answer fits no open question. The receiver ignores it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum AnswerRefused {
    /// No question is open.
    #[error("nothing is asked; wait for a question")]
    NothingHeld,
    /// Another question is open.
    #[error("`{held}` is asked, and this does not answer it")]
    Other {
        /// The open question.
        held: Query,
    },
}

impl Held {
    /// The open question.
    pub const fn get(self) -> Option<Query> {
        self.0
    }

    /// The robot asks `query`, which replaces an open question.
    pub fn ask(&mut self, query: Query) {
        self.0 = Some(query);
    }

    /// No question is open any more, for example because the connection has ended.
    pub fn clear(&mut self) {
        self.0 = None;
    }

    /// Takes an answer. Returns its question and closes it.
    ///
    /// # Errors
    ///
    /// The answer fits no open question. An open question stays open.
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
