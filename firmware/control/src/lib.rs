//! Every decision of the robot's two boards, in integers, behind a board trait.
//!
//! ```text
//!  Pi <== UART ==> SensorUnit --- ExDe ---> SteeringUnit <== UART ==> Pi
//!                    ^    ^                   |      |
//!             11 line     IR                motors   AX-12 servos
//!             sensors     ranger
//! ```
//!
//! The same code runs on the two ATmega1284P and, in the simulator, on the host: a chip's crate
//! implements [`SensorBoard`] or [`SteeringBoard`] by moving bits, a simulated body implements them
//! by arithmetic. Each unit has one entry, `step`, which takes in everything that has arrived,
//! decides, and returns when it wants to be stepped next. An additional step changes nothing, and a
//! late step delays the unit but does not confuse it.
//!
//! Nothing here reads a clock, sleeps, allocates, uses a float or touches a register. Times are
//! wrapping microseconds in `u32` and are only ever compared over spans far below the clock's round
//! of 71 minutes.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod arm;
mod board;
mod calibration;
mod divide;
mod failsafe;
mod follow;
pub mod ir;
pub mod line;
mod load;
mod outbox;
pub mod pd;
pub mod register;
mod replies;
mod reset;
mod sensor;
mod servo_bus;
pub mod sides;
mod steering;
mod store;
mod supply;
mod time;
pub mod turn;
mod wheels;

pub use board::{Board, EEPROM_LENGTH, Motor, SensorBoard, SteeringBoard};
pub use reset::reset_cause;
pub use sensor::{SensorConfig, SensorUnit};
pub use steering::{SteeringConfig, SteeringUnit};

/// Duty of a driving motor unless it follows the line (W1, `PWM_STANDARD`), of 255 (AMB-23).
pub const PWM_STANDARD: u8 = 100;

/// Silence inside a packet after which a board gives it up, in microseconds: two bytes at 9600 Bd
/// (AMB-9) and the pause a USB adapter makes between two of its frames.
pub const PACKET_GAP_US: u32 = 3_000;

/// Bytes from the Pi that one step takes in at most: what its queue holds. Noise may come faster
/// than it can be looked at, and the rest of the step must still be reached.
const MOST_BYTES: u8 = 64;

/// How often a step looks again whether the EEPROM takes the next byte, in microseconds.
const EEPROM_POLL_US: u32 = 4_000;

/// How often a step looks again whether the UART has finished, in microseconds; boards that know
/// step at once.
const UART_POLL_US: u32 = 500;
