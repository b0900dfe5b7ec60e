//! A person's wish, and how old it is.

use std::time::Duration;

/// A wish, and how long it took to reach the station. `From` makes a wish of this moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Given<T> {
    /// What the person wants.
    pub what: T,
    /// How long ago the person wished it.
    pub late: Duration,
}

impl<T> From<T> for Given<T> {
    fn from(what: T) -> Self {
        let late = Duration::ZERO;
        Self { what, late }
    }
}
