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
//! - [`files`]: how files that a person has named are read, replaced and held.
//! - [`Server`]: the sockets, in one thread that waits for all of them.
//! - [`Handle`]: what another thread sees of the station and does with it: the last that each robot
//!   has shown and when, a [`Subscription`] to events and thoughts, actions whose answer is
//!   [`Awaited`], and one [`Driver`] for each robot.
//!
//! It never joins a robot's bus. It knows only what robots have told it.

mod asked;
mod awaited;
mod config;
mod connection;
pub mod files;
mod gate;
mod given;
mod handle;
mod queues;
mod robot;
mod saver;
mod server;
mod shown;
mod station;
mod unread;
mod waiting;
mod warehouse;
mod wheel;

pub use awaited::{Awaited, Saving, Subscription};
pub use config::{Listen, ServerConfig, ServerError};
pub use given::Given;
pub use handle::{Driver, Handle, View};
pub use queues::Queues;
pub use robot::{ActRefused, CommandRefused, Doing, FetchRefused, Robot};
pub use server::Server;
pub use shown::{Reply, Seen, Shown, Told};
pub use station::{News, Output, Peer, Station, Uses, Wish, WishRefused};
pub use warehouse::{LoadError, SaveError, StoredProduct, Warehouse, WarehouseError, load, save};
pub use wheel::Key;
