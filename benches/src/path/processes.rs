//! The processes of one chain: put to sleep while others are measured, watched, and asked what
//! processor time they used.

use core::time::Duration;

use lager_rig::{Process, ProcessError};
use rustix::process::{Pid, Signal, kill_process};
use serde::Serialize;

use super::pace::{ANSWER_WITHIN, now_ns};
use crate::error::BenchError;

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
            self.total.1 += now_ns().saturating_sub(real);
        }
        self.signal(Signal::STOP);
    }

    /// From now on processor time is counted.
    pub(super) fn start_counting(&mut self) {
        self.began = Some((self.processor_ns(), now_ns()));
    }

    /// Processor time per real time over all turns, in percent of one core.
    pub(super) fn cpu_percent(&self) -> Option<f64> {
        let (processor, real) = self.total;
        (real > 0).then(|| 100.0 * processor as f64 / real as f64)
    }

    /// Why frame `number` has no answer: what a process says, that the kernel does not let it run,
    /// or that it is silent.
    pub(super) fn fault(&mut self, contender: &str, number: u64) -> BenchError {
        let starved = self.processes[..self.counted].iter().any(wants_to_run);
        for process in &mut self.processes {
            match process.hear_within::<()>(Duration::ZERO) {
                Ok(()) | Err(ProcessError::Silent { .. }) => {}
                Err(said) => return said.into(),
            }
        }
        let (contender, limit) = (contender.to_owned(), Duration::from_nanos(ANSWER_WITHIN));
        if starved {
            BenchError::Starved { contender, limit }
        } else {
            BenchError::NoSample {
                contender,
                expected: number,
                limit,
            }
        }
    }

    fn signal(&self, signal: Signal) {
        for process in &self.processes {
            let pid = i32::try_from(process.pid()).ok().and_then(Pid::from_raw);
            // One that has ended is found out with the next frame.
            let _ = pid.map(|pid| kill_process(pid, signal));
        }
    }

    /// Processor time of all threads of the counted processes, in ns.
    fn processor_ns(&self) -> u64 {
        self.processes[..self.counted]
            .iter()
            .map(processor_ns)
            .sum()
    }
}

/// The kernel counts each thread's time on a processor in ns, first in its `schedstat`.
fn processor_ns(process: &Process) -> u64 {
    of_threads(process, "schedstat")
        .filter_map(|text| text.split_whitespace().next()?.parse::<u64>().ok())
        .sum()
}

/// Whether a thread of it is ready to run. Asked of a process that should have answered long ago:
/// one that waits for a wake-up sleeps.
fn wants_to_run(process: &Process) -> bool {
    of_threads(process, "stat")
        // The state follows the name, which stands in brackets.
        .any(|stat| matches!(stat.rsplit_once(") "), Some((_, rest)) if rest.starts_with('R')))
}

/// What the kernel says of each of its threads.
fn of_threads(process: &Process, file: &'static str) -> impl Iterator<Item = String> {
    let threads = std::fs::read_dir(format!("/proc/{}/task", process.pid()));
    threads
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(move |thread| std::fs::read_to_string(thread.path().join(file)).ok())
}
