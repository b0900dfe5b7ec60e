//! What a sample on the bus consists of, and how an application declares its topics.
//!
//! This crate knows no robot, opens no bus and reads no clock. A program that only shows recordings
//! uses it without the transport.
//!
//! * [`payload!`] makes a payload: a struct that processes share in memory as it is.
//! * [`coded!`] makes an enum that a payload carries as a [`Tag`].
//! * [`Stamp`] is the header in front of every payload: who published it, when, and why.
//! * [`Topic`] and [`Request`] declare a topic and a request as types. [`Qos`] says how a topic
//!   behaves, and [`Part`] names a process that reads it.
//! * [`schema`] turns a layout into a hash, so that a process with another layout is refused.
//! * [`Description`] is a layout as text, for tools that were built without the payload's type.
//!
//! **Invariant:** every bit pattern of every payload is a valid value. Enums travel as [`Tag`], so
//! a foreign or broken writer cannot cause undefined behaviour in a reader.

mod description;
#[doc(hidden)]
pub mod hash;
pub mod list;
mod part;
pub mod schema;
mod stamp;
mod tag;
mod topic;

/// Names that the macros of this crate use in other crates.
#[doc(hidden)]
pub mod private {
    pub use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
    pub use serde;
}

// The derives in `payload!` name this crate as other crates do.
extern crate self as lager_sample;

pub use description::{Described, Description, DescriptionError, NoField, describe};
pub use part::Part;
pub use schema::{Field, FieldInfo, Make, Payload, Schema, StructInfo, bytes_of, from_bytes};
pub use stamp::Stamp;
pub use tag::{Coded, Tag};
pub use topic::{Application, LARGEST_COPY, Qos, Request, Topic, TopicEntry, id};
