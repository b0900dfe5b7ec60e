//! How long an order holds, and how late one may come. Every process between a person and the
//! motors uses these times.
//!
//! ```text
//!   who                                  how long                  after that
//!   sender of a setpoint                 renews it every RENEWAL   the order has ended
//!   bridge, with a setpoint              holds it for SETPOINT     it writes standby
//!   robot, with a person's command       holds it for COMMAND      the robot stands
//!   steering board, with its command     holds it for COMMAND      the board stops the motors
//!   bridge, with a silent board          waits for UNHEARD         nobody may move the robot
//!   all, an order that moves the robot   take it for LATEST_MOVE   it is refused
//!   all, any other order                 take it for LATEST        it is refused
//! ```

use core::time::Duration;

/// How often the sender of a setpoint renews it, in robot time: three times in its lease.
pub const RENEWAL: Duration = Duration::from_millis(40);

/// How long the bridge holds a setpoint after the last renewal, in robot time.
pub const SETPOINT: Duration = Duration::from_millis(120);

/// How long a person's command to the wheels holds in the robot, and how long the steering board
/// obeys a command that is not repeated.
pub const COMMAND: Duration = lager_wire::COMMAND_AGE;

/// How long the steering board may be silent before nobody may move the robot, in robot time.
pub const UNHEARD: Duration = Duration::from_millis(200);

/// How late an order may come that moves the robot or lets it move, in real time: from the program
/// that gives it to the process that carries it out.
pub const LATEST_MOVE: Duration = Duration::from_millis(200);

/// How late any other order but a stop may come, in real time.
pub const LATEST: Duration = Duration::from_secs(2);

/// [`LATEST_MOVE`] in ms, as requests have it.
pub const LATEST_MOVE_MS: u32 = LATEST_MOVE.as_millis() as u32;

/// [`LATEST_MOVE`] in ns, as the times of samples have it.
pub const LATEST_MOVE_NS: u64 = LATEST_MOVE.as_nanos() as u64;

/// An order is not carried out because it came so late.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLate(pub Duration);

impl TooLate {
    /// Refuses an order that came later than it may.
    ///
    /// # Errors
    ///
    /// `late` is greater than `latest`.
    pub fn check(late: Duration, latest: Duration) -> Result<(), Self> {
        match late > latest {
            true => Err(Self(late)),
            false => Ok(()),
        }
    }
}
