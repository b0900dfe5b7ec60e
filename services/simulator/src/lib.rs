//! The robot without hardware: plant and board control behind the UART bytes of the real boards.
//!
//! [`Robot`] is pure: both boards run `lager_control`, wired to the world of `lager_plant`, and
//! speak bytes at the baud rate in virtual time. [`run`] is its shell as a process: two ptys in
//! place of the USB cables, real time times the speed of the bus's clock, and `truth/pose`.
//!
//! A service on the Pi cannot tell it from the boards. It does not know which services run: it
//! reads no topic but its own, from before its restart. On request it does to the world what a
//! person's hands would do.
//!
//! Safe state: the steering board's own. A simulator that ends takes the robot with it; a
//! restarted one begins with both boards starting, motors off.
#![forbid(unsafe_code)]

mod boards;
mod calibrate;
mod exde;
mod hands;
mod robot;
mod running;
mod shell;
mod truth;
mod uart;

pub use calibrate::{CalibrateError, calibrate};
pub use hands::{Wish, answer, wish};
pub use robot::{Robot, RobotOptions, Snapshot, Wire};
pub use shell::{RunError, SimulatorConfig, run};
pub use truth::{message, world_state};
