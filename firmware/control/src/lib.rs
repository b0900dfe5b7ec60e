//! Every decision of the robot's two boards, in integers, behind a board trait.
//!
//! ```text
//!  Pi <== UART ==> SensorUnit --- ExDe ---> SteeringUnit <== UART ==> Pi
//!                    ^    ^                   |      |
//!             11 line     IR                motors   AX-12 servos
//!             sensors     ranger
//! ```
//!
//! The same code runs on the two ATmega1284P and, in the simulator, on the host. A chip's crate
//! implements [`SensorBoard`] or [`SteeringBoard`] by moving bits, a simulated board by arithmetic.
//! Each unit has one entry, `step`: it takes in everything that has arrived, decides, and returns
//! when the caller must step it next. An additional step changes nothing; a late step only delays
//! the unit.
//!
//! Nothing here reads a clock, sleeps, allocates, uses a float or touches a register. Times are
//! microseconds in a wrapping `u32`; the code compares only times much less than 71 minutes apart,
//! after which the clock wraps.

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
mod pulses;
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
mod told;
pub mod turn;
mod wheels;

pub use board::{Board, EEPROM_LENGTH, Motor, SensorBoard, SteeringBoard};
pub use reset::reset_cause;
pub use sensor::{SensorConfig, SensorUnit};
pub use steering::{SteeringConfig, SteeringUnit};

/// A board gives a packet up after this silence inside it, in microseconds: two bytes at 9600 Bd
/// (AMB-9) and the pause that a USB adapter makes between two of its frames.
pub const PACKET_GAP_US: u32 = 3_000;

/// The most bytes from the Pi that one step takes in: as many as its queue holds. Noise can come
/// faster than the board can look at it, and the step must still reach its other work.
const MOST_BYTES: u8 = 64;

/// How often a step checks whether the EEPROM takes the next byte, in microseconds.
const EEPROM_POLL_US: u32 = 4_000;

/// How often a step checks whether the UART has finished, in microseconds. A board that notices the
/// end steps at once.
const UART_POLL_US: u32 = 500;
