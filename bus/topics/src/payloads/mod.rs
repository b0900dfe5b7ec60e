//! The sample layouts, one file per family of topics.

mod latency;
mod link;
mod log;
mod mission;
mod nav;
mod request;
mod sensor;
mod steering;
mod truth;

pub use latency::{PathLatency, StageLatency};
pub use link::{BoardHealth, Health, Mode};
pub use log::Thought;
pub use mission::{Event, EventKind, Input, InputKind, Order};
pub use nav::{
    Goal, Heading, MapProduct, NavigatorStatus, Phase, Route, RouteNode, Side, Step, WarehouseMap,
};
pub use request::{Answer, Ask, AskKind, Outcome};
pub use sensor::{DistanceFrame, LineFrame};
pub use steering::{Finish, OrderKind, Origin, SteeringOrder, SteeringReport};
pub use truth::{GoodState, Truth, TruthGood};

/// Position of a servo that has not been heard yet; real ones are 0..=1023 (AX-12).
pub const SERVO_UNKNOWN: u16 = 0xFFFF;
