//! The document's grammar of GaG and Robert (G1-G10): the questions and their answers.
//!
//! Robert, the server on the external computer, sends one line. GaG, the user interface, sends one
//! line back if there is an answer. The sign `→` in this table stands between a request and its
//! answer, as in the document.
//!
//! ```text
//! sidelength        → sidelength <cm>                              side of a square (G4)
//! karta             → karta <coord> <coord>                        size, delivery corner (G3)
//! prodlis           → prodlis <int> {<product>}                    pick stations (G5)
//! fetchprod         → fetchprod <prodid>                           what to fetch (G6)
//! armcomm           → armcomm <int ∈ [F1, FA]> | pickup_done       a step of the arm (G7)
//! styrcomm          → styrcomm <int ∈ [1, 9]>                      a command to the wheels (G8)
//! thought <text>    → nothing                                      what the robot says (G9)
//! set_robot <coord> → nothing                                      where it is (G9)
//! set_heading <direction> → nothing                                where it looks (G9)
//!
//! <cm>        ::= <int>                       40 to 500
//! <coord>     ::= <int> <int>                 x y, each 0 to 255; a size 1 to 99
//! <product>   ::= <prodid> <coord> <side>
//! <prodid>    ::= <int>                       0 to 2147483647, each product has its own
//! <side>      ::= <direction>
//! <direction> ::= left | up | right | down
//! ```
//!
//! - The document writes the list of products `prodlis` and must have meant `prodlist`. Robert
//!   reads both, and an answer repeats the spelling of the question (AMB-40). Its number says how
//!   many products follow, which may be 0 (AMB-41). They all stand in one line, so at most
//!   [`MAX_LINE`] bytes of them fit, some sixty products.
//! - GaG answers `karta` and `sidelength` once the user has described the warehouse, and
//!   `fetchprod`, `armcomm` and `styrcomm` once the user has chosen (AMB-42, AMB-43). An answer may
//!   take any time. Lines that need no answer may come meanwhile.
//! - A GaG may give commands faster than the robot takes them. While the robot asks for commands at
//!   all, `armcomm`, `styrcomm` and `pickup_done` wait with Robert until it asks for them. At most
//!   32 wait, and a stop replaces them. Robert refuses in a `thought` what cannot wait (C5).
//! - A command that never ends by itself ends with its GaG. If the socket closes, or GaG leaves a
//!   line unread for 200 ms, Robert makes the robot stand. To find a GaG that has frozen, Robert
//!   repeats the open question five times a second while a command of GaG moves the robot; GaG
//!   answers it once. A GaG must go on reading while it waits for its user.
//! - A command that moves the robot counts for 200 ms. If Robert was held up and reads it later, he
//!   refuses it in a `thought` and asks again.
//! - `pickup_done` answers `armcomm` and ends the picking. The document has this signal but no word
//!   for it (AMB-44).
//! - A code has four forms for reading and one for writing; see [`command`](crate::command).
//! - A text begins behind the one blank after `thought` and goes to the end of the line.
//!
//! ```
//! use lager_lines::gag::{Answer, Query, Request};
//! use lager_lines::to_line;
//!
//! let asked = Request::read("prodlis").unwrap();
//! let answer = Answer::read("prodlist 2 7 1 0 down 12 0 1 left").unwrap();
//! let Request::Query(query) = asked else { panic!("a question") };
//! assert_eq!(
//!     to_line(&answer.spelled_as(query)).unwrap(),
//!     "prodlis 2 7 1 0 down 12 0 1 left\n",
//! );
//!
//! assert_eq!(
//!     to_line(&Answer::read("armcomm F9").unwrap()).unwrap(),
//!     "armcomm 11111001\n",
//! );
//! assert_eq!(
//!     Answer::read("karta 4 3 2 3").unwrap_err().to_string(),
//!     "column 11: the delivery is at (2, 3), which is no corner of the floor; \
//!      its corners are (0, 0), (0, 3), (4, 0) and (4, 3)",
//! );
//! assert_eq!(
//!     Request::read("thought  två blanka").unwrap().to_string(),
//!     "thought  två blanka",
//! );
//! ```
//!
//! [`MAX_LINE`]: crate::MAX_LINE

use core::fmt;
use core::time::Duration;

use lager_floor::{FloorError, Grid, Heading, MAX_PRODUCTS, Node, Product, ProductId, SideLength};
use lager_orders::Reason;
use lager_orders::lease::{LATEST, LATEST_MOVE};
use lager_wire::OperatorCommand;
use thiserror::Error;

use crate::command::{Code, CommandError, read_arm, read_wheels};
use crate::floor::{Products, Spelled as _, Words, grid};
use crate::misread::Misread;
use crate::reader::{Reader, Word};
use crate::text::Text;

/// How the list of products is spelled (AMB-40).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ListWord {
    /// `prodlis`, as the document writes it.
    Prodlis,
    /// `prodlist`, as the document must have meant it.
    Prodlist,
}

impl ListWord {
    /// The word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Prodlis => "prodlis",
            Self::Prodlist => "prodlist",
        }
    }
}

/// The questions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Query {
    /// `sidelength`: how long the side of a square is (G4, C3).
    SideLength,
    /// `karta`: how large the warehouse is, and at which corner the robot leaves it (G3).
    Map,
    /// `prodlis` or `prodlist`: which products there are (G5).
    Products(ListWord),
    /// `fetchprod`: which product to fetch (G6).
    Fetch,
    /// `armcomm`: the next step of the arm (G7).
    Arm,
    /// `styrcomm`: the next command to the wheels (G8).
    Wheels,
}

impl Query {
    /// Every question; the list of products with both spellings.
    pub const ALL: [Self; 7] = [
        Self::SideLength,
        Self::Map,
        Self::Products(ListWord::Prodlis),
        Self::Products(ListWord::Prodlist),
        Self::Fetch,
        Self::Arm,
        Self::Wheels,
    ];

    /// The question's word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::SideLength => "sidelength",
            Self::Map => "karta",
            Self::Products(word) => word.as_str(),
            Self::Fetch => "fetchprod",
            Self::Arm => "armcomm",
            Self::Wheels => "styrcomm",
        }
    }

    fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|query| query.as_str() == word)
    }
}

/// Lines that nobody answers (G9).
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Telemetry {
    /// `thought`: a thought of the robot.
    Thought(Text),
    /// `set_robot`: the node at which it is, or to which it goes (C8).
    Robot(Node),
    /// `set_heading`: which way it looks.
    Heading(Heading),
}

/// A line of the side that asks: Robert asks GaG, and the robot asks Robert.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Request {
    /// It needs an answer.
    Query(Query),
    /// It needs no answer.
    Telemetry(Telemetry),
}

impl Request {
    const WANTED: &str = "one of sidelength, karta, prodlis, prodlist, fetchprod, armcomm, \
                          styrcomm, thought, set_robot and set_heading";

    /// Reads a line without its end.
    ///
    /// # Errors
    ///
    /// The grammar does not have this line.
    pub fn read(line: &str) -> Result<Self, Misread> {
        let mut reader = Reader::new(line);
        let word = reader.word();
        if let Some(query) = Query::from_word(word.text) {
            return reader.end().map(|()| Self::Query(query));
        }
        let telemetry = match word.text {
            "thought" => {
                let text = reader.rest_as_text()?;
                return Ok(Self::Telemetry(Telemetry::Thought(text)));
            }
            "set_robot" => Telemetry::Robot(Node::read(&mut reader)?),
            "set_heading" => Telemetry::Heading(Heading::read(&mut reader)?),
            _ => return Err(word.misread(Self::WANTED)),
        };
        reader.end().map(|()| Self::Telemetry(telemetry))
    }
}

impl fmt::Display for Query {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

impl fmt::Display for Telemetry {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Thought(text) => write!(formatter, "thought {text}"),
            Self::Robot(node) => write!(formatter, "set_robot {}", Words(node)),
            Self::Heading(heading) => write!(formatter, "set_heading {heading}"),
        }
    }
}

impl fmt::Display for Request {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Query(query) => query.fmt(formatter),
            Self::Telemetry(telemetry) => telemetry.fmt(formatter),
        }
    }
}

/// A line of the side that answers: GaG answers Robert, and Robert answers the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// To `sidelength`.
    SideLength(SideLength),
    /// To `karta`.
    Map(Grid),
    /// To `prodlis` or `prodlist`, with this spelling.
    Products(ListWord, Products),
    /// To `fetchprod`.
    Fetch(ProductId),
    /// To `styrcomm` if it is for the wheels, to `armcomm` if it is for the arm.
    Command(OperatorCommand),
    /// To `armcomm`: the goods are in the gripper (AMB-44).
    PickupDone,
}

/// Why a line is not an answer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AnswerError {
    /// A word is wrong.
    #[error(transparent)]
    Misread(#[from] Misread),
    /// Such a warehouse cannot exist.
    #[error("column {column}: {error}")]
    Map {
        /// Where the wrong size or delivery begins, in characters from 1.
        column: usize,
        /// What is wrong with it.
        error: Reason,
    },
    /// Such a list of products cannot exist.
    #[error("column {column}: {error}")]
    Products {
        /// Where the wrong product begins, in characters from 1.
        column: usize,
        /// What is wrong with it.
        error: Reason,
    },
    /// No command has this code.
    #[error("column {column}: {error}")]
    Command {
        /// Where it begins, in characters from 1.
        column: usize,
        /// What is wrong with it.
        error: CommandError,
    },
}

impl Answer {
    const WANTED: &str = "one of sidelength, karta, prodlis, prodlist, fetchprod, armcomm, \
                          styrcomm and pickup_done";

    /// How late it may come. Answers about the warehouse, and a command to stand, are never too
    /// late.
    pub const fn latest(&self) -> Duration {
        match self {
            Self::SideLength(_)
            | Self::Map(_)
            | Self::Products(_, _)
            | Self::Command(OperatorCommand::Stop) => Duration::MAX,
            Self::Command(_) | Self::PickupDone => LATEST_MOVE,
            Self::Fetch(_) => LATEST,
        }
    }

    /// Reads a line without its end.
    ///
    /// # Errors
    ///
    /// The grammar does not have this line, or its content is impossible: the delivery is not at a
    /// corner, two products have one number, or no command has the code.
    pub fn read(line: &str) -> Result<Self, AnswerError> {
        let mut reader = Reader::new(line);
        let word = reader.word();
        let answer = match Query::from_word(word.text) {
            Some(Query::SideLength) => Self::SideLength(SideLength::read(&mut reader)?),
            Some(Query::Map) => Self::Map(read_map(&mut reader)?),
            Some(Query::Products(word)) => Self::Products(word, read_products(&mut reader)?),
            Some(Query::Fetch) => Self::Fetch(ProductId::read(&mut reader)?),
            Some(Query::Arm) => Self::Command(read_command(reader.word(), |code| {
                read_arm(code).map(OperatorCommand::Arm)
            })?),
            Some(Query::Wheels) => Self::Command(read_command(reader.word(), |code| {
                read_wheels(code).map(OperatorCommand::from)
            })?),
            None if word.text == "pickup_done" => Self::PickupDone,
            None => return Err(word.misread(Self::WANTED).into()),
        };
        reader.end()?;
        Ok(answer)
    }

    /// Whether this may answer `query`: it has the same word. Both words for the list of products
    /// count as the same, and `pickup_done` answers `armcomm`.
    pub fn is_to(&self, query: Query) -> bool {
        match (self, query) {
            (Self::SideLength(_), Query::SideLength)
            | (Self::Map(_), Query::Map)
            | (Self::Products(..), Query::Products(_))
            | (Self::Fetch(_), Query::Fetch)
            | (Self::PickupDone, Query::Arm) => true,
            (Self::Command(given), query) => query == asked_for(*given),
            _ => false,
        }
    }

    /// The same answer, with the list of products spelled as in `query` (AMB-40).
    #[must_use]
    pub fn spelled_as(self, query: Query) -> Self {
        match (self, query) {
            (Self::Products(_, products), Query::Products(word)) => Self::Products(word, products),
            (answer, _) => answer,
        }
    }
}

impl fmt::Display for Answer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SideLength(side) => write!(formatter, "sidelength {side}"),
            Self::Map(map) => {
                write!(
                    formatter,
                    "karta {} {}",
                    Words(&map.size()),
                    Words(&map.delivery())
                )
            }
            Self::Products(word, products) => {
                let products = products.as_slice();
                write!(formatter, "{} {}", word.as_str(), products.len())?;
                products
                    .iter()
                    .try_for_each(|product| write!(formatter, " {}", Words(product)))
            }
            Self::Fetch(product) => write!(formatter, "fetchprod {product}"),
            Self::Command(given) => {
                write!(formatter, "{} {}", asked_for(*given), Code(*given))
            }
            Self::PickupDone => formatter.write_str("pickup_done"),
        }
    }
}

fn read_map(reader: &mut Reader<'_>) -> Result<Grid, AnswerError> {
    let delivery = ["an x from 0 to 255", "a y from 0 to 255"];
    grid(
        || reader.word(),
        delivery,
        |column, error| AnswerError::Map {
            column,
            error: error.into(),
        },
    )
}

fn read_products(reader: &mut Reader<'_>) -> Result<Products, AnswerError> {
    let wanted = "the number of the products that follow";
    let count: usize = reader.word().number(wanted, 0, i64::from(u16::MAX))?;
    let mut places = Vec::new();
    let mut products = Vec::new();
    // If the number is too large, the line ends first: no memory is taken for it.
    for _ in 0..count {
        places.push(reader.ahead());
        products.push(Product::read(reader)?);
    }
    Products::new(products).map_err(|error| {
        let wrong = match error {
            FloorError::ProductTwice { index, .. } => index,
            _ => MAX_PRODUCTS,
        };
        AnswerError::Products {
            column: places[wrong].column(),
            error: error.into(),
        }
    })
}

fn read_command(
    word: Word<'_>,
    read: impl FnOnce(&str) -> Result<OperatorCommand, CommandError>,
) -> Result<OperatorCommand, AnswerError> {
    read(word.text).map_err(|error| AnswerError::Command {
        column: word.column(),
        error,
    })
}

/// The question to which a command is the answer.
const fn asked_for(command: OperatorCommand) -> Query {
    match command {
        OperatorCommand::Arm(_) => Query::Arm,
        _ => Query::Wheels,
    }
}
