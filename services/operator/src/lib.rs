//! Give an order, repeat it, wait for its effect: one state machine for every program that sends
//! orders to a robot over the bus. The communication unit uses it for the external computer, the
//! command line for the person who types, and `up` for its mission.
//!
//! - [`Orders`]: orders that are given once and are done when the robot shows their effect.
//! - [`Driving`]: the one command to wheels or arm, which is renewed while it holds.
//! - [`Wanted`]: one order that is repeated until the caller does not want it any more.
//! - [`Seen`]: the known state of the robot, and the orders that it allows.
//!
//! Samples and time go in. Samples to publish come out, and how each order has ended. This crate
//! opens no port and reads no clock.
//!
//! # Where orders of products wait
//!
//! | where | why there |
//! |---|---|
//! | the station | a robot may be away or replaced; each gets one product when it asks |
//! | here | until logic shows the order: logic may end and lose the sample |
//! | logic | only logic knows which ways are open, so only it puts orders off and in order |
//! | `up` | a mission outlives logic's process and may exceed logic's queue |

#![forbid(unsafe_code)]

mod driving;
mod ids;
mod orders;
mod seen;
mod wanted;

pub use driving::{Driving, Finished, For};
pub use ids::Ids;
pub use orders::{Act, Begun, Ended, Orders};
pub use seen::Seen;
pub use wanted::Wanted;
