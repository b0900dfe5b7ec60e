//! The navigator's inputs: each sample of a topic as it came, or the passing of time.

use lager_orders::Mode;
use lager_topics::{Order, SteeringReport, WarehouseMap};
use lager_wire::LineState;

/// An input of the navigator.
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// A line frame has come.
    Line(LineState),
    /// A distance frame has come: cm to what is in front, 255 = nothing seen.
    Distance(u8),
    /// The steering board has reported.
    Steering(&'a SteeringReport),
    /// The warehouse has become known, or has changed.
    Map(&'a WarehouseMap),
    /// An order to fetch a product.
    Order(&'a Order),
    /// A person at the robot or at the station has done something.
    Operator(&'a lager_topics::Input),
    /// The bridge's sum of the wheels' turning in manual mode: duty × µs of both motors.
    DrivenByHand(u64),
    /// Who may drive, and whether a stop is latched, as the bridge reports it.
    Mode {
        /// Who may drive.
        mode: Mode,
        /// A stop is latched.
        stopped: bool,
    },
    /// Time has passed, without a sample.
    Tick,
}
