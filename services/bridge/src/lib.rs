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
//! * [`listener`]: the receiving end of one port, pure as well. `lager simulate` runs both.
//! * [`serial`]: a port, how it is found, who else has it, and the errors if it cannot be opened.
//! * [`frames`], [`settings`], [`profile`]: pure helpers between packets and samples.
//! * [`loan`]: how `lager board` gets the ports while the robot is up.
//! * [`buttons`]: the reset button and the mode switch of the robot.
//! * `latency`: how long logic's orders take to the wire, for `latency/command`.
//! * [`run`]: the shell with its three threads, and a fourth for the buttons.
//!
//! **Invariants:** while it runs, no other process opens the ports that it has not lent. A reader
//! thread never writes, and the main loop never reads. The arbiter decides everything that is
//! written, except handshakes and settings. The bridge never decides where the robot goes. An
//! original steering board has no limit on the age of a command, so the bridge sends it only
//! standby, unless the configuration accepts that risk.
//!
//! The main loop publishes `steering/state`, because only the arbiter knows the end of an order.
//! The reader thread publishes line and distance frames itself.

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
pub mod loan;
pub mod machine;
pub mod profile;
mod reader;
mod resets;
pub mod serial;
mod service;
pub mod settings;
mod source;

pub use config::{BridgeConfig, Ports};
pub use counts::Counts;
pub use events::{BoardUp, PortEvent};
pub use service::{BridgeError, run, run_with};
