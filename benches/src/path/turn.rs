//! One turn of a chain: its processes wake, answer frames and sleep again.
//!
//! Frames come at 1 kHz, always at the same phase of the millisecond and away from the kernel's
//! timer tick, which comes on whole milliseconds. A chain that happened to meet the tick would look
//! slower than one that did not.

use lager_home::Clock;
use lager_rig::{interrupted, timespec};
use rustix::thread::{ClockId, clock_nanosleep_absolute};

use super::processes::Processes;
use crate::error::BenchError;

/// Time between frames, in ns.
const PERIOD: u64 = 1_000_000;

/// The time within each millisecond at which a frame is sent, in ns.
const PHASE: u64 = 370_000;

/// Frames at the start of a turn that do not count. After them caches, learnt rates and clock
/// frequencies are as in the middle of a long run.
const WARM_UP: usize = 50;

/// Frames of a turn that count. They are few, so that a disturbance hits all chains.
pub(super) const TURN: usize = 250;

/// A chain that answers frames.
pub(super) trait Chain {
    /// The chain's processes, which are stopped while other chains are measured.
    fn processes(&mut self) -> &mut Processes;
    /// Sends one frame when it is due; returns the time until its answer was read, in ns.
    fn frame(&mut self) -> Result<u64, BenchError>;
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
/// Returns their times in ns.
pub(super) fn turn(chain: &mut dyn Chain, frames: usize) -> Result<Vec<u64>, BenchError> {
    chain.processes().wake();
    chain.begin()?;
    for _ in 0..WARM_UP {
        chain.frame()?;
    }
    chain.counts(true)?;
    chain.processes().start_counting();
    let mut times = Vec::with_capacity(frames);
    for _ in 0..frames {
        if interrupted() {
            return Err(BenchError::Interrupted);
        }
        times.push(chain.frame()?);
    }
    chain.counts(false)?;
    chain.processes().rest();
    Ok(times)
}

/// Sleeps until the next frame is due.
pub(super) fn sleep_until_due() {
    let due = next_due(Clock::monotonic_ns());
    while clock_nanosleep_absolute(ClockId::Monotonic, &timespec(due)).is_err() {
        if interrupted() {
            return;
        }
    }
}

/// The first moment of the right phase that is at least a quarter of a period away, so that the
/// thread always sleeps before it sends.
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
