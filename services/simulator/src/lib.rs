//! The robot without hardware, for the services on the Pi: the plant and the boards' control
//! program behind the UART bytes of the real boards.
//!
//! [`Robot`] is pure: both boards run `lager_control` in the world of `lager_plant`, and exchange
//! bytes at the baud rate in virtual time. [`run`] is the process around it: two ptys in place of
//! the USB cables, real time multiplied by the speed of the bus's clock, and the topic
//! `truth/pose`.
//!
//! A service on the Pi cannot tell these boards from real ones. The simulator does not know which
//! services run. It reads only its own topic and its boards' EEPROMs, from before its restart, and
//! requests to change the world as a person's hands would.
//!
//! Safe state: the steering board's own. When a simulator ends, its robot is gone. In a restarted
//! one both boards start with the motors off.
#![forbid(unsafe_code)]

mod boards;
mod calibrate;
mod exde;
mod robot;
mod running;
mod shell;
mod truth;
mod uart;
mod world_requests;

pub use calibrate::{CalibrateError, calibrate};
pub use robot::{Robot, RobotOptions, Wire};
pub use shell::{RunError, SimulatorConfig, run};
pub use truth::{message, world_state};
pub use world_requests::{answer, wish};
