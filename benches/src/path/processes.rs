//! The processes of one chain: put to sleep while others are measured, watched, and asked what
//! processor time they used.

use core::time::Duration;

use lager_ports::Clock;
use lager_rig::{Process, ProcessError, told};
use rustix::process::Signal;
use serde::Serialize;

use crate::error::{BenchError, Fault};

/// How long an answer may take before the frame counts as lost and ends the measurement.
pub(super) const ANSWER_WITHIN: Duration = Duration::from_secs(1);

/// The processes of one chain.
pub(super) struct Processes {
    processes: Vec<Process>,
    /// Of these the processor time is counted: the services, not their observers.
    counted: usize,
    /// Processor time and real time when the turn's counting began, in ns.
    began: Option<(u64, u64)>,
    /// Processor time and real time of all turns so far, in ns.
    total: (u64, u64),
}

impl Processes {
    /// Starts them, each with what it is told, one after the other; all are counted.
    pub(super) fn start<S: Serialize>(all: [(&str, S); 2]) -> Result<Self, BenchError> {
        let mut processes = Vec::new();
        for (name, setup) in all {
            let mut process = Process::start(name)?;
            let () = process.ask(&setup)?;
            processes.push(process);
        }
        Ok(Self {
            counted: processes.len(),
            processes,
            began: None,
            total: (0, 0),
        })
    }

    /// More processes, which are not counted.
    pub(super) fn add(&mut self, processes: Vec<Process>) {
        self.processes.extend(processes);
    }

    /// Lets them run.
    pub(super) fn wake(&self) {
        self.signal(Signal::CONT);
    }

    /// The turn is over: lets them stand still until [`Processes::wake`].
    pub(super) fn rest(&mut self) {
        if let Some((processor, real)) = self.began.take() {
            self.total.0 += self.processor_ns().saturating_sub(processor);
            self.total.1 += Clock::monotonic_ns().saturating_sub(real);
        }
        self.signal(Signal::STOP);
    }

    /// From now on processor time is counted.
    pub(super) fn start_counting(&mut self) {
        self.began = Some((self.processor_ns(), Clock::monotonic_ns()));
    }

    /// Processor time per real time over all turns, in percent of one core.
    pub(super) fn cpu_percent(&self) -> Option<f64> {
        let (processor, real) = self.total;
        (real > 0).then(|| 100.0 * processor as f64 / real as f64)
    }

    /// Why frame `number` has no answer: what a process says, that the kernel does not let it run,
    /// or that it is silent.
    pub(super) fn fault(&mut self, contender: &str, number: u64) -> BenchError {
        let starved = self.counted().any(told::wants_to_run);
        for process in &mut self.processes {
            match process.hear_within::<()>(Duration::ZERO) {
                Ok(()) | Err(ProcessError::Silent { .. }) => {}
                Err(said) => return said.into(),
            }
        }
        BenchError::Failed {
            contender: contender.to_owned(),
            sample: number,
            fault: match starved {
                true => Fault::Starved(ANSWER_WITHIN),
                false => Fault::Silent(ANSWER_WITHIN),
            },
        }
    }

    fn signal(&self, signal: Signal) {
        for process in &self.processes {
            process.signal(signal);
        }
    }

    fn counted(&self) -> impl Iterator<Item = u32> {
        self.processes[..self.counted].iter().map(Process::pid)
    }

    /// Processor time of the counted processes, in ns.
    fn processor_ns(&self) -> u64 {
        self.counted().map(told::processor_ns).sum()
    }
}
