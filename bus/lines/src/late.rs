//! How late something may come that was said to a robot.
//!
//! It is apart because every hop between a person and the robot holds to it: the panel for its
//! pages, the station for a GaG, the robot for its station.

use core::time::Duration;

use thiserror::Error;

/// How late something may come that moves the robot or lets it move, from whoever gives it to what
/// carries it out.
pub const LATEST_MOVE: Duration = Duration::from_millis(200);

/// How late anything else may come that is not a stop.
pub const LATEST: Duration = Duration::from_secs(2);

/// That something is not done because it came so late.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("came {} ms late; give it anew", .0.as_millis())]
pub struct TooLate(pub Duration);

impl TooLate {
    /// Refuses what is later than it may be.
    ///
    /// # Errors
    ///
    /// When it is.
    pub fn check(late: Duration, latest: Duration) -> Result<(), Self> {
        match late > latest {
            true => Err(Self(late)),
            false => Ok(()),
        }
    }
}
