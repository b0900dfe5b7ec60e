//! What the boards are wired to: warehouse, tape, sensors, motors, servos.
//!
//! It is apart from the simulator, because an emulator that runs the real firmware images is wired
//! to the very same world. [`World`] puts the parts together; each part has its own module and can
//! be used alone.
//!
//! Everything here is pure: time is advanced by the caller, noise comes from a seed, nothing
//! reads a clock or does I/O. Nothing here knows packets, topics or decisions of the boards.
//!
//! Coordinates are millimetres with node (0, 0) at the origin, x to the right and y up
//! (AMB-36); headings are radians, counter-clockwise from +x.
//!
//! ```text
//!  duty --> motors --> body --> pose --+--> line sensor --> ADC
//!             ^ battery     ^ contact   |
//!                                      +--> IR ranger ----> ADC
//!  bytes <-> servos --> arm ---------- + --> goods
//! ```
#![forbid(unsafe_code)]

pub mod arm;
pub mod battery;
pub mod body;
mod builtin;
pub mod contact;
mod exit;
pub mod goods;
pub mod ir;
pub mod line;
pub mod make;
pub mod motor;
pub mod noise;
mod obstacles;
pub mod room;
pub mod scene;
pub mod servo;
pub mod tape;
mod validate;
pub mod warehouse;
pub mod weave;
mod world;

pub use body::Pose;
pub use goods::{Good, GoodState};
pub use make::Make;
pub use obstacles::{HandsOff, MOST_OBSTACLES, Standing};
pub use servo::ServoFault;
pub use validate::WarehouseError;
pub use warehouse::{Curve, Edge, Exit, Floor, Obstacle, Product, Side, Warehouse};
pub use world::{World, WorldState};
