//! The robot's topics in one table, with the layout of their samples and the robot's roles.
//!
//! It is apart from `lager-ports`, so that a tool that only reads recordings can use the layouts
//! without the transport. This crate never opens the bus and never reads a clock. `lager-sample`
//! explains what a sample is; this crate defines the samples of this robot.
//!
//! * [`table`] lists the topics: name, payload, quality of service, and who is woken.
//! * [`payloads`] holds the sample layouts, one file per family of topics.
//! * [`Role`] lists the parts that the robot's processes play.

pub mod payloads;
mod role;
pub mod table;

pub use payloads::*;
pub use role::{Role, UnknownRole, called};
pub use table::{
    BridgeRequest, LAGER, LatencyCommand, LatencyPath, LinkHealth, LogThought, MissionEvent,
    MissionOrder, MissionQueue, NavBlocks, NavInputs, NavMap, NavRoute, NavStatus, OperatorInput,
    SensorDistance, SensorLine, SteeringCommand, SteeringState, TOPICS, TopicVisitor, TruthPose,
    UnknownTopic, WorldRequest, by_id, visit,
};
