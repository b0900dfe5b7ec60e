//! How a manoeuvre has ended. The mission learns nothing else of it.

use lager_topics::FailureKind;

/// How a manoeuvre has ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ending {
    /// It succeeded.
    Done,
    /// It probably succeeded: it was cut short, or the board was silent.
    Interrupted,
    /// The mark did not come. If it was a station's, the robot is at the node behind it, or has
    /// turned to the station and sees no tape. If it was the delivery corner's, the robot is
    /// somewhere near it, on its way back.
    Missed,
    /// Something stands on the way ahead.
    Blocked,
    /// The preparation is done, and the phase's manoeuvre begins now. The mission does not learn of
    /// it.
    Ready,
    /// It cannot go on: the failure, the expected value, and the seen value.
    Failed(FailureKind, f32, f32),
}
