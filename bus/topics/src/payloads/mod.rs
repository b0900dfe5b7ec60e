//! The sample layouts, one file per family of topics.

mod action;
mod failure;
mod inputs;
mod latency;
mod link;
mod log;
mod map;
mod mission;
mod nav;
mod pose;
mod request;
mod said;
mod sensor;
mod steering;
mod stop;
mod truth;

pub use action::{Input, InputKind};
pub use failure::{Failure, FailureKind, Remedy};
pub use inputs::{Beside, NavigatorInput, NavigatorInputKind, NavigatorInputs, Sent, TextKind};
pub use lager_orders::{EventKind, Levels};
pub use latency::{CommandLatency, Durations, PathLatency};
pub use link::{BoardHealth, CalibratedSensor, Calibration, Health, Misfit, ProfileState};
pub use log::{Joint, Thought, ThoughtKind};
pub use map::{MapProduct, WarehouseMap};
pub use mission::{Event, GoneGoods, GoneWhy, NotWaiting, Order, OrderQueue, WaitingOrder};
pub use nav::{
    BlockSource, BlockedWay, BlockedWays, Goal, Hold, NavigatorStatus, Phase, Route, RouteNode,
    Step,
};
pub use pose::Pose;
pub use request::{
    Ask, AskKind, BridgeAnswer, ButtonLines, Outcome, Part, WorldAnswer, WorldAsk, WorldAskKind,
    WorldRefusal,
};
pub use said::word;
pub use sensor::{DistanceFrame, LineFrame};
pub use steering::{Finish, Origin, Refusal, SteeringOrder, SteeringReport};
pub use stop::StopCause;
pub use truth::{GoodState, Truth, TruthGood, TruthObstacle};

/// Position of a servo that has not been heard yet; real ones are 0..=1023 (AX-12).
pub const SERVO_UNKNOWN: u16 = 0xFFFF;
