//! What the conversation wants done.

use lager_lines::conversation::RobotLine;
use lager_lines::extension::Report;
use lager_topics::{Ask, Input, Order, SteeringOrder, WarehouseMap, WorldAsk};

/// What is to be done, in the order in which it was decided.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Say a line to the peer.
    Say(RobotLine),
    /// Tell the peer how things are, after what is to be said. If it has not taken the last report
    /// of this kind yet, this one takes its place.
    Show(Report),
    /// Give the connection up; another one is made.
    HangUp(&'static str),
    /// Publish the warehouse.
    Map(Box<WarehouseMap>),
    /// Order a product.
    Order(Order),
    /// Press a button.
    Press(Input),
    /// Give or renew a steering order.
    Steer(SteeringOrder),
    /// Ask the bridge, without waiting for its answer.
    Ask {
        /// What the answer is handed back with.
        id: u32,
        /// What is asked.
        ask: Ask,
    },
    /// Ask whoever simulates the world, likewise.
    AskWorld {
        /// What the answer is handed back with.
        id: u32,
        /// What is asked.
        ask: WorldAsk,
    },
    /// Stop the robot by its stop word.
    Stop,
}
