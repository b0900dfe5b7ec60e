//! Station to robot: stops and numbered actions.
//!
//! ```text
//! <action> ::= order <order> <prodid>  fetch a product after those that wait
//!            | cancel <order>          fetch it no more; refused once its goods are held
//!            | first <order>           fetch it before those that wait
//!            | up <order>              fetch it before the one that is now before it
//!            | clear                   fetch none of those that wait
//!            | back [<prodid>]         those goods, or all, are in their places again
//!            | mode <mode>             who drives
//!            | resume <stop>           end this stop, as `stop=` of the state tells it; refused
//!                                      where another one was set meanwhile
//!            | reset                   the robot stands on the delivery corner, looking inwards
//!            | place <edge>            it stands on that node and looks that way; a simulated one
//!                                      is put there
//!            | pick manual|auto        who picks the goods up from now on: a person, or the robot
//!            | picked [force]          the goods are in the gripper; force: felt or not
//!            | drive <styrcomm> [<speed>] <ms>
//!                                      the wheels, for 1 to 1000 ms from receipt
//!            | arm <armcomm>           one step of the arm
//!            | gains <int> <int>       of the error and of its change, each 0 to 255
//!            | calibrate               the line sensors, on the tape under the robot
//!            | restart sensor|steering
//!                                      that board; refused while the robot moves
//!            | horn                    the robot sounds its horn: it says so in a thought
//!            | obstacle put <edge>     in a simulated world
//!            | obstacle take <edge>
//!            | commission <said>       to the commissioning of the robot; see `commission.rs`
//! <order>  ::= <int>                   0 to 4294967295, chosen by the station; 0 is refused
//! <mode>   ::= manual | autonomous
//! <speed>  ::= slow | middle | full     full if it is left out; 2, 4, 6 and 7 alone have one
//! <edge>   ::= <coord> <direction>     from a node to the next one that way
//! ```

use core::fmt;

use lager_floor::{Place, ProductId};
use lager_orders::{Action, LeaseMs, Mode, Pick, Put};
use lager_wire::{Callsign, OperatorCommand, Speed};
use thiserror::Error;

use super::commission;
use super::fields::{Value as _, number};
use crate::command::{Code, CommandError, read_arm, read_wheels};
use crate::floor::{Spelled as _, Words};
use crate::misread::Misread;
use crate::reader::{Reader, Word};

/// What a station orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Stand at once; read ahead of everything else.
    Stop {
        /// What `stopped` repeats; a stop without a number is not confirmed.
        number: Option<u32>,
    },
    /// Do something and say what came of it.
    Do {
        /// What `done` or `refused` repeats.
        number: u32,
        /// For how long it had been given when the station said this, in ms.
        late_ms: u32,
        /// What to do.
        action: Action,
    },
}

/// Why an order cannot be carried out.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ActionError {
    /// Something else stands there than belongs there.
    #[error("{misread}")]
    Misread {
        /// The action's number, if it could be read.
        number: Option<u32>,
        /// What.
        misread: Misread,
    },
    /// This is no command's code.
    #[error("column {column}: {error}")]
    Command {
        /// The action's number.
        number: u32,
        /// Where the code begins, in characters from 1.
        column: usize,
        /// What is wrong with it.
        error: CommandError,
    },
}

impl ActionError {
    /// The number with which to refuse it.
    pub const fn number(&self) -> Option<u32> {
        match self {
            Self::Misread { number, .. } => *number,
            Self::Command { number, .. } => Some(*number),
        }
    }
}

/// Why the words behind a number are no action.
enum Fault {
    Misread(Misread),
    Command { column: usize, error: CommandError },
}

impl From<Misread> for Fault {
    fn from(misread: Misread) -> Self {
        Self::Misread(misread)
    }
}

impl Order {
    /// Reads a line; `None` if its first word is another one.
    ///
    /// # Errors
    ///
    /// When an action's number is none or there is no such action. A stop is always read.
    pub fn read(line: &str) -> Option<Result<Self, ActionError>> {
        let mut reader = Reader::new(line);
        match reader.word().text {
            "stop" => {
                let number = number(&mut reader).ok();
                Some(Ok(Self::Stop { number }))
            }
            "do" => Some(read_do(reader)),
            _ => None,
        }
    }
}

fn read_do(mut reader: Reader<'_>) -> Result<Order, ActionError> {
    let number = number(&mut reader).map_err(|misread| ActionError::Misread {
        number: None,
        misread,
    })?;
    let (late_ms, action) = read_given(reader).map_err(|fault| match fault {
        Fault::Misread(misread) => ActionError::Misread {
            number: Some(number),
            misread,
        },
        Fault::Command { column, error } => ActionError::Command {
            number,
            column,
            error,
        },
    })?;
    Ok(Order::Do {
        number,
        late_ms,
        action,
    })
}

/// For how long it was given, and what.
fn read_given(mut reader: Reader<'_>) -> Result<(u32, Action), Fault> {
    let late_ms = match reader.ahead().text {
        "late" => {
            reader.word();
            let wanted = "a time from 0 to 4294967295 ms";
            reader.word().number(wanted, 0, i64::from(u32::MAX))?
        }
        _ => 0,
    };
    Ok((late_ms, read_action(reader)?))
}

fn read_action(mut reader: Reader<'_>) -> Result<Action, Fault> {
    let word = reader.word();
    let action = match word.text {
        "order" => Action::Add {
            order: number(&mut reader)?,
            product: ProductId::read(&mut reader)?,
        },
        "cancel" => Action::Cancel {
            order: number(&mut reader)?,
        },
        "first" => Action::First {
            order: number(&mut reader)?,
        },
        "up" => Action::Up {
            order: number(&mut reader)?,
        },
        "clear" => Action::Clear,
        "back" if reader.ahead().text.is_empty() => Action::Back { product: None },
        "back" => Action::Back {
            product: Some(ProductId::read(&mut reader)?),
        },
        "mode" => Action::Mode(
            reader
                .word()
                .read("manual or autonomous", Mode::from_word)?,
        ),
        "resume" => Action::Resume {
            stop: reader
                .word()
                .read("the number of the stop, as the state tells it", u64::of)?,
        },
        "reset" => Action::Reset,
        "place" => Action::Place(Place::read(&mut reader)?),
        "picked" => Action::Picked {
            force: reader
                .word()
                .read("force or the end of the line", |word| match word {
                    "" => Some(false),
                    "force" => Some(true),
                    _ => None,
                })?,
        },
        "pick" => Action::Pick(reader.word().read("manual or auto", Pick::from_word)?),
        "drive" => read_drive(&mut reader)?,
        "arm" => Action::Arm(read_command(reader.word(), read_arm)?),
        "gains" => Action::Gains {
            p: reader.word().number("a gain from 0 to 255", 0, 255)?,
            d: reader.word().number("a gain from 0 to 255", 0, 255)?,
        },
        "calibrate" => Action::Calibrate,
        "restart" => Action::Restart(reader.word().read("sensor or steering", board)?),
        "horn" => Action::Horn,
        "obstacle" => Action::Obstacle {
            put: reader.word().read("put or take", |word| {
                [Put::Put, Put::Take]
                    .into_iter()
                    .find(|put| put.as_str() == word)
            })?,
            way: Place::read(&mut reader)?,
        },
        "commission" => Action::Commission(commission::read(&mut reader)?),
        _ => {
            let wanted = "one of order, cancel, first, up, clear, back, mode, resume, reset, place, \
                          picked, pick, drive, arm, gains, calibrate, restart, horn, obstacle and \
                          commission";
            return Err(word.misread(wanted).into());
        }
    };
    reader.end()?;
    Ok(action)
}

/// A board by its name.
fn board(word: &str) -> Option<Callsign> {
    match word {
        "sensor" => Some(Callsign::Sensor),
        "steering" => Some(Callsign::Steering),
        _ => None,
    }
}

fn read_drive(reader: &mut Reader<'_>) -> Result<Action, Fault> {
    let mut wheels = read_command(reader.word(), read_wheels)?;
    let word = reader.ahead();
    if word
        .text
        .starts_with(|letter: char| letter.is_ascii_alphabetic())
    {
        reader.word();
        let wanted = match wheels.at(Speed::Full) {
            Some(_) => "slow, middle, full or a time from 1 to 1000 ms",
            None => "a time from 1 to 1000 ms (only 2, 4, 6 and 7 have a speed)",
        };
        wheels = word.read(wanted, |word| wheels.at(Speed::from_word(word)?))?;
    }
    let lease = reader.word().read("a time from 1 to 1000 ms", |word| {
        u16::of(word).and_then(LeaseMs::new)
    })?;
    Ok(Action::Drive { wheels, lease })
}

fn read_command<T>(word: Word<'_>, read: fn(&str) -> Result<T, CommandError>) -> Result<T, Fault> {
    read(word.text).map_err(|error| Fault::Command {
        column: word.column(),
        error,
    })
}

impl fmt::Display for Order {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stop { number: None } => formatter.write_str("stop"),
            Self::Stop {
                number: Some(number),
            } => write!(formatter, "stop {number}"),
            Self::Do {
                number,
                late_ms: 0,
                action,
            } => write!(formatter, "do {number} {}", Spelled(action)),
            Self::Do {
                number,
                late_ms,
                action,
            } => write!(formatter, "do {number} late {late_ms} {}", Spelled(action)),
        }
    }
}

/// An action as its words stand in a line.
#[derive(Clone, Copy, Debug)]
pub struct Spelled<'a>(pub &'a Action);

impl fmt::Display for Spelled<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Action::Add { order, product } => write!(formatter, "order {order} {product}"),
            Action::Cancel { order } => write!(formatter, "cancel {order}"),
            Action::First { order } => write!(formatter, "first {order}"),
            Action::Up { order } => write!(formatter, "up {order}"),
            Action::Clear => formatter.write_str("clear"),
            Action::Back { product: None } => formatter.write_str("back"),
            Action::Back {
                product: Some(product),
            } => write!(formatter, "back {product}"),
            Action::Mode(mode) => write!(formatter, "mode {}", mode.as_str()),
            Action::Resume { stop } => write!(formatter, "resume {stop}"),
            Action::Reset => formatter.write_str("reset"),
            Action::Place(on) => write!(formatter, "place {}", Words(on)),
            Action::Picked { force: false } => formatter.write_str("picked"),
            Action::Picked { force: true } => formatter.write_str("picked force"),
            Action::Pick(pick) => write!(formatter, "pick {}", pick.as_str()),
            Action::Drive { wheels, lease } => {
                let command = OperatorCommand::from(*wheels);
                let (code, lease) = (Code(command), lease.get());
                match command.speed() {
                    Speed::Full => write!(formatter, "drive {code} {lease}"),
                    slower => write!(formatter, "drive {code} {} {lease}", slower.as_str()),
                }
            }
            Action::Arm(step) => write!(formatter, "arm {}", Code(OperatorCommand::Arm(*step))),
            Action::Gains { p, d } => write!(formatter, "gains {p} {d}"),
            Action::Calibrate => formatter.write_str("calibrate"),
            Action::Restart(board) => write!(formatter, "restart {board}"),
            Action::Horn => formatter.write_str("horn"),
            Action::Obstacle { put, way } => {
                write!(formatter, "obstacle {} {}", put.as_str(), Words(way))
            }
            Action::Commission(said) => {
                formatter.write_str("commission ")?;
                commission::put(*said, formatter)
            }
        }
    }
}
