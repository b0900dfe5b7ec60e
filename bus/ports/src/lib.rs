//! Typed publishers, subscribers and waiting: the only crate that opens iceoryx2.
//!
//! A process opens one [`Bus`] and makes its ports from it, each in the thread that uses it:
//!
//! ```no_run
//! use std::time::Duration;
//! use lager_ports::{Bus, BusConfig, Policy};
//! use lager_topics::{Role, SensorLine, SteeringCommand, SteeringOrder};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let bus = Bus::open(&BusConfig::default(), Role::Logic)?;
//! let mut line = bus.subscriber::<SensorLine>()?;
//! let orders = bus.publisher::<SteeringCommand>()?;
//! let waiter = bus.waiter(Policy::Block)?;
//! loop {
//!     // A wake is a hint: drain what it was for until that is empty.
//!     waiter.wait(Duration::from_millis(20));
//!     if waiter.has::<SensorLine>() {
//!         while let Some(frame) = line.receive()? {
//!             let mut order = orders.loan()?;
//!             order.code = 2;
//!             order.cause(frame.cause());
//!             order.send()?;
//!         }
//!     }
//! }
//! # }
//! ```
//!
//! * Streams overwrite: a reader that falls behind loses the oldest samples, never blocks the
//!   writer, and [`Subscriber::lost`] says exactly how many it missed.
//! * Services that act on a topic are woken through their [`Waiter`]; observers poll.
//! * A killed process is swept at the next [`Bus::open`] and by [`Bus::sweep`].
//!
//! **Invariant:** no type of iceoryx2 is in the public interface; nothing here decides anything
//! about the robot; sending and receiving do not allocate after start-up.

mod bus;
mod cause;
mod clock;
mod config;
mod doorbell;
mod error;
mod introspect;
mod inventory;
mod keeper;
mod kept;
mod lease;
mod lock;
mod mend;
mod name;
mod patience;
mod place;
mod pooled;
mod presence;
mod publisher;
mod request;
mod service;
mod shortage;
mod shutdown;
mod stop;
mod storage;
mod streams;
mod subscriber;
mod sweep;
mod transport;
mod untyped;
mod waiter;
mod watchdog;

pub use bus::Bus;
pub use cause::Cause;
pub use clock::Clock;
pub use config::BusConfig;
pub use error::{CallError, IntrospectError, OpenError, PortError, ReceiveError, SendError};
pub use introspect::{Layout, NodeInfo, NodeState, Peer, TopicInfo, nodes, remove_stale_nodes};
pub use inventory::Inventory;
pub use keeper::{Keeper, KeeperError};
pub use kept::KeptError;
pub use lock::{Lock, LockError};
pub use mend::{Mended, damaged, mend};
pub use name::{RobotName, RobotNameError};
pub use place::{OtherPlace, Place, other_places};
pub use presence::Holder;
pub use publisher::{Loan, Publisher};
pub use request::{Client, Server};
pub use shortage::Shortage;
pub use shutdown::Shutdown;
pub use stop::{Release, Stop, StopError, StopPage, StopTold, StopWord};
pub use subscriber::{Sample, Subscriber};
pub use waiter::{Policy, PolicyError, Ringer, Waiter, Wake};
pub use watchdog::{GivenUp, Watchdog};

/// What carries the bus. All processes on one bus must agree in it.
pub const BUS_VERSION: &str = "iceoryx2 0.10.0";
