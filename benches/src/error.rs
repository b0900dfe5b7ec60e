//! Why a measurement ended without a report; every message says what to do.

use core::time::Duration;
use std::path::PathBuf;

use lager_rig::schedule::{NoRealTime, Unbound};
use lager_rig::{NoPlace, ProcessError, Refused};

/// Why a measurement ended without a report.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// Two processes that never share a core need two: how many are needed, and how many there are.
    #[error(
        "this measurement needs {0} processor cores and this process may use {1}; run it on a larger machine, or without `taskset`, or choose `--regime same-core`"
    )]
    TooFewCores(usize, usize),
    /// A process could not be bound to its core.
    #[error(transparent)]
    Affinity(#[from] Unbound),
    /// The user may not run processes in real time.
    #[error("{0}; what needs it was not measured")]
    RealTime(#[from] NoRealTime),
    /// Nothing is left of what was asked for.
    #[error(
        "nothing to measure: {0}; choose other modes or regimes (a spinning receiver cannot share its core with the sender)"
    )]
    NothingToMeasure(&'static str),
    /// The kernel refused something a measurement is made of.
    #[error(transparent)]
    Kernel(#[from] Refused),
    /// The bus or bare iceoryx2 failed; it says why.
    #[error("{0}; check that /dev/shm exists, is writable and is not full")]
    Bus(String),
    /// The measurement has no place for its bus.
    #[error(transparent)]
    NoPlace(#[from] NoPlace),
    /// A process of the measurement is of no use.
    #[error(transparent)]
    Process(ProcessError),
    /// What was measured failed.
    #[error("`{contender}`, sample {sample}: {fault}")]
    Failed {
        /// The row being measured.
        contender: String,
        /// The number of the sample or frame.
        sample: u64,
        /// What is wrong with it.
        fault: Fault,
    },
    /// The other process did not come to the start within that time.
    #[error(
        "the other process of the measurement was not ready within {0:?}; the machine is overloaded, or it has ended: look at the messages above and start again"
    )]
    Alone(Duration),
    /// A program of the chips is not there.
    #[error("there is no {0}; build the boards' images and the emulator with `.ci/firmware`")]
    NotBuilt(PathBuf),
    /// The emulator has no figures; it says why.
    #[error("{0} measured nothing ({1}); build it and the images anew with `.ci/firmware`")]
    Emulator(PathBuf, String),
    /// Somebody wants to stop.
    #[error("interrupted; nothing was left behind")]
    Interrupted,
}

/// What is wrong with a sample.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// It did not come within that time.
    #[error(
        "it did not come within {0:?}; a wake-up was lost or the other process stands still: start again, and report it if it happens twice"
    )]
    Silent(Duration),
    /// It did not come within that time, because the kernel did not let a process run.
    #[error(
        "it did not come within {0:?}, because one of the processes is ready to run and gets no core: end what else runs on this machine and start again"
    )]
    Starved(Duration),
    /// Another one came: one that was not sent, or twice, or in the wrong order.
    #[error(
        "sample {0} came in its place, or it is damaged; this is a defect, please report it with the command line"
    )]
    Wrong(u64),
    /// What carries it failed; it says why.
    #[error("{0}; start again, and report it if it happens twice")]
    Broken(String),
}

/// What a bus that cannot be used says.
pub(crate) fn no_bus(error: impl core::fmt::Display) -> BenchError {
    BenchError::Bus(format!(
        "the bus of the measurement cannot be used: {error}"
    ))
}

/// A fault of what carries samples.
pub(crate) fn broken(error: impl core::fmt::Display) -> Fault {
    Fault::Broken(error.to_string())
}

impl From<rustix::io::Errno> for Fault {
    fn from(error: rustix::io::Errno) -> Self {
        broken(error)
    }
}

impl From<ProcessError> for BenchError {
    fn from(error: ProcessError) -> Self {
        match error {
            ProcessError::Interrupted => Self::Interrupted,
            other => Self::Process(other),
        }
    }
}
