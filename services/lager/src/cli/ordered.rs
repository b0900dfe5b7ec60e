//! The subcommands with which a person orders something of the robot. A plain one is an action with
//! its words; `steer/ordered.rs` makes the actions of the others. Those that change a list show it if
//! there is nothing to change.

use clap::Subcommand;
use lager_floor::Place;
use lager_lines::Called;
use lager_orders::{Action, Mode, Pick};
use lager_wire::OperatorCommand;

use super::values;

/// What a person orders.
#[derive(Debug, Subcommand)]
pub enum Ordered {
    #[command(flatten)]
    Plain(Plain),
    /// Order the robot to fetch and deliver goods
    #[command(after_help = "Examples:
  lager fetch 3               the product with this number
  lager fetch screws          the one with this name; `lager map` shows both")]
    Fetch {
        /// The number of the goods, or their name in the warehouse's file
        #[arg(allow_negative_numbers = true, value_parser = values::product)]
        product: Called,
    },
    /// Cancel an order, as `queue cancel` does
    #[command(after_help = "Examples:
  lager queue                 the orders with their numbers
  lager cancel 4711           fetch order 4711 no more")]
    Cancel {
        /// The order's number
        #[arg(value_name = "ORDER", allow_negative_numbers = true, value_parser = values::order)]
        id: u32,
    },
    /// Show the warehouse, its goods and the blocked ways, or say that goods are back
    #[command(after_help = "Examples:
  lager map                   the floor, where all goods stand, and what is in the way
  lager map back 3            goods 3, which were delivered, are in their place again
  lager map back              so are all goods

The robot remembers which goods it has delivered or has not found in their place, and refuses to
fetch them until they are back.")]
    Map {
        /// What to change [default: nothing, only show it]
        #[command(subcommand)]
        change: Option<MapChange>,
    },
    /// Show the orders, or add, cancel or move one
    #[command(after_help = "Examples:
  lager queue                 the orders with their numbers, the next one first
  lager queue add 3           fetch goods 3 after all the others, once the robot is autonomous
  lager queue up 4711         carry order 4711 out before the one that stands before it
  lager queue cancel 4711     take it back

You can cancel the order that is under way until the robot holds its goods. The robot then begins the
next order, or goes home.")]
    Queue {
        /// What to change [default: nothing, only show them]
        #[command(subcommand)]
        change: Option<QueueChange>,
    },
    /// Press a button of the robot: `reset` does what `lager reset` does, `switch` changes the mode
    Press {
        /// Which button
        button: Button,
    },
    /// Show the things on the ways of the simulated floor, put one there, or take one away
    #[command(after_help = "Examples:
  lager obstacle                  what stands where
  lager obstacle put 1,0,right    a thing on the way from crossing 1,0 to 2,0
  lager obstacle take 2,0,left    the same one is gone

What stands there outlives a restart of the simulator.")]
    Obstacle {
        /// What to change [default: nothing, only show them]
        #[command(subcommand)]
        change: Option<ObstacleChange>,
    },
    /// Put a simulated robot on a crossing, or tell logic where you have put a real one
    #[command(after_help = "Examples:
  lager place                 a simulated robot, on the delivery node, looking into the warehouse
  lager place 2,1,up          on column 2, row 1, looking towards greater rows

The robot must stand: take the manual mode, or stop it. `lager reset` is the reset button of a
real robot that has been put on the delivery node.")]
    Place {
        /// Column, row and heading (left, up, right, down) [default: the delivery node of a
        /// simulated robot]
        #[arg(value_name = "X,Y,HEADING", allow_hyphen_values = true)]
        place: Option<Place>,
    },
    /// Move the arm one step
    #[command(
        after_help = "COMMAND is a name (clockwise, counter-clockwise, in, out, up, down, left, right, squeeze, release) or a code 0xF1..0xFA as 8 binary digits, decimal or 0x-hex."
    )]
    Arm {
        /// Name or code of the command
        #[arg(allow_negative_numbers = true, value_parser = values::arm_command)]
        command: OperatorCommand,
    },
}

/// What a person orders in words that are all of the action.
#[derive(Debug, Subcommand)]
pub enum Plain {
    /// Choose who steers: a person or logic
    Mode {
        /// The mode
        #[arg(value_parser = values::mode())]
        mode: Mode,
    },
    /// Tell the robot that you have picked the goods up
    Picked {
        /// The robot believes it even if the claw feels nothing or the arm is not in its carry pose
        #[arg(long)]
        force: bool,
    },
    /// Choose who picks the next goods up: a person (`lager picked`) or the robot
    Pick {
        /// Who picks the goods up
        #[arg(value_parser = values::pick())]
        by: Pick,
    },
    /// Say that you have put the robot on the delivery node, looking into the warehouse
    Reset,
    /// Sound the robot's horn; it appears as a thought
    Horn,
    /// Set the gains of the line following (PD)
    Gains {
        /// Proportional gain, 2 unless set
        #[arg(allow_negative_numbers = true, value_parser = values::gain)]
        p: u8,
        /// Derivative gain over 10 ms, 2 unless set
        #[arg(allow_negative_numbers = true, value_parser = values::gain)]
        d: u8,
    },
    /// Calibrate the line sensors: move the robot over tape and floor by hand for five seconds
    Calibrate,
}

impl Plain {
    /// The action.
    pub const fn action(&self) -> Action {
        match *self {
            Self::Mode { mode } => Action::Mode(mode),
            Self::Picked { force } => Action::Picked { force },
            Self::Pick { by } => Action::Pick(by),
            Self::Reset => Action::Reset,
            Self::Horn => Action::Horn,
            Self::Gains { p, d } => Action::Gains { p, d },
            Self::Calibrate => Action::Calibrate,
        }
    }

    /// What the command says when the robot shows the effect.
    pub fn done(&self) -> String {
        match self {
            Self::Mode { mode: Mode::Manual } => "the operator steers",
            Self::Mode {
                mode: Mode::Autonomous,
            } => "logic steers",
            Self::Picked { .. } => "the robot takes the goods to delivery",
            Self::Pick { by: Pick::Manual } => "a person picks the goods up",
            Self::Pick { by: Pick::Auto } => "the robot picks the goods up by itself",
            Self::Reset => "the robot now counts as standing on the delivery node",
            Self::Horn => "the robot sounds its horn",
            Self::Gains { p, d } => return format!("the gains in force are {p} and {d}"),
            Self::Calibrate => {
                "the line sensors are calibrated: each of them has seen both floor and tape"
            }
        }
        .into()
    }
}

/// A button of the robot.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Button {
    /// You have put the robot on the delivery node, looking into the warehouse
    Reset,
    /// Change who steers: a person or logic
    Switch,
}

/// What a person does to a way of the simulated floor.
#[derive(Debug, Subcommand)]
pub enum ObstacleChange {
    /// Put a thing on a way where the robot is not
    Put {
        /// The way: a crossing, and the direction from it (up, down, left or right)
        #[arg(value_name = "X,Y,SIDE")]
        way: Place,
    },
    /// Take away the thing on a way
    Take {
        /// The way: a crossing, and the direction from it (up, down, left or right)
        #[arg(value_name = "X,Y,SIDE")]
        way: Place,
    },
}

/// What a person says about goods.
#[derive(Debug, Subcommand)]
pub enum MapChange {
    /// Say that goods are in their place again
    Back {
        /// The number of the goods, or their name in the warehouse's file [default: all goods]
        #[arg(allow_negative_numbers = true, value_parser = values::product)]
        product: Option<Called>,
    },
}

/// What a person changes about the waiting orders.
#[derive(Debug, Subcommand)]
pub enum QueueChange {
    /// Add an order for goods at the end
    Add {
        /// The number of the goods, or their name in the warehouse's file
        #[arg(allow_negative_numbers = true, value_parser = values::product)]
        product: Called,
    },
    /// Cancel an order; if it is under way, only before the robot holds its goods
    Cancel {
        /// The order's number
        #[arg(value_name = "ORDER", allow_negative_numbers = true, value_parser = values::order)]
        id: u32,
    },
    /// Move a waiting order one place up
    Up {
        /// The order's number
        #[arg(value_name = "ORDER", allow_negative_numbers = true, value_parser = values::order)]
        id: u32,
    },
    /// Cancel all waiting orders
    Clear,
}
