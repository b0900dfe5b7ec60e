//! Typed publishers and subscribers, waiting and requests over shared memory. Only this crate opens
//! iceoryx2.
//!
//! A process opens one [`Bus`] and makes its ports from it. A port stays in the thread that makes
//! it:
//!
//! ```no_run
//! use std::time::Duration;
//! use lager_wake::Policy;
//! use lager_ports::{Bus, BusConfig};
//! use lager_topics::LAGER;
//! use lager_topics::{MissionEvent, Role};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let bus = Bus::open(&BusConfig::of(&LAGER), Role::Comm)?;
//! let waiter = bus.waiter(Policy::Block)?;
//! let mut events = bus.subscriber::<MissionEvent>()?;
//! loop {
//!     // Samples from before the first ring are already there, so drain before waiting.
//!     while let Some(event) = events.receive()? {
//!         println!("number {}: {:?}", event.stamp().sequence, *event);
//!     }
//!     // A wake is only a hint. The time-out finds samples that arrived without a ring.
//!     waiter.wait(Duration::from_millis(20));
//! }
//! # }
//! ```
//!
//! Other programs can define payloads and topics of their own: `examples/` has programs that publish,
//! act, observe and watch. A process that creates a topic also states the layout of its samples, so
//! [`Bus::found`] reads a topic with which this process was not built.
//!
//! * Queues overwrite. A subscriber that falls behind loses the oldest samples and never blocks the
//!   publisher; [`Subscriber::lost`] says exactly how many samples it missed.
//! * The services that act on a topic (its actors) get each sample first, through an iceoryx2
//!   service of their own, and are woken through their [`Waiter`](lager_wake::Waiter). Everybody
//!   else (observers) then gets a copy with the same stamp. Observers poll, or ask to be woken after
//!   that ([`Watcher`]).
//! * A program of plain iceoryx2 reads the service under the topic's name. Samples that it writes
//!   there reach observers only. To reach the actors, it must also write to `<name>:actors`.
//! * The next [`Bus::open`] or [`Bus::sweep`] removes what a killed process left behind.
//!
//! **Invariant:** the public interface shows no type of iceoryx2. This crate knows no robot. After
//! start-up, sending and receiving allocate nothing.

mod any;
mod bus;
mod cause;
mod config;
mod error;
mod factory;
mod fault;
mod found;
mod here;
mod introspect;
mod keeper;
mod kept;
mod kind;
mod name;
mod patience;
mod place;
mod pooled;
mod publisher;
mod request;
mod schema;
mod service;
mod source;
mod storage;
mod streams;
mod subscriber;
mod sweep;
mod transport;
mod untyped;
mod watcher;

pub use any::AnyPublisher;
pub use bus::Bus;
pub use cause::Cause;
pub use config::BusConfig;
pub use error::{CallError, IntrospectError, OpenError, PortError, ReceiveError, SendError};
pub use fault::{Difference, TransportFault};
pub use found::{Found, FoundSample};
pub use introspect::{Layout, NodeInfo, NodeState, Peer, TopicInfo, nodes, remove_stale_nodes};
pub use keeper::{Keeper, KeeperError};
pub use kept::{KEPT_WAIT, KeptError};
pub use place::{Place, PlaceError, StampTime, Watched};
pub use publisher::{Loan, Publisher};
pub use request::{Client, Server};
pub use source::{Look, Raw, Source, newest};
pub use streams::Streams;
pub use subscriber::{Sample, Subscriber};
pub use watcher::Watcher;

/// The software that carries the bus. All processes on one bus must have the same version of it.
pub const BUS_VERSION: &str = "iceoryx2 0.10.0";
