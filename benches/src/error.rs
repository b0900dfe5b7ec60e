//! Why a measurement ended without a report. Every message says what to do.

use core::time::Duration;
use std::path::PathBuf;

use lager_rig::schedule::{NoRealTime, Unbound};
use lager_rig::{NoPlace, ProcessError, Refused, Watch};

/// Why a measurement ended without a report.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// Two processes that never share a core need two: needed cores, and cores of this process.
    #[error(
        "this measurement needs {0} processor cores and this process may use {1}; run it on a larger machine, or without `taskset`, or choose `--regime same-core`"
    )]
    TooFewCores(usize, usize),
    /// A chosen core is not among those that this process may use.
    #[error(
        "core {0} is not among those that this process may use ({list}); choose two of them with --cores",
        list = .1.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
    )]
    NotUsable(usize, Vec<usize>),
    /// A process could not be bound to its core.
    #[error(transparent)]
    Affinity(#[from] Unbound),
    /// The user may not run processes in real time.
    #[error("{0}; the rows that need this right were not measured")]
    RealTime(#[from] NoRealTime),
    /// The chosen modes and regimes leave nothing to measure.
    #[error(
        "nothing to measure: {0}; choose other modes or regimes (a spinning receiver cannot share its core with the sender)"
    )]
    NothingToMeasure(&'static str),
    /// The kernel refused something that a measurement needs.
    #[error(transparent)]
    Kernel(#[from] Refused),
    /// The bus or bare iceoryx2 failed, with its own message.
    #[error("{0}; check that /dev/shm exists, is writable and is not full")]
    Bus(String),
    /// The kernel gives out no more events.
    #[error(transparent)]
    NoTracing(#[from] lager_tracer::NoTracing),
    /// There is no folder for the measurement's bus.
    #[error(transparent)]
    NoPlace(#[from] NoPlace),
    /// A process of the measurement failed.
    #[error(transparent)]
    Process(ProcessError),
    /// A sample failed.
    #[error("`{contender}`, sample {sample}: {fault}")]
    Failed {
        /// The row being measured.
        contender: String,
        /// The number of the sample or frame.
        sample: u64,
        /// What is wrong with it.
        fault: Fault,
    },
    /// The other process did not come to the start of the round within that time.
    #[error(
        "the other process of the measurement was not ready within {0:?}; the machine is overloaded, or it has ended: look at the messages above and start again"
    )]
    Alone(Duration),
    /// No process has a topic of that name open, of that robot.
    #[error(
        "`{1}` has no topic `{0}` on this bus; `lager topic list` shows those that are open, and `--bus` and `--name` choose another bus and robot"
    )]
    NoTopic(String, String),
    /// Nobody is known to be woken by that topic.
    #[error(
        "whom `{0}` wakes is not in the robot's table, so only an observer can measure it; leave out --wait"
    )]
    NotWoken(String),
    /// The topic had no sample for that time.
    #[error("no sample of `{0}` came within {1:?}; `lager topic info {0}` shows who writes it")]
    Quiet(String, Duration),
    /// A program that makes the load or measures the floor does not exist, of that package.
    #[error(
        "`--load` needs the program `{0}`, which is not there; `apt-get install {1}` installs it"
    )]
    NoProgram(&'static str, &'static str),
    /// The emulator or an image does not exist.
    #[error("there is no {0}; build the boards' images and the emulator with `.ci/firmware`")]
    NotBuilt(PathBuf),
    /// The emulator gave no figures, with its own message.
    #[error("{0} measured nothing ({1}); build it and the images again with `.ci/firmware`")]
    Emulator(PathBuf, String),
    /// A sample or a process was silent, on a machine that gave a core to nobody here for that time.
    #[error("{0}. Meanwhile this machine gave a core to nobody here for {1:?}, which may be why")]
    HeldUp(Box<BenchError>, Duration),
    /// The user wants to stop.
    #[error("interrupted; nothing was left behind")]
    Interrupted,
}

/// From this time on a core was held up. A robot's leases and reports are as long, so it stands.
const HELD_UP: Duration = Duration::from_millis(100);

impl BenchError {
    /// The same, or [`BenchError::HeldUp`] if something did not come in time while `watch` saw that
    /// this machine was held up.
    #[must_use]
    pub fn seen_by(self, watch: Watch) -> Self {
        match self.is_silence().then(|| watch.end()) {
            Some(held_up) if held_up >= HELD_UP => Self::HeldUp(Box::new(self), held_up),
            _ => self,
        }
    }

    /// Whether something did not come in time, as also happens on a machine that is held up.
    fn is_silence(&self) -> bool {
        matches!(
            self,
            Self::Alone(_)
                | Self::Process(ProcessError::Silent { .. })
                | Self::Failed {
                    fault: Fault::Silent(_) | Fault::Starved(_),
                    ..
                }
        )
    }
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
        "it did not come within {0:?}, because one of the processes is ready to run and gets no core: end other programs on this machine and start again"
    )]
    Starved(Duration),
    /// Another sample came: one that nobody sent, one twice, or one in the wrong order.
    #[error(
        "sample {0} came in its place, or it is damaged; this is a defect, please report it with the command line"
    )]
    Wrong(u64),
    /// The carrier of the samples failed, with its own message.
    #[error("{0}; start again, and report it if it happens twice")]
    Broken(String),
}

/// The error of a bus that cannot be used.
pub(crate) fn no_bus(error: impl core::fmt::Display) -> BenchError {
    BenchError::Bus(format!(
        "the bus of the measurement cannot be used: {error}"
    ))
}

/// The fault of a carrier of samples that failed.
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
