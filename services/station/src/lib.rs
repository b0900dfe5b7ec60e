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
//! - [`Robot`]: the conversation with one robot. It is a pure state machine: lines and a person's
//!   wishes in, lines out.
//! - [`Station`]: all robots by their names, and the GaG that speaks for one of them; pure, too.
//! - [`load`] and [`save`]: the warehouse, in a file that is saved atomically.
//! - [`Queues`]: the products that each robot will fetch, in a file beside the warehouse's.
//! - [`History`]: the last day of robots' states and events, in a folder beside the warehouse's file.
//! - [`files`]: reads, replaces and locks files that a person has named.
//! - [`Server`]: the sockets, in one thread that waits for all of them.
//! - [`Handle`]: the station for other threads. They see the last state of each robot with its
//!   time, subscribe to news ([`Subscription`]), give actions and wait for the answer
//!   ([`Awaited`]), and drive a robot ([`Driver`], one for each).
//!
//! The station never joins a robot's bus. It knows only what robots have told it, and keeps its
//! state in files. `lager up` opens the socket and hands it to each station that it starts, so the
//! port stays open when a station ends. A GaG must read the station's lines. If it does not, the
//! robot that it drives stands within half a second.

mod asked;
mod awaited;
mod config;
mod connection;
pub mod files;
mod gate;
mod given;
mod handle;
mod history;
mod keeper;
mod queues;
mod refused;
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
pub use history::{Entry, History};
pub use queues::Queues;
pub use robot::{ActRefused, CommandRefused, Doing, FetchRefused, Robot};
pub use server::Server;
pub use shown::{Dated, LastTold, Reply, Saying, Shown};
pub use station::{Output, Peer, RobotSaid, Station, Uses, Wish, WishRefused};
pub use warehouse::{LoadError, SaveError, find, load, save, told};
pub use wheel::Key;
