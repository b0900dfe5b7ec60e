//! When frames are sent.
//!
//! Frames come at 1 kHz, always at the same phase of the millisecond and away from the kernel's
//! timer tick, which comes on whole milliseconds. A chain that happened to meet the tick would look
//! slower than one that did not.

use lager_ports::Clock;
use lager_rig::{interrupted, timespec};
use rustix::thread::{ClockId, clock_nanosleep_absolute};

/// Time between frames, in ns.
const PERIOD: u64 = 1_000_000;

/// Where in the millisecond a frame is sent, in ns.
const PHASE: u64 = 370_000;

/// How long an answer may take, in ns, before the frame counts as lost and ends the measurement.
pub(super) const ANSWER_WITHIN: u64 = 1_000_000_000;

/// `CLOCK_MONOTONIC` in ns.
pub(super) fn now_ns() -> u64 {
    Clock::monotonic_ns()
}

/// Sleeps until a frame is due.
pub(super) fn sleep_until_due() {
    let due = next_due(now_ns());
    while clock_nanosleep_absolute(ClockId::Monotonic, &timespec(due)).is_err() {
        if interrupted() {
            return;
        }
    }
}

/// The first moment of the right phase that is at least a quarter of a period away, so that no
/// frame is sent by one who has not slept.
fn next_due(now: u64) -> u64 {
    let earliest = now + PERIOD / 4;
    let due = earliest - earliest % PERIOD + PHASE;
    if due < earliest { due + PERIOD } else { due }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_due_once_in_a_period_at_their_phase() {
        for now in (0..3 * PERIOD).step_by(10_000) {
            let due = next_due(now);
            assert_eq!(due % PERIOD, PHASE);
            assert!(due >= now + PERIOD / 4 && due < now + PERIOD / 4 + PERIOD);
        }
    }
}
