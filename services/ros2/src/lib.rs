//! The robot as a node of ROS 2: what the bus carries, in ROS's own messages, and services.
//!
//! ```text
//!   bus ──> reading ──> parts, motion, floor, health ──> node ──> DDS ──> programs of ROS 2
//!                        pure: samples in, messages out      │
//!   lager stop, resume, fetch <── services <─────────────────┘  requests
//! ```
//!
//! - [`messages`]: ROS's messages and the hashes of their types.
//! - [`told`]: frames, measures and ROS time.
//! - [`parts`], [`motion`], [`floor`], [`health`]: what becomes of each topic.
//! - [`node`]: the node on DDS, with ros2-client's words and RustDDS's endpoints.
//! - [`place`]: domain and range.
//! - [`services`]: requests, which go the way of an operator.
//! - [`reading`]: the loop that reads the bus and answers.
//!
//! It is a program of its own, so that the robot's own build has no DDS in it, and so that what reads
//! packets of strangers cannot write to the bus: it opens no publisher there. Whoever asks for a
//! service has `lager` itself asked, in another process ([`services`]).

#![forbid(unsafe_code)]

pub mod floor;
pub mod health;
pub mod messages;
pub mod motion;
pub mod node;
pub mod parts;
pub mod place;
pub mod reading;
pub mod services;
pub mod told;
