//! One turn of a chain: its processes wake, answer frames and sleep again.
//!
//! Frames are due at 1 kHz, always at the same phase of the millisecond and away from the kernel's
//! timer tick, which comes on whole milliseconds. A chain that happened to meet the tick would look
//! slower than one that did not. A frame that is late follows half a millisecond after the answer to
//! the one before it, because logic trusts a line frame for almost as long ([`super::services`]).

use lager_home::Clock;
use lager_rig::{interrupted, timespec};
use rustix::thread::{ClockId, clock_nanosleep_absolute};

use super::processes::Processes;
use crate::error::BenchError;
use crate::plan::Plan;
use crate::rounds::Taken;

/// Time between frames, in ns.
pub(super) const PERIOD: u64 = 1_000_000;

/// The least time from an answer to the next frame, in ns.
pub(super) const REST: u64 = PERIOD / 2;

/// The time within each millisecond at which a frame is sent, in ns.
const PHASE: u64 = 370_000;

/// Frames at the start of a turn that do not count. After them caches, learnt rates and clock
/// frequencies are as in the middle of a long run.
pub(super) const WARM_UP: usize = 50;

/// Frames of a turn that count. They are few, so that a disturbance hits all chains.
pub(super) const TURN: usize = 250;

/// A chain that answers frames.
pub(super) trait Chain {
    /// The chain's processes, which are stopped while other chains are measured.
    fn processes(&mut self) -> &mut Processes;
    /// Sends one frame at `at`; returns when it was sent and when its answer was read, in ns.
    fn frame(&mut self, at: u64) -> Result<[u64; 2], BenchError>;
    /// Waits until the chain answers again after a pause.
    fn begin(&mut self) -> Result<(), BenchError> {
        Ok(())
    }
    /// Frames count from now on, or do not count any more.
    fn counts(&mut self, _counts: bool) -> Result<(), BenchError> {
        Ok(())
    }
    /// The times of the counted frames whose command was overtaken by another one, in ns; `None` if
    /// the chain cannot overtake.
    fn overtaken(&self) -> Option<&[u64]> {
        None
    }
}

/// One turn of `chain`: wakes it, warms it up, sends `frames` frames that count, and stops it.
pub(super) fn turn(chain: &mut dyn Chain, frames: usize) -> Result<Taken, BenchError> {
    chain.processes().wake();
    chain.begin()?;
    exchange(chain, WARM_UP)?;
    chain.counts(true)?;
    chain.processes().start_counting();
    let taken = exchange(chain, frames)?;
    chain.counts(false)?;
    chain.processes().rest();
    Ok(Taken::paced(PERIOD, taken))
}

/// Sends that many frames by a plan of their own: when each was due, sent and answered.
fn exchange(chain: &mut dyn Chain, frames: usize) -> Result<Vec<[u64; 3]>, BenchError> {
    let mut plan = Plan::new(next_due(Clock::monotonic_ns()), PERIOD, REST);
    let mut taken = Vec::with_capacity(frames);
    for _ in 0..frames {
        if interrupted() {
            return Err(BenchError::Interrupted);
        }
        let next = plan.next();
        let [sent, answered] = chain.frame(next.send)?;
        plan.answered(answered);
        taken.push([next.due, sent, answered]);
    }
    Ok(taken)
}

/// Sleeps until `at`, in ns.
pub(super) fn sleep_until(at: u64) {
    while clock_nanosleep_absolute(ClockId::Monotonic, &timespec(at)).is_err() {
        if interrupted() {
            return;
        }
    }
}

/// The first moment of the right phase that is at least a quarter of a period away.
pub(super) fn next_due(now: u64) -> u64 {
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
