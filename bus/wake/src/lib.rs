//! How one thread wakes another, in its own or another process, and how it waits to be woken.
//!
//! A [`Waiter`] waits for all topics on which its process acts. Its [`Policy`] says how: it sleeps,
//! it looks without pause, or it looks only when a ring is due. A writer of samples rings through a
//! [`PartRinger`]. Both use a [`Board`] of bells in shared memory. This crate never opens the bus.
//!
//! An observer that asks to be woken sleeps in a [`Watch`]. Writers wake it through a [`WatchRinger`].
//!
//! * [`Shutdown`] is a request to stop, and [`Watchdog`] watches calls that may never return.
//! * [`urgency`] says which thread gets a core first. [`Pace`] says how often an observer looks that
//!   nobody wakes.

mod bell;
mod pace;
mod policy;
mod shutdown;
pub mod urgency;
mod waiter;
mod watchdog;

pub use bell::{
    AllRinger, Board, BoardFault, PartRinger, SEATS_PER_PART, Watch, WatchRinger, sweep, sweep_all,
    woken,
};
pub use pace::Pace;
pub use policy::{Policy, PolicyError};
pub use shutdown::Shutdown;
pub use waiter::{Ringer, Waiter, Wake};
pub use watchdog::{GivenUp, Watchdog};
