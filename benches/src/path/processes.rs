//! The processes of one chain: stops them while other chains are measured, says why one of them
//! failed, and counts their processor time.

use core::time::Duration;

use lager_home::Clock;
use lager_rig::{Process, ProcessError, proc};
use rustix::process::Signal;
use serde::Serialize;

use crate::error::{BenchError, Fault};

/// The longest wait for an answer. After it the frame is lost and the measurement fails.
pub(super) const ANSWER_WITHIN: Duration = Duration::from_secs(1);

/// The processes of one chain.
pub(super) struct Processes {
    processes: Vec<Process>,
    /// The number of processes whose processor time counts: the services, not their observers.
    counted: usize,
    /// Processor time and real time at the start of the turn's counting, in ns.
    began: Option<(u64, u64)>,
    /// Processor time and real time of all turns so far, in ns.
    total: (u64, u64),
}

impl Processes {
    /// Starts them one after the other, each with its message. All of them count.
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

    /// Adds processes that do not count.
    pub(super) fn add(&mut self, processes: Vec<Process>) {
        self.processes.extend(processes);
    }

    /// Lets the processes run again.
    pub(super) fn wake(&self) {
        self.signal(Signal::CONT);
    }

    /// Ends the turn: stops the processes until [`Processes::wake`].
    pub(super) fn rest(&mut self) {
        if let Some((processor, real)) = self.began.take() {
            self.total.0 += self.processor_ns().saturating_sub(processor);
            self.total.1 += Clock::monotonic_ns().saturating_sub(real);
        }
        self.signal(Signal::STOP);
    }

    /// From now on processor time counts.
    pub(super) fn start_counting(&mut self) {
        self.began = Some((self.processor_ns(), Clock::monotonic_ns()));
    }

    /// Processor time per real time over all turns, in percent of one core.
    pub(super) fn cpu_percent(&self) -> Option<f64> {
        let (processor, real) = self.total;
        (real > 0).then(|| 100.0 * processor as f64 / real as f64)
    }

    /// Why frame `number` has no answer: a process reports an error, or a process is ready but gets
    /// no core, or all are silent.
    pub(super) fn fault(&mut self, contender: &str, number: u64) -> BenchError {
        let starved = self.counted().any(proc::wants_to_run);
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

    /// The two services' process ids, bridge and logic.
    pub(super) fn services(&self) -> [u32; 2] {
        // Logic starts first.
        [self.processes[1].pid(), self.processes[0].pid()]
    }

    fn signal(&self, signal: Signal) {
        for process in &self.processes {
            process.signal(signal);
        }
    }

    fn counted(&self) -> impl Iterator<Item = u32> {
        self.processes[..self.counted].iter().map(Process::pid)
    }

    /// The processor time of the counted processes, in ns.
    fn processor_ns(&self) -> u64 {
        self.counted().map(proc::processor_ns).sum()
    }
}
