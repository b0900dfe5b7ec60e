//! Station to robot: stops and numbered actions.

use core::fmt;
use core::time::Duration;

use lager_wire::{OperatorArm, OperatorCommand};
use thiserror::Error;

use super::fields::Value as _;
use super::listed::Edge;
use super::mode::{Mode, Pick};
use crate::command::{Code, CommandError, Wheels, read_arm, read_wheels};
use crate::late::{LATEST, LATEST_MOVE};
use crate::misread::Misread;
use crate::reader::{Reader, Word};
use crate::warehouse::ProductId;

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

/// What a station wants done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// `order`: fetch a product after those that wait (F3).
    Add {
        /// The number of the order, chosen by the station.
        order: u32,
        /// What to fetch.
        product: ProductId,
    },
    /// `cancel`: fetch it no more.
    Cancel {
        /// The order.
        order: u32,
    },
    /// `first`: fetch it before those that wait.
    First {
        /// The order.
        order: u32,
    },
    /// `up`: fetch it before the one that is now before it.
    Up {
        /// The order.
        order: u32,
    },
    /// `clear`: fetch none of those that wait.
    Clear,
    /// `mode`: who drives.
    Mode(Mode),
    /// `resume`: end a stop, and no other that was set meanwhile.
    Resume {
        /// Which, as [`State`](super::State) tells it.
        stop: u64,
    },
    /// `reset`: the robot stands on the delivery corner and looks into the warehouse (B1).
    Reset,
    /// `place`: the robot stands on a crossing and looks along the grid; a simulated one is put
    /// there.
    Place(Edge),
    /// `picked`: the goods are in the gripper (L7).
    Picked {
        /// Whether or not the gripper feels them.
        force: bool,
    },
    /// `pick`: who picks the goods up from now on.
    Pick(Pick),
    /// `drive`: the wheels (G8).
    Drive {
        /// What they do.
        wheels: Wheels,
        /// For how long from the line's receipt on, unless it is renewed.
        lease: LeaseMs,
    },
    /// `arm`: one step of the arm (G7).
    Arm(OperatorArm),
    /// `gains`: of the line control (E10).
    Gains {
        /// On the error, in the firmware's unit.
        p: u8,
        /// On the change of the error, in the firmware's unit.
        d: u8,
    },
    /// `calibrate`: the line sensors, on the tape under the robot (E9).
    Calibrate,
    /// `obstacle`: put one on an edge of a simulated world, or take it away (E6).
    Obstacle {
        /// Which of the two.
        put: Put,
        /// Where.
        edge: Edge,
    },
}

impl Action {
    /// How late it may come. A command to stand is never too late.
    pub const fn latest(self) -> Duration {
        match self {
            Self::Drive { wheels, .. } if wheels.is_stop() => Duration::MAX,
            Self::Drive { .. }
            | Self::Arm(_)
            | Self::Resume { .. }
            | Self::Mode(_)
            | Self::Picked { .. }
            | Self::Reset
            | Self::Place(_) => LATEST_MOVE,
            _ => LATEST,
        }
    }
}

/// What becomes of an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Put {
    /// It is put there.
    Put,
    /// It is taken away.
    Take,
}

impl Put {
    const fn as_str(self) -> &'static str {
        match self {
            Self::Put => "put",
            Self::Take => "take",
        }
    }
}

/// How long a command to the wheels holds, in ms: 1 to 1000.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LeaseMs(u16);

impl LeaseMs {
    /// The longest, in ms.
    pub const MAX: u16 = 1000;

    /// A lease of `ms`, if it is from 1 to [`LeaseMs::MAX`].
    pub const fn new(ms: u16) -> Option<Self> {
        if ms == 0 || ms > Self::MAX {
            return None;
        }
        Some(Self(ms))
    }

    /// The time in ms.
    pub const fn get(self) -> u16 {
        self.0
    }
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

pub(super) fn number(reader: &mut Reader<'_>) -> Result<u32, Misread> {
    let wanted = "a number from 0 to 4294967295";
    reader.word().number(wanted, 0, i64::from(u32::MAX))
}

fn read_action(mut reader: Reader<'_>) -> Result<Action, Fault> {
    let word = reader.word();
    let action = match word.text {
        "order" => Action::Add {
            order: number(&mut reader)?,
            product: ProductId::from_word(reader.word())?,
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
        "mode" => Action::Mode(reader.word().read(Mode::WANTED, Mode::from_word)?),
        "resume" => Action::Resume {
            stop: reader
                .word()
                .read("the number of the stop, as the state tells it", u64::of)?,
        },
        "reset" => Action::Reset,
        "place" => Action::Place(Edge::read(&mut reader)?),
        "picked" => Action::Picked {
            force: reader
                .word()
                .read("force or the end of the line", |word| match word {
                    "" => Some(false),
                    "force" => Some(true),
                    _ => None,
                })?,
        },
        "pick" => Action::Pick(reader.word().read(Pick::WANTED, Pick::from_word)?),
        "drive" => Action::Drive {
            wheels: read_command(reader.word(), read_wheels)?,
            lease: LeaseMs(reader.word().number("a time from 1 to 1000 ms", 1, 1000)?),
        },
        "arm" => Action::Arm(read_command(reader.word(), read_arm)?),
        "gains" => Action::Gains {
            p: reader.word().number("a gain from 0 to 255", 0, 255)?,
            d: reader.word().number("a gain from 0 to 255", 0, 255)?,
        },
        "calibrate" => Action::Calibrate,
        "obstacle" => Action::Obstacle {
            put: reader.word().read("put or take", |word| {
                [Put::Put, Put::Take]
                    .into_iter()
                    .find(|put| put.as_str() == word)
            })?,
            edge: Edge::read(&mut reader)?,
        },
        _ => {
            let wanted = "one of order, cancel, first, up, clear, mode, resume, reset, place, \
                          picked, pick, drive, arm, gains, calibrate and obstacle";
            return Err(word.misread(wanted).into());
        }
    };
    reader.end()?;
    Ok(action)
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
            } => write!(formatter, "do {number} {action}"),
            Self::Do {
                number,
                late_ms,
                action,
            } => write!(formatter, "do {number} late {late_ms} {action}"),
        }
    }
}

impl fmt::Display for Action {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Add { order, product } => write!(formatter, "order {order} {product}"),
            Self::Cancel { order } => write!(formatter, "cancel {order}"),
            Self::First { order } => write!(formatter, "first {order}"),
            Self::Up { order } => write!(formatter, "up {order}"),
            Self::Clear => formatter.write_str("clear"),
            Self::Mode(mode) => write!(formatter, "mode {}", mode.as_str()),
            Self::Resume { stop } => write!(formatter, "resume {stop}"),
            Self::Reset => formatter.write_str("reset"),
            Self::Place(on) => write!(formatter, "place {on}"),
            Self::Picked { force: false } => formatter.write_str("picked"),
            Self::Picked { force: true } => formatter.write_str("picked force"),
            Self::Pick(pick) => write!(formatter, "pick {}", pick.as_str()),
            Self::Drive { wheels, lease } => write!(formatter, "drive {wheels} {}", lease.get()),
            Self::Arm(step) => write!(formatter, "arm {}", Code(OperatorCommand::Arm(*step))),
            Self::Gains { p, d } => write!(formatter, "gains {p} {d}"),
            Self::Calibrate => formatter.write_str("calibrate"),
            Self::Obstacle { put, edge } => write!(formatter, "obstacle {} {edge}", put.as_str()),
        }
    }
}
