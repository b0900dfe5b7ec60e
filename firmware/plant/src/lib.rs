//! The world that the boards are wired to: warehouse, tape, sensors, motors, servos, goods.
//!
//! It is a crate of its own because the simulator and the emulator of the real images both use it.
//! [`World`] puts the parts together; each part has its own module and can be used alone.
//!
//! Everything here is pure: the caller advances time, noise comes from a seed, and nothing reads a
//! clock or does I/O. Nothing here knows packets, topics or the boards' decisions.
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
mod build;
mod builtin;
mod by_hand;
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
pub use build::{ArmBuild, Build, ButtonsBuild, ContactBuild, Ranger};
pub use by_hand::{Hand, Report};
pub use goods::{Good, GoodState};
pub use make::Make;
pub use obstacles::{HandsOff, MOST_OBSTACLES, Standing};
pub use servo::ServoFault;
pub use validate::WarehouseError;
pub use warehouse::{Curve, Exit, Floor, NamedProduct, Obstacle, Warehouse};
pub use world::{Snapshot, World, WorldState};
