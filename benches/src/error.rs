//! Why a measurement ended without a report; every message says what to do.

use core::time::Duration;
use std::path::PathBuf;

use lager_rig::{NoPlace, ProcessError, Refused};

/// Why a measurement ended without a report.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// Two processes that never share a core need two.
    #[error(
        "this measurement needs {needed} processor cores and this process may use {found}; run it on a larger machine, or without `taskset`, or choose `--regime same-core`"
    )]
    TooFewCores {
        /// Cores needed.
        needed: usize,
        /// Cores the process may use.
        found: usize,
    },
    /// A thread could not be bound to a core.
    #[error(
        "a process could not be bound to core {core} ({detail}); check the container's cpuset, and that no other tool changes affinities meanwhile"
    )]
    Affinity {
        /// The core.
        core: usize,
        /// What the kernel says.
        detail: String,
    },
    /// The user may not run processes in real time.
    #[error(
        "no right to run in real time ({detail}), so what needs it was not measured; run as root, or give this user rtprio (`ulimit -r`)"
    )]
    RealTime {
        /// What the kernel says.
        detail: String,
    },
    /// A process of the path was ready to run and the kernel did not let it.
    #[error(
        "`{contender}` did not answer within {limit:?}, because one of its processes is ready to run and gets no core: end what else runs on this machine and start again"
    )]
    Starved {
        /// The row being measured.
        contender: String,
        /// How long it was waited for.
        limit: Duration,
    },
    /// Nothing is left of what was asked for.
    #[error(
        "nothing to measure: {0}; choose other modes or regimes (a spinning receiver cannot share its core with the sender)"
    )]
    NothingToMeasure(String),
    /// The kernel refused something a measurement is made of.
    #[error(transparent)]
    Kernel(#[from] Refused),
    /// The bus or bare iceoryx2 failed.
    #[error("{what}: {detail}; check that /dev/shm exists, is writable and is not full")]
    Bus {
        /// What was to be done.
        what: &'static str,
        /// What the transport says.
        detail: String,
    },
    /// The measurement has no place for its bus.
    #[error(transparent)]
    NoPlace(#[from] NoPlace),
    /// A process of the measurement is of no use.
    #[error(transparent)]
    Process(ProcessError),
    /// A sample came that was not sent, or twice, or in the wrong order.
    #[error(
        "`{contender}` delivered sample {got} where {expected} was due; this is a defect, please report it with the command line"
    )]
    WrongSample {
        /// What carried the sample.
        contender: String,
        /// The number expected.
        expected: u64,
        /// The number received.
        got: u64,
    },
    /// A sample did not come.
    #[error(
        "`{contender}` did not deliver sample {expected} within {limit:?}; a wake-up was lost or the other process stands still: start again, and report it if it happens twice"
    )]
    NoSample {
        /// What carries the samples.
        contender: String,
        /// The number expected.
        expected: u64,
        /// How long it was waited for.
        limit: Duration,
    },
    /// What carries the samples failed.
    #[error("`{contender}` failed ({detail}); start again, and report it if it happens twice")]
    Carrier {
        /// What carries the samples.
        contender: String,
        /// What it says.
        detail: String,
    },
    /// The other process did not come to the start.
    #[error(
        "the other process of the measurement was not ready within {limit:?}; the machine is overloaded, or it has ended: look at the messages above and start again"
    )]
    Alone {
        /// How long it was waited for.
        limit: Duration,
    },
    /// A program of the chips is not there.
    #[error("there is no {0}; build the boards' images and the emulator with `.ci/firmware`")]
    NotBuilt(PathBuf),
    /// The emulator has no figures.
    #[error(
        "{emulator} measured nothing ({detail}); build it and the images anew with `.ci/firmware`"
    )]
    Emulator {
        /// The executable.
        emulator: PathBuf,
        /// What it says.
        detail: String,
    },
    /// Somebody wants to stop.
    #[error("interrupted; nothing was left behind")]
    Interrupted,
}

/// What a bus that cannot be used says.
pub(crate) fn no_bus(error: impl core::fmt::Display) -> BenchError {
    BenchError::Bus {
        what: "the bus of the measurement could not be opened",
        detail: error.to_string(),
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
