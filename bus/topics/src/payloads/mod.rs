//! The sample layouts, one file per family of topics.

mod failure;
mod latency;
mod link;
mod log;
mod mission;
mod nav;
mod pose;
mod request;
mod sensor;
mod steering;
mod stop;
mod told;
mod truth;

pub use failure::{Failure, FailureKind, Remedy};
pub use latency::{CommandLatency, Durations, PathLatency};
pub use link::{ArmProfileState, BoardHealth, CalibratedSensor, Calibration, Health, Mode};
pub use log::{Joint, Thought, ThoughtKind};
pub use mission::{
    Event, EventKind, GoneGoods, GoneWhy, Input, InputKind, Order, OrderQueue, WaitingOrder,
};
pub use nav::{
    BlockSource, BlockedWay, BlockedWays, Goal, Heading, Hold, MapProduct, NavigatorStatus, Phase,
    Pick, Route, RouteNode, Side, Step, WarehouseMap,
};
pub use pose::Pose;
pub use request::{
    Answer, Ask, AskKind, Outcome, WorldAnswer, WorldAsk, WorldAskKind, WorldRefusal,
};
pub use sensor::{DistanceFrame, LineFrame};
pub use steering::{Finish, Origin, Refusal, SteeringOrder, SteeringReport};
pub use stop::StopCause;
pub use told::{Sent, TextKind, Told, ToldInputs, ToldKind};
pub use truth::{GoodState, Truth, TruthGood, TruthObstacle};

/// Position of a servo that has not been heard yet; real ones are 0..=1023 (AX-12).
pub const SERVO_UNKNOWN: u16 = 0xFFFF;
