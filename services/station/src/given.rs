//! What somebody wants, and for how long he has wanted it already.

use std::time::Duration;

/// A wish that has been under way before the station learns of it. One that has not is made of the
/// wish alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Given<T> {
    /// What is wanted.
    pub what: T,
    /// How long ago it was given.
    pub late: Duration,
}

impl<T> From<T> for Given<T> {
    fn from(what: T) -> Self {
        let late = Duration::ZERO;
        Self { what, late }
    }
}
