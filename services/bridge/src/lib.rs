//! The data sharer (D1-D7): the only owner of the serial ports, and the single arbiter of who
//! steers.
//!
//! ```text
//!  sensor board ==UART==> reader thread --> sensor/line, sensor/distance
//!                            | handshakes
//!                            v
//!  steering/command ---> main loop (Arbiter) --> steering/state, link/health
//!  operator/input          ^        |
//!  bridge/request          | reports| commands, ACKs
//!                       reader thread
//!  steering board ==UART====+<======+
//! ```
//!
//! * [`arbiter`]: whose word counts, as a pure state machine. The simulation in one process runs
//!   it too.
//! * [`serial`]: a port, and what to do when it cannot be opened.
//! * [`frames`], [`settings`]: pure helpers between packets and samples.
//! * `path`: how long sensor frames take to become commands, for `latency/path`.
//! * [`run`]: the shell with its three threads.
//!
//! **Invariants:** no other process opens the ports; a reader never writes and the main loop
//! never reads; nothing is written that the arbiter did not decide, handshakes and settings
//! excepted; the bridge never decides where the robot goes.

pub mod arbiter;
mod boards;
mod config;
pub mod frames;
mod path;
mod reader;
pub mod serial;
mod service;
pub mod settings;

pub use config::BridgeConfig;
pub use service::run;
