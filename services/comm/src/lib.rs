//! The communication unit (C1-C9): the robot's side of the conversation with the external computer,
//! and the only service of the robot that takes orders from the network.
//!
//! - [`Conversation`]: which questions comm asks, what it does with answers and actions, and what
//!   it tells. It is a pure state machine over lines and samples.
//! - [`run`]: its shell between a socket and the bus.
//! - [`Commissioner`]: the program that it starts when a person sets the robot up.
//! - [`secrets_at`]: the file with the secret by which robot and station recognise each other.
//!
//! It has no more rights than a person at the robot: it orders, presses and steers as an operator,
//! and the bridge's arbiter judges it as one. To go on after a kill it needs only one state of its
//! own, the map, and publishes that on the bus. The other services publish what the robot is doing.

#![forbid(unsafe_code)]

mod asking;
mod commissioner;
mod conversation;
mod effect;
mod health;
mod known;
mod link;
mod lives;
mod lost;
mod map;
mod memory;
mod pose;
mod proving;
mod secret;
mod shell;
mod speech;
mod telling;

pub use commissioner::Commissioner;
pub use conversation::Conversation;
pub use effect::Effect;
pub use known::{Machine, Senses};
pub use lost::LinkLost;
pub use secret::{SecretsError, secrets_at};
pub use shell::{CommConfig, run};
