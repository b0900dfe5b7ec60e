//! A robot that is up: the processes of `lager up`, and the work on the bus for them.
//!
//! ```text
//!   Robot (robot.rs)      the process `lager up`: starts, shows, ends; opens nothing on the bus
//!     │ asks                Course (course.rs): what is to be done next, a pure state machine
//!     │ starts, ends        Children (children.rs): the service processes, each with its Backoff
//!     │ messages (protocol.rs)
//!   attendant (attendant.rs)   its child `lager attend`: all that needs the bus
//!       Narrator, LastStates, KeptOrders, Returned, Mission, Ears
//! ```
//! It knows no configuration and no command line: `services/lager` reads both and composes a
//! [`Plan`].
//!
//! **Invariant:** the supervising process never touches shared memory of the bus, so nothing there
//! can hold it up or end it.

pub mod attendant;
mod backoff;
pub mod children;
pub mod console;
mod course;
mod figures;
pub mod hands;
pub mod kept_orders;
mod last_states;
mod link;
mod manager;
pub mod mission;
mod narrator;
mod protocol;
mod report;
mod resets;
mod robot;
pub mod runtime_folder;
pub mod service;
pub mod signals;
pub mod state_folder;
pub mod stopped;
mod terminal;

pub use children::Parent;
pub use manager::ServiceManager;
pub use robot::{Plan, Renewed, Robot};
pub use service::Service;
pub use terminal::Terminal;
