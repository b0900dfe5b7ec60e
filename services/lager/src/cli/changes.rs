//! What a person changes: things on the simulated floor, and orders that wait.

use clap::Subcommand;
use lager_lines::Called;

use super::values;
use crate::steer::Place;

/// What a person does to a way of the simulated floor.
#[derive(Debug, Subcommand)]
pub enum ObstacleChange {
    /// Put a thing on a way, where the robot is not
    Put {
        /// A crossing, and up, down, left or right from it
        #[arg(value_name = "X,Y,SIDE")]
        way: Place,
    },
    /// Take the thing on a way away
    Take {
        /// A crossing, and up, down, left or right from it
        #[arg(value_name = "X,Y,SIDE")]
        way: Place,
    },
}

/// What a person says of the goods.
#[derive(Debug, Subcommand)]
pub enum MapChange {
    /// Say that goods are in their place again
    Back {
        /// The product's number, or its name in the warehouse's file [default: all goods]
        #[arg(allow_negative_numbers = true, value_parser = values::product)]
        product: Option<Called>,
    },
}

/// What a person changes about the orders that wait.
#[derive(Debug, Subcommand)]
pub enum QueueChange {
    /// Add an order for a product at the end
    Add {
        /// The product's number, or its name in the warehouse's file
        #[arg(allow_negative_numbers = true, value_parser = values::product)]
        product: Called,
    },
    /// Take an order back; the one under way as long as its goods are not held
    Cancel {
        /// The order's number
        #[arg(value_name = "ORDER", allow_negative_numbers = true, value_parser = values::order)]
        id: u32,
    },
    /// Let a waiting order change places with the one before it
    Up {
        /// The order's number
        #[arg(value_name = "ORDER", allow_negative_numbers = true, value_parser = values::order)]
        id: u32,
    },
    /// Take all waiting orders back
    Clear,
}
