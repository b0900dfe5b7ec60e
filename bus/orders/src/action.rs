//! [`Action`]: one thing that an operator asks of a robot. The text lines, the topics, the command
//! line and the page each write it in their own way.

use core::time::Duration;

use lager_floor::{Place, ProductId};
use lager_wire::{Callsign, OperatorArm, OperatorCommand, Speed};

use crate::commission::Commission;
use crate::lease::{LATEST, LATEST_MOVE};
use crate::mode::{Mode, Pick};

/// What an operator wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// `order`: fetch a product after the orders that wait (F3).
    Add {
        /// The number of the order, chosen by the station.
        order: u32,
        /// The product to fetch.
        product: ProductId,
    },
    /// `cancel`: do not carry out an order.
    Cancel {
        /// The order.
        order: u32,
    },
    /// `first`: carry out an order before the orders that wait.
    First {
        /// The order.
        order: u32,
    },
    /// `up`: carry out an order before the one that is now before it.
    Up {
        /// The order.
        order: u32,
    },
    /// `clear`: cancel all orders that wait.
    Clear,
    /// `back`: the goods of a product, or all goods, are in their places again.
    Back {
        /// The product; all products if it is `None`.
        product: Option<ProductId>,
    },
    /// `mode`: who drives.
    Mode(Mode),
    /// `resume`: end a stop, but no other stop that was set meanwhile.
    Resume {
        /// The stop, as the robot's state names it.
        stop: u64,
    },
    /// `reset`: the robot stands on the delivery corner and looks into the warehouse (B1).
    Reset,
    /// `place`: the robot stands on a crossing and looks along the grid; a simulated robot is put
    /// there.
    Place(Place),
    /// `picked`: the goods are in the gripper (L7).
    Picked {
        /// Whether to believe this even if the gripper does not feel them.
        force: bool,
    },
    /// `pick`: who picks the goods up from now on.
    Pick(Pick),
    /// `drive`: a command to the wheels (G8).
    Drive {
        /// The command.
        wheels: Wheels,
        /// How long it holds after the line has come, unless it is renewed.
        lease: LeaseMs,
    },
    /// `arm`: one step of the arm (G7).
    Arm(OperatorArm),
    /// `gains`: the gains of the line control (E10).
    Gains {
        /// Gain on the error, in the firmware's unit.
        p: u8,
        /// Gain on the change of the error, in the firmware's unit.
        d: u8,
    },
    /// `calibrate`: calibrate the line sensors, on the tape under the robot (E9).
    Calibrate,
    /// `restart`: restart a board, [`Callsign::Sensor`] or [`Callsign::Steering`]. The robot has to
    /// stand.
    Restart(Callsign),
    /// `horn`: sound the horn.
    Horn,
    /// `obstacle`: put an obstacle on an edge of a simulated world, or take it away (E6).
    Obstacle {
        /// Put or take away.
        put: Put,
        /// The edge: a node and the direction from it.
        way: Place,
    },
    /// `commission`: what a person says to the commissioning of the robot.
    Commission(Commission),
}

impl Action {
    /// Whether a state of the robot shows its effect. The horn is only heard, in a thought.
    pub const fn is_shown(self) -> bool {
        !matches!(self, Self::Horn)
    }

    /// How late it may come. A command to stand still is never too late.
    pub const fn latest(self) -> Duration {
        match self {
            Self::Drive { wheels, .. } if wheels.is_stop() => Duration::MAX,
            Self::Commission(said) if said.is_end() => Duration::MAX,
            Self::Commission(said) if said.may_move() => LATEST_MOVE,
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

/// What happens to an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Put {
    /// It is put there.
    Put,
    /// It is taken away.
    Take,
}

impl Put {
    /// The word.
    pub const fn as_str(self) -> &'static str {
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
    /// The longest lease, in ms.
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

/// An operator's command to the wheels, with a code from 1 to 9, and its speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Wheels(OperatorCommand);

impl Wheels {
    /// Whether it is the command to stand still.
    pub const fn is_stop(self) -> bool {
        matches!(self.0, OperatorCommand::Stop)
    }

    /// The command, unless it is for the arm.
    pub const fn new(command: OperatorCommand) -> Option<Self> {
        match command {
            OperatorCommand::Arm(_) => None,
            wheels => Some(Self(wheels)),
        }
    }

    /// The same command at a speed, if it has speeds.
    pub fn at(self, speed: Speed) -> Option<Self> {
        self.0.at(speed).map(Self)
    }
}

impl From<Wheels> for OperatorCommand {
    fn from(wheels: Wheels) -> Self {
        wheels.0
    }
}
