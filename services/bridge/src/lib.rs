//! The data sharer (D1-D7): the only owner of the serial ports, and the single arbiter of who
//! steers.
//!
//! ```text
//!  sensor board ==UART==> reader thread --> sensor/line, sensor/distance
//!                            | handshakes
//!                            v
//!  steering/command ---> main loop (BridgeCore) -> steering/state, link/health
//!  operator/input          ^        |
//!  bridge/request          | reports| commands, ACKs
//!                       reader thread
//!  steering board ==UART====+<======+
//! ```
//!
//! * [`arbiter`]: which origin may steer, as a pure state machine.
//! * [`machine`]: every other decision of the bridge, around the arbiter and just as pure.
//! * [`listener`]: the receiving end of one port, pure too. `lager simulate` runs both.
//! * [`serial`]: a port, and what to do when it cannot be opened.
//! * [`frames`], [`settings`], [`profile`]: pure helpers between packets and samples.
//! * [`buttons`]: the reset button and the mode switch of the robot.
//! * `latency`: how long logic's orders take to the wire, for `latency/command`.
//! * [`run`]: the shell with its three threads, and one more where there are buttons.
//!
//! **Invariants:** no other process opens the ports. A reader thread never writes, and the main
//! loop never reads. Everything that is written was decided by the arbiter, except for handshakes
//! and settings. The bridge never decides where the robot goes.
//!
//! The main loop publishes `steering/state`, because only the arbiter knows the end of an order.
//! Line and distance frames are published by the reader thread directly.

pub mod arbiter;
mod boards;
pub mod buttons;
mod calibration;
mod config;
mod counts;
mod events;
pub mod frames;
mod latency;
pub mod listener;
pub mod machine;
mod presses;
pub mod profile;
mod reader;
mod resets;
pub mod serial;
mod service;
pub mod settings;

pub use config::BridgeConfig;
pub use counts::Counts;
pub use events::{BoardUp, Moment, PortEvent};
pub use service::{run, run_with};
