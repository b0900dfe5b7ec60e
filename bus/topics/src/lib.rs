//! Every topic of the bus in one table, with the layout of its samples.
//!
//! It is apart from `lager-ports`, so that a tool that only reads recordings can use the layouts
//! without the transport. This crate never opens the bus and never reads a clock; it only names,
//! converts and describes data.
//!
//! * [`table`] lists the topics: name, payload, quality of service, actors.
//! * [`payloads`] holds the sample layouts, one file per family of topics.
//! * [`schema`] turns a layout into a hash, so that a changed one is refused.
//! * [`Description`] is that layout as text, for tools that were built without it.
//! * [`Stamp`] is the header in front of every sample.
//!
//! **Invariant:** every bit pattern of every payload is a valid value. Enums travel as
//! [`Tag`], so a foreign or broken writer cannot cause undefined behaviour in a reader.

mod description;
#[doc(hidden)]
pub mod hash;
pub mod list;
pub mod payloads;
mod role;
pub mod schema;
mod stamp;
pub mod table;
mod tag;

/// What the macros of this crate name in the crates that use them.
#[doc(hidden)]
pub mod private {
    pub use iceoryx2::prelude::ZeroCopySend;
    pub use serde;
}

// The derives in `payload!` name this crate as its users do.
extern crate self as lager_topics;

pub use description::{Described, Description, DescriptionError, NoField, describe};
pub use payloads::*;
pub use role::{Role, UnknownRole};
pub use schema::{Field, FieldInfo, Make, Payload, Schema, StructInfo, bytes_of};
pub use stamp::Stamp;
pub use table::{
    BridgeRequest, LARGEST_COPY, LatencyCommand, LatencyPath, LinkHealth, LogThought, MissionEvent,
    MissionOrder, MissionQueue, NavBlocks, NavInputs, NavMap, NavRoute, NavStatus, OBSERVERS,
    OperatorInput, Qos, Request, SERVICE_SLOTS, SensorDistance, SensorLine, SteeringCommand,
    SteeringState, TOPICS, Topic, TopicEntry, TopicVisitor, TruthPose, UnknownTopic, WorldRequest,
    by_id, id, visit,
};
pub use tag::{Coded, Tag};
