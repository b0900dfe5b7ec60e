//! The external computer: it answers the robots and a GaG, and keeps the warehouse.
//!
//! ```text
//!   robots ── TCP ──┐                     ┌── unix socket ── somebody's GaG
//!                   └── Server ─ Station ─┘
//!                              ▲    │ Robot, Robot ...
//!                         Handle    └ Warehouse ── a file
//!              whoever shows robots and acts on them
//! ```
//!
//! - [`Robot`]: the conversation with one robot, a pure state machine: lines and a person's wishes
//!   in, lines out.
//! - [`Station`]: the robots by their names and the GaG that speaks for one of them, as pure.
//! - [`Warehouse`]: squares, delivery and goods, as they lie in a file that is saved atomically.
//! - [`Queues`]: what waits to be fetched by each robot, in a file beside it.
//! - [`Server`]: the sockets, in one thread that waits for all of them.
//! - [`Handle`]: through it another thread reads and changes the station.
//!
//! It never joins a robot's bus. It knows only what robots have told it.

#![forbid(unsafe_code)]

mod connection;
mod handle;
mod queues;
mod robot;
mod saver;
mod server;
mod station;
mod warehouse;

pub use handle::Handle;
pub use queues::Queues;
pub use robot::{CommandRefused, Doing, FetchRefused, Robot};
pub use server::{Listen, Server, ServerConfig, ServerError};
pub use station::{Output, Peer, Station, Wish, WishRefused};
pub use warehouse::{LoadError, SaveError, StoredProduct, Warehouse, WarehouseError, load, save};
