//! Typed publishers and subscribers, waiting and requests over shared memory. Only this crate opens
//! iceoryx2.
//!
//! A process opens one [`Bus`] and makes its ports from it. A port stays in the thread that makes
//! it:
//!
//! ```no_run
//! use std::time::Duration;
//! use lager_ports::{Bus, BusConfig, Policy};
//! use lager_topics::{MissionEvent, Role};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let bus = Bus::open(&BusConfig::default(), Role::Comm)?;
//! let waiter = bus.waiter(Policy::Block)?;
//! let mut events = bus.subscriber::<MissionEvent>()?;
//! loop {
//!     // What came before this process could be rung is there already, so drain before waiting.
//!     while let Some(event) = events.receive()? {
//!         println!("number {}: {:?}", event.stamp().sequence, *event);
//!     }
//!     // A wake is a hint. The time-out finds samples that came without a ring.
//!     waiter.wait(Duration::from_millis(20));
//! }
//! # }
//! ```
//!
//! Programs of other people define payloads and topics of their own: `examples/` has one that
//! publishes, one that acts and one that observes. Whoever creates a topic puts the layout of its
//! samples beside it, so [`Bus::found`] reads a topic that this process was not built with.
//!
//! * Streams overwrite. A subscriber that falls behind loses the oldest samples and never blocks
//!   the publisher; [`Subscriber::lost`] says exactly how many samples it missed.
//! * A service that acts on a topic is served first, from a service of iceoryx2 of its own, and is
//!   woken through its [`Waiter`]. Everybody else then gets a copy with the same stamp. Observers
//!   are never woken; they poll.
//! * A program of plain iceoryx2 reads the service under the topic's name, where samples that it
//!   writes reach observers only. To be acted upon, it writes to `<name>:actors` too.
//! * What a killed process left behind is removed at the next [`Bus::open`] and by [`Bus::sweep`].
//!
//! **Invariant:** the public interface shows no type of iceoryx2. This crate decides nothing about
//! the robot. After start-up, sending and receiving allocate nothing.

mod any;
mod bus;
mod cause;
mod chance;
mod clock;
mod config;
mod descriptions;
mod doorbell;
mod error;
mod factory;
mod fault;
mod found;
mod here;
mod introspect;
mod inventory;
mod keeper;
mod kept;
mod kind;
mod lease;
mod life;
mod lock;
mod mend;
mod name;
mod pace;
mod patience;
mod place;
mod policy;
mod pooled;
mod presence;
mod publisher;
mod request;
mod schema;
mod service;
mod shortage;
mod shutdown;
mod source;
mod stop;
mod storage;
mod streams;
mod subscriber;
mod sweep;
mod transport;
mod untyped;
pub mod urgency;
mod waiter;
mod watch;
mod watchdog;

pub use any::AnyPublisher;
pub use bus::Bus;
pub use cause::Cause;
pub use chance::{Chance, ChanceClock};
pub use clock::Clock;
pub use config::BusConfig;
pub use error::{
    CallError, IntrospectError, OpenError, PortError, ReceiveError, SendError, StopError,
};
pub use fault::{Difference, TransportFault};
pub use found::{Found, FoundSample};
pub use introspect::{Layout, NodeInfo, NodeState, Peer, TopicInfo, nodes, remove_stale_nodes};
pub use inventory::Inventory;
pub use keeper::{Keeper, KeeperError};
pub use kept::KeptError;
pub use life::{Life, Sign};
pub use lock::{Lock, LockError};
pub use mend::{Mended, damaged, mend};
pub use name::{RobotName, RobotNameError, called};
pub use pace::Pace;
pub use place::{OtherPlace, Place, other_places};
pub use policy::{Policy, PolicyError};
pub use presence::Holder;
pub use publisher::{Loan, Publisher};
pub use request::{Client, Server};
pub use shortage::Shortage;
pub use shutdown::Shutdown;
pub use source::{Look, Source};
pub use stop::{Release, Stop, StopPage, StopTold, StopWord};
pub use subscriber::{Sample, Subscriber};
pub use waiter::{Ringer, Waiter, Wake};
pub use watch::BusWatch;
pub use watchdog::{GivenUp, Watchdog};

/// What carries the bus. All processes on one bus must agree in it.
pub const BUS_VERSION: &str = "iceoryx2 0.10.0";
