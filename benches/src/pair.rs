//! Two processes that measure rounds with each other, each on its core: what `hop`, `ring-64` and
//! `publish` have in common.
//!
//! ```text
//!   session ── Round ──> first:  opens its ports ─┐  barrier ─ samples ─ barrier ─> times, in ns
//!           ── Round ──> second: opens its ports ─┘
//! ```
//!
//! Each round has ports of its own, so that what a place in memory does to the times differs from
//! round to round. Its first samples are not timed: ports meet with them, and caches fill.

use core::time::Duration;
use std::error::Error;
use std::os::fd::{AsRawFd, OwnedFd, RawFd};
use std::path::PathBuf;

use lager_ports::{Bus, BusConfig};
use lager_rig::schedule::pin;
use lager_rig::{Barrier, Counter, Domain, Parent, Process, Shareable, Shared, bus_at, inherit};
use lager_topics::Role;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::baseline::LIMIT;
use crate::baseline::memory::Lanes;
use crate::error::{BenchError, Fault, no_bus};
use crate::group::{Entry, Opened, Session};
use crate::machine;
use crate::report::Regime;
use crate::slow;

/// Rounds of each row in a run: quick, and in full.
pub(crate) const ROUNDS: [usize; 2] = [2, 4];

/// What both processes see without a bus.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Memory {
    barrier: Barrier,
    /// What each of the two writes into.
    pub(crate) lanes: Lanes<8>,
    /// The sample that the readers are ready for: they have all that came before.
    pub(crate) ready: Counter,
    /// The last sample that the writer has published.
    pub(crate) published: Counter,
}

// SAFETY: atomics only, and zeros are valid.
#[allow(unsafe_code)]
unsafe impl Shareable for Memory {}

/// What a process is told once.
#[derive(Serialize, Deserialize)]
struct Setup {
    is_first: bool,
    /// The core to stay on.
    core: usize,
    /// The bus's folder.
    folder: PathBuf,
    /// The number of the memory.
    memory: RawFd,
    lines: Vec<[RawFd; 2]>,
}

/// What both processes are told for each round.
#[derive(Serialize, Deserialize)]
pub(crate) struct Round<X> {
    /// Which round it is, from 1.
    pub(crate) number: u32,
    /// Samples that are sent before any is timed.
    warm_up: u32,
    /// Samples that are timed.
    samples: u32,
    /// A deliberate slow-down of each sample, in ns.
    spin_ns: u64,
    /// What carries the samples, for the sentences of errors.
    contender: String,
    /// What is measured.
    pub(crate) what: X,
}

impl<X> Round<X> {
    /// The numbers of all samples, unique within a measurement.
    pub(crate) fn all(&self) -> impl Iterator<Item = u64> + use<X> {
        let base = u64::from(self.number) << 32;
        (1..=u64::from(self.warm_up) + u64::from(self.samples)).map(move |sample| base + sample)
    }

    /// What is wrong with sample `number`.
    pub(crate) fn failed(&self, number: u64, fault: Fault) -> BenchError {
        let in_round = |number: u64| number & u64::from(u32::MAX);
        BenchError::Failed {
            contender: self.contender.clone(),
            sample: in_round(number),
            fault: match fault {
                Fault::Wrong(got) => Fault::Wrong(in_round(got)),
                other => other,
            },
        }
    }
}

/// Both processes, and what they measure for each row. Dropped in this order: nobody is on the bus
/// when it is swept.
struct Pair<X> {
    first: Process,
    second: Process,
    _memory: Shared<Memory>,
    _domain: Domain,
    rows: Vec<(Entry, X)>,
    rounds: u32,
}

/// Starts both processes, with `lines` that they inherit, to measure `rows`.
pub(crate) fn open<X: Serialize + 'static>(
    regime: Regime,
    [first, second]: [&str; 2],
    lines: &[[OwnedFd; 2]],
    rows: Vec<(Entry, X)>,
) -> Opened {
    let cores = machine::cores_for(regime)?;
    let domain = Domain::new(crate::FAMILY)?;
    let memory = Shared::<Memory>::new()?;
    let start = |name, is_first, core| {
        let mut process = Process::start(name)?;
        let numbers = |line: &[OwnedFd; 2]| line.each_ref().map(OwnedFd::as_raw_fd);
        let () = process.ask(&Setup {
            is_first,
            core,
            folder: domain.folder().to_owned(),
            memory: memory.number(),
            lines: lines.iter().map(numbers).collect(),
        })?;
        Ok::<Process, BenchError>(process)
    };
    Ok(Box::new(Pair {
        first: start(first, true, cores.0)?,
        second: start(second, false, cores.1)?,
        _memory: memory,
        _domain: domain,
        rows,
        rounds: 0,
    }))
}

impl<X: Serialize> Session for Pair<X> {
    /// The first process's times. If the second has any, they are when it received what the first
    /// sent at its times.
    fn round(&mut self, index: usize, samples: usize) -> Result<Vec<u64>, BenchError> {
        // Both give up by themselves when nothing comes; this is for those that cannot, because
        // a bare `read` has no time-out: ten times what the slowest machine should need.
        const SAMPLE: Duration = Duration::from_millis(1);
        self.rounds += 1;
        let (entry, what) = &self.rows[index];
        let samples = u32::try_from(samples).unwrap_or(u32::MAX);
        let round = Round {
            number: self.rounds,
            warm_up: samples / 10 + 10,
            samples,
            spin_ns: slow::spin_ns(),
            contender: format!("{} {}", entry.label, entry.mode),
            what,
        };
        let limit = Duration::from_secs(60) + SAMPLE * (round.warm_up + samples);
        self.first.tell(&round);
        self.second.tell(&round);
        let (sent, received): (Vec<u64>, Vec<u64>) =
            Process::both(&mut self.first, &mut self.second, limit)?;
        if received.is_empty() {
            return Ok(sent);
        }
        assert_eq!(sent.len(), received.len(), "a time at each end for each");
        let way = |(sent, received): (u64, u64)| received.saturating_sub(sent);
        Ok(sent.into_iter().zip(received).map(way).collect())
    }
}

/// One of the two: takes its place, and measures rounds as long as the parent wants any.
pub(crate) fn measure<X: DeserializeOwned>(
    parent: &mut Parent,
    round: fn(&Side, &Round<X>) -> Result<Vec<u64>, BenchError>,
) -> Result<(), Box<dyn Error>> {
    let setup: Setup = parent.told()?;
    pin(setup.core)?;
    let side = Side {
        is_first: setup.is_first,
        shared: Shared::inherited(setup.memory)?,
        config: bus_at(setup.folder),
        lines: setup.lines.iter().map(|line| line.map(inherit)).collect(),
    };
    parent.say(&())?;
    while let Some(told) = parent.hear::<Round<X>>()? {
        slow::spins_for(told.spin_ns);
        let times = round(&side, &told)?;
        // Those of the first samples do not count.
        let counted: &[u64] = match &*times {
            [] => &[],
            times => &times[told.warm_up as usize..],
        };
        parent.say(&counted)?;
    }
    Ok(())
}

/// What one of the two has at hand all the time.
pub(crate) struct Side {
    pub(crate) is_first: bool,
    pub(crate) shared: Shared<Memory>,
    pub(crate) config: BusConfig,
    pub(crate) lines: Vec<[OwnedFd; 2]>,
}

impl Side {
    /// Waits until `counter` is at sample `number`.
    pub(crate) fn wait(&self, counter: &Counter, number: u64) -> Result<(), Fault> {
        let comes = counter.becomes(number, LIMIT);
        comes.then_some(()).ok_or(Fault::Silent(LIMIT))
    }

    pub(crate) fn bus(&self, role: Role) -> Result<Bus, BenchError> {
        Bus::open(&self.config, role).map_err(no_bus)
    }

    /// Runs `work` when the other process is ready for `round`, and returns when both are done.
    pub(crate) fn together<X, T>(
        &self,
        round: &Round<X>,
        work: impl FnOnce() -> Result<T, BenchError>,
    ) -> Result<T, BenchError> {
        const LIMIT: Duration = Duration::from_secs(15);
        let meet = |count| {
            let met = self.shared.barrier.pass(2, count, LIMIT);
            met.then_some(()).ok_or(BenchError::Alone(LIMIT))
        };
        meet(2 * round.number - 1)?;
        let done = work()?;
        meet(2 * round.number)?;
        Ok(done)
    }
}
