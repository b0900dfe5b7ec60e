//! One turn of a chain: its processes wake, answer frames and stand still again.

use lager_rig::interrupted;

use super::processes::Processes;
use super::stages::Counted;
use crate::error::BenchError;

/// Frames of a turn that are sent and not counted: caches, learnt rates and clock frequencies are
/// then as in the middle of a long run.
const WARM_UP: usize = 50;

/// Frames of a turn that count. Few, so that what the machine does meanwhile meets all chains.
pub(super) const TURN: usize = 250;

/// A chain that frames can be sent through.
pub(super) trait Chain {
    /// Its processes, which stand still while others are measured.
    fn processes(&mut self) -> &mut Processes;
    /// Sends one frame when it is due; the time until its answer was read, in ns.
    fn frame(&mut self) -> Result<u64, BenchError>;
    /// Makes sure that it answers, after it stood still.
    fn begin(&mut self) -> Result<(), BenchError> {
        Ok(())
    }
    /// From now on, or until now, frames count.
    fn counts(&mut self, _counts: bool) -> Result<(), BenchError> {
        Ok(())
    }
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
