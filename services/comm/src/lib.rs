//! The communication unit (C1-C9): the robot's side of the conversation with the external computer,
//! and the only service of the robot with a socket to the network.
//!
//! - [`Conversation`]: what is asked, what is made of the answers and of a station's actions, and
//!   what is told; a pure state machine over lines and samples.
//! - [`run`]: its shell between a socket and the bus.
//! - [`secrets_at`]: the file by whose secret the robot and its station prove who they are.
//!
//! It has no right that a person at the robot would not have: it orders, presses and steers as an
//! operator, and the bridge's arbiter judges it as one. Of the state that it needs to go on after a
//! kill, only the map is its own, and that is published on the bus; the other services publish what
//! the robot is doing.

#![forbid(unsafe_code)]

mod action;
mod asking;
mod conversation;
mod driving;
mod ids;
mod known;
mod link;
mod lost;
mod map;
mod memory;
mod moment;
mod pose;
mod proving;
mod secret;
mod shell;
mod speech;
mod tasks;
mod telling;

pub use action::Action;
pub use conversation::Conversation;
pub use known::Senses;
pub use lost::LinkLost;
pub use moment::Moment;
pub use secret::{SecretsError, secrets_at};
pub use shell::{CommConfig, run};
