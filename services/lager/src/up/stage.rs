//! How far a robot has been started, and which of its services wait for a successor.

use std::time::{Duration, Instant};

use crate::services::Service;

/// How far the robot has been started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// Nothing runs: the bus did not hold, and is tried again then.
    Resting(Instant),
    /// The attendant removes what is left on the bus.
    Sweeping,
    /// The body runs, and the attendant joins the bus with the body's clock.
    Joining,
    /// Everything has been started.
    Whole,
}

/// A service that has ended, and what is kept for its successor.
pub(super) struct Owed {
    pub(super) service: Service,
    /// What `Robot::attended` was when it ended.
    pub(super) since: Duration,
    pub(super) served: bool,
}
