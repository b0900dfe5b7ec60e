//! When frames are sent, and one turn of a chain.
//!
//! Frames come at 1 kHz, always at the same phase of the millisecond and away from the kernel's
//! timer tick, which comes on whole milliseconds. A chain that happened to meet the tick would look
//! slower than one that did not.

use lager_ports::Clock;
use lager_rig::{interrupted, timespec};
use rustix::thread::{ClockId, clock_nanosleep_absolute};

use super::stages::Counted;
use crate::error::BenchError;

/// Time between frames, in ns.
const PERIOD: u64 = 1_000_000;

/// Where in the millisecond a frame is sent, in ns.
const PHASE: u64 = 370_000;

/// How long an answer may take, in ns, before the frame counts as lost and ends the measurement.
pub(super) const ANSWER_WITHIN: u64 = 1_000_000_000;

/// Frames of a turn that are sent and not counted: caches, learnt rates and clock frequencies are
/// then as in the middle of a long run.
const WARM_UP: usize = 50;

/// Frames of a turn that count. Few, so that what the machine does meanwhile meets all chains.
pub(super) const TURN: usize = 250;

/// A chain that frames can be sent through.
pub(super) trait Chain {
    /// Wakes the chain's processes and makes sure that it answers.
    fn begin(&mut self) -> Result<(), BenchError>;
    /// Sends one frame when it is due; the time until its answer was read, in ns.
    fn frame(&mut self) -> Result<u64, BenchError>;
    /// Counting begins now: what is measured beside the frames is measured from here.
    fn count(&mut self) -> Result<(), BenchError>;
    /// The turn is over: puts the chain's processes to sleep, so that others are measured alone.
    fn end(&mut self) -> Result<(), BenchError>;
    /// Processor time of the chain's processes while frames were counted, in percent of one core.
    fn cpu_percent(&self) -> Option<f64>;
    /// The times of the frames that counted and whose command was overtaken by another one, in ns.
    fn overtaken(&self) -> &[u64] {
        &[]
    }
    /// What the chain itself has counted, as of the last second, if it counts anything.
    fn counted(&mut self) -> Result<Option<Counted>, BenchError> {
        Ok(None)
    }
}

/// One turn of `chain`: wakes it, warms it up, sends `frames` frames that count, puts it to sleep.
/// The times of the frames that count, in ns.
pub(super) fn turn(chain: &mut dyn Chain, frames: usize) -> Result<Vec<u64>, BenchError> {
    chain.begin()?;
    for _ in 0..WARM_UP {
        chain.frame()?;
    }
    chain.count()?;
    let mut times = Vec::with_capacity(frames);
    for _ in 0..frames {
        if interrupted() {
            return Err(BenchError::Interrupted);
        }
        times.push(chain.frame()?);
    }
    chain.end()?;
    Ok(times)
}

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
