//! How a manoeuvre has ended: all that the mission learns of it.

use lager_topics::FailureKind;

/// How a manoeuvre has ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// As it should.
    Done,
    /// As it should, as far as can be known: it was cut short, or the board was not heard.
    Interrupted,
    /// The mark did not come. A station's: the robot is at the node behind it, or has turned to the
    /// station and sees no tape. The delivery corner's: the robot is about there, on its way back.
    Missed,
    /// Something stands on the way ahead.
    Blocked,
    /// What had to come first is done: the phase's manoeuvre begins now. The mission learns
    /// nothing.
    Ready,
    /// It cannot go on: what, what was expected, and what was seen.
    Failed(FailureKind, f32, f32),
}
