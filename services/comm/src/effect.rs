//! The effects of the conversation.

use lager_lines::conversation::RobotLine;
use lager_lines::extension::Report;
use lager_operator::Act;
use lager_orders::{Commission, Reason};
use lager_topics::{SteeringOrder, WarehouseMap};

/// Something to do, in the order of the decisions.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Say a line to the peer.
    Say(RobotLine),
    /// Tell the peer a state, after all other lines. If the peer has not read the last state of
    /// this kind yet, this one replaces it.
    Show(Report),
    /// Close the connection; the link makes another one.
    HangUp(Reason),
    /// Publish the warehouse.
    Map(Box<WarehouseMap>),
    /// Do this on the bus for an operator, without waiting for an answer.
    Do(Act),
    /// Give or renew a steering order.
    Steer(SteeringOrder),
    /// Stop the robot by its stop word.
    Stop,
    /// Tell this to the commissioning of the robot, or begin one.
    Commission {
        /// When it was given, in ns of `CLOCK_MONOTONIC`.
        given_ns: u64,
        /// What a person says.
        said: Commission,
    },
}
