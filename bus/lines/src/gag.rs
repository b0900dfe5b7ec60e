//! The document's grammar of GaG and Robert (G1-G10): who asks, and what is answered.
//!
//! Robert, the server on the external computer, sends one line; GaG, the user interface, answers
//! with one line where there is an answer. `→` in this table is the document's: a request and its
//! answer.
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
//! <cm>        ::= <int>                       1 to 65535
//! <coord>     ::= <int> <int>                 x y, each 0 to 255; a size 1 to 255
//! <product>   ::= <prodid> <coord> <side>
//! <prodid>    ::= <int>                       0 to 2147483647, each product has its own
//! <side>      ::= <direction>
//! <direction> ::= left | up | right | down
//! ```
//!
//! - The document spells the list of products `prodlis` and must have meant `prodlist`; both are
//!   read, and an answer repeats the spelling that was asked (AMB-40). Its number says how many
//!   products follow, which may be 0 (AMB-41). All stand in one line, so that up to [`MAX_LINE`]
//!   bytes of them can be listed, some sixty products.
//! - `karta` and `sidelength` are answered once the user has filled them in, `fetchprod`, `armcomm`
//!   and `styrcomm` once he has chosen (AMB-42, AMB-43): an answer may take as long as it likes,
//!   and what needs no answer may be sent meanwhile.
//! - A GaG may give commands faster than the robot takes them: `armcomm`, `styrcomm` and
//!   `pickup_done` that nobody has asked for wait with Robert, as long as the robot asks for
//!   commands at all. At most 32 wait, a stop takes their place, and what does not wait is refused
//!   in a `thought` (C5).
//! - A command that never ends by itself ends with its GaG: where the socket closes, or where what
//!   GaG is told lies unread for 200 ms, Robert has the robot stand. So that a GaG that has frozen
//!   is found, Robert repeats the question that is held while the robot moves by GaG's word, five
//!   times a second; it wants one answer. A GaG that waits for its user reads on meanwhile.
//! - What moves the robot counts for 200 ms: a command that Robert finds later, because he was held
//!   up, is refused in a `thought`, and the question is asked again.
//! - `pickup_done` is the answer to `armcomm` that ends the picking; the document has the signal
//!   but no word for it (AMB-44).
//! - The codes of commands are read in four forms and written in one; see
//!   [`command`](crate::command).
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
//!     "column 11: (2, 3) is no corner of the warehouse; \
//!      the delivery is at (0, 0), (0, 3), (4, 0) or (4, 3)",
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

use lager_wire::OperatorCommand;
use thiserror::Error;

use crate::command::{Code, CommandError, read_arm, read_wheels};
use crate::late::{LATEST, LATEST_MOVE};
use crate::misread::Misread;
use crate::reader::{Reader, Word};
use crate::text::Text;
use crate::warehouse::{
    Coord, Direction, Map, MapError, Product, ProductId, Products, ProductsError, SideLength,
};

/// How the list of products is spelled (AMB-40).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ListWord {
    /// `prodlis`, as the document has it.
    Prodlis,
    /// `prodlist`, as it must have been meant.
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

/// What is asked and answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Query {
    /// `sidelength`: how long the side of a square is (G4, C3).
    SideLength,
    /// `karta`: how large the warehouse is and where it is left (G3).
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
    /// Every question, the list of products by both of its words.
    pub const ALL: [Self; 7] = [
        Self::SideLength,
        Self::Map,
        Self::Products(ListWord::Prodlis),
        Self::Products(ListWord::Prodlist),
        Self::Fetch,
        Self::Arm,
        Self::Wheels,
    ];

    /// The word that asks it.
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

/// What is told and not answered (G9).
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Telemetry {
    /// `thought`: what the robot has to say.
    Thought(Text),
    /// `set_robot`: the node at which it is, or to which it goes (L500).
    Robot(Coord),
    /// `set_heading`: where it looks.
    Heading(Direction),
}

/// A line of the side that asks: Robert towards GaG, the robot towards Robert.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Request {
    /// It is answered.
    Query(Query),
    /// It is not answered.
    Telemetry(Telemetry),
}

impl Request {
    const WANTED: &str = "one of sidelength, karta, prodlis, prodlist, fetchprod, armcomm, \
                          styrcomm, thought, set_robot and set_heading";

    /// Reads a line without its end.
    ///
    /// # Errors
    ///
    /// When the grammar does not have it.
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
            "set_robot" => Telemetry::Robot(Coord::read(&mut reader)?),
            "set_heading" => Telemetry::Heading(Direction::read(&mut reader)?),
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
            Self::Robot(coord) => write!(formatter, "set_robot {coord}"),
            Self::Heading(direction) => write!(formatter, "set_heading {direction}"),
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

/// A line of the side that answers: GaG towards Robert, Robert towards the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// To `sidelength`.
    SideLength(SideLength),
    /// To `karta`.
    Map(Map),
    /// To `prodlis` or `prodlist`, spelled like this.
    Products(ListWord, Products),
    /// To `fetchprod`.
    Fetch(ProductId),
    /// To `styrcomm` if the wheels do it, to `armcomm` if the arm does.
    Command(OperatorCommand),
    /// To `armcomm`: the goods are in the gripper (AMB-44).
    PickupDone,
}

/// Why a line is no answer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AnswerError {
    /// Something else stands there than belongs there.
    #[error(transparent)]
    Misread(#[from] Misread),
    /// There is no such warehouse.
    #[error("column {column}: {error}")]
    Map {
        /// Where the size or the delivery begins, in characters from 1.
        column: usize,
        /// What is wrong with it.
        error: MapError,
    },
    /// This is no list of products.
    #[error("column {column}: {error}")]
    Products {
        /// Where the product begins that is wrong, in characters from 1.
        column: usize,
        /// What is wrong with it.
        error: ProductsError,
    },
    /// This is no command's code.
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

    /// How late it may come. What is said of the warehouse, and a command to stand, are never too
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
    /// When the grammar does not have it, or when what it says cannot be: a delivery that is in no
    /// corner, two products with one number, a code that is not of the list.
    pub fn read(line: &str) -> Result<Self, AnswerError> {
        let mut reader = Reader::new(line);
        let word = reader.word();
        let answer = match Query::from_word(word.text) {
            Some(Query::SideLength) => Self::SideLength(SideLength::read(&mut reader)?),
            Some(Query::Map) => Self::Map(read_map(&mut reader)?),
            Some(Query::Products(word)) => Self::Products(word, read_products(&mut reader)?),
            Some(Query::Fetch) => Self::Fetch(ProductId::from_word(reader.word())?),
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

    /// Whether this may answer `query`: the same word, the list of products by either of its words,
    /// and `pickup_done` to `armcomm`.
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

    /// The same answer, with the list of products spelled as `query` asks for it (AMB-40).
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
            Self::Map(map) => write!(formatter, "karta {map}"),
            Self::Products(word, products) => {
                let products = products.as_slice();
                write!(formatter, "{} {}", word.as_str(), products.len())?;
                products
                    .iter()
                    .try_for_each(|product| write!(formatter, " {product}"))
            }
            Self::Fetch(product) => write!(formatter, "fetchprod {product}"),
            Self::Command(given) => {
                write!(formatter, "{} {}", asked_for(*given), Code(*given))
            }
            Self::PickupDone => formatter.write_str("pickup_done"),
        }
    }
}

fn read_map(reader: &mut Reader<'_>) -> Result<Map, AnswerError> {
    let at_size = reader.ahead();
    let size = Coord {
        x: reader
            .word()
            .number("a width of 1 to 255 squares", 0, 255)?,
        y: reader
            .word()
            .number("a height of 1 to 255 squares", 0, 255)?,
    };
    let at_delivery = reader.ahead();
    let delivery = Coord::read(reader)?;
    Map::new(size, delivery).map_err(|error| AnswerError::Map {
        column: match error {
            MapError::Empty { .. } => at_size.column(),
            MapError::Delivery { .. } => at_delivery.column(),
        },
        error,
    })
}

fn read_products(reader: &mut Reader<'_>) -> Result<Products, AnswerError> {
    let wanted = "the number of the products that follow";
    let count: usize = reader.word().number(wanted, 0, i64::from(u16::MAX))?;
    let mut places = Vec::new();
    let mut products = Vec::new();
    // A count that is too large finds the line's end and not the memory's.
    for _ in 0..count {
        places.push(reader.ahead());
        products.push(Product {
            id: ProductId::from_word(reader.word())?,
            square: Coord::read(reader)?,
            side: Direction::read(reader)?,
        });
    }
    Products::new(products).map_err(|error| {
        let ProductsError::Twice { index, .. } = error;
        AnswerError::Products {
            column: places[index].column(),
            error,
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
