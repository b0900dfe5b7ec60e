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
use std::os::fd::RawFd;
use std::path::PathBuf;

use lager_ports::{Bus, BusConfig};
use lager_rig::{Barrier, Domain, Parent, Process, Shareable, Shared, bus_at};
use lager_topics::Role;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::baseline::Fault;
use crate::error::{BenchError, no_bus};
use crate::group::{Entry, Session};
use crate::machine;
use crate::report::Regime;
use crate::slow;

/// What both processes see without a bus.
#[derive(Debug)]
#[repr(C)]
struct Memory<M> {
    barrier: Barrier,
    more: M,
}

// SAFETY: a barrier is shareable, as is what is beside it.
#[allow(unsafe_code)]
unsafe impl<M: Shareable> Shareable for Memory<M> {}

/// What a process is told once.
#[derive(Serialize, Deserialize)]
struct Setup<S> {
    /// The core to stay on.
    core: usize,
    /// The bus's folder.
    folder: PathBuf,
    /// The number of the memory.
    memory: RawFd,
    more: S,
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
    pub(crate) fn all(&self) -> impl Iterator<Item = u64> {
        let base = u64::from(self.number) << 32;
        (1..=u64::from(self.warm_up) + u64::from(self.samples)).map(move |sample| base + sample)
    }

    /// Of the times of all samples, those that count.
    pub(crate) fn timed(&self, mut times: Vec<u64>) -> Vec<u64> {
        times.drain(..self.warm_up as usize);
        times
    }

    /// That sample `expected` did not come.
    pub(crate) fn failed(&self, expected: u64, fault: Fault) -> BenchError {
        fault.of(&self.contender, expected)
    }

    /// That sample `got` came in the place of `expected`.
    pub(crate) fn wrong(&self, expected: u64, got: u64) -> BenchError {
        BenchError::WrongSample {
            contender: self.contender.clone(),
            expected: expected & u64::from(u32::MAX),
            got: got & u64::from(u32::MAX),
        }
    }
}

/// Both processes, and what they measure for each row. Dropped in this order: nobody is on the bus
/// when it is swept.
pub(crate) struct Pair<M: Shareable, X> {
    first: Process,
    second: Process,
    _memory: Shared<Memory<M>>,
    _domain: Domain,
    rows: Vec<(Entry, X)>,
    gap: Duration,
    rounds: u32,
}

impl<M: Shareable, X> Pair<M, X> {
    /// Starts both, and tells them `more`. They measure `rows`, with `gap` from one sample to the
    /// next.
    pub(crate) fn start(
        regime: Regime,
        [first, second]: [&str; 2],
        more: &impl Serialize,
        rows: Vec<(Entry, X)>,
        gap: Duration,
    ) -> Result<Self, BenchError> {
        let cores = machine::cores_for(regime)?;
        let domain = Domain::new(crate::FAMILY)?;
        let memory = Shared::<Memory<M>>::new()?;
        let start = |name, core| {
            let mut process = Process::start(name)?;
            let () = process.ask(&Setup {
                core,
                folder: domain.folder().to_owned(),
                memory: memory.number(),
                more,
            })?;
            Ok::<Process, BenchError>(process)
        };
        Ok(Self {
            first: start(first, cores.0)?,
            second: start(second, cores.1)?,
            _memory: memory,
            _domain: domain,
            rows,
            gap,
            rounds: 0,
        })
    }
}

impl<M: Shareable, X: Serialize> Session for Pair<M, X> {
    /// The first process's times. If the second has any, they are when it received what the first
    /// sent at its times.
    fn round(&mut self, index: usize, samples: usize) -> Result<Vec<u64>, BenchError> {
        self.rounds += 1;
        let (entry, what) = &self.rows[index];
        let samples = u32::try_from(samples).unwrap_or(u32::MAX);
        let round = Round {
            number: self.rounds,
            warm_up: samples / 10 + 10,
            samples,
            spin_ns: slow::spin_ns(),
            contender: format!("{} {}", entry.label(), entry.mode),
            what,
        };
        // Both give up by themselves when nothing comes; this is for those that cannot, because
        // a bare `read` has no time-out: ten times what the slowest machine should need.
        let limit = Duration::from_secs(60)
            + (self.gap + Duration::from_micros(500)) * (round.warm_up + samples);
        self.first.tell(&round);
        self.second.tell(&round);
        let (sent, received): (Vec<u64>, Vec<u64>) =
            Process::both(&mut self.first, &mut self.second, limit)?;
        if received.is_empty() {
            return Ok(sent);
        }
        let ways = sent.iter().zip(&received);
        Ok(ways
            .map(|(sent, received)| received.saturating_sub(*sent))
            .collect())
    }
}

/// One of the two: takes its place, and measures rounds as long as the parent wants any. `open`
/// makes what it has at hand in all of them.
pub(crate) fn measure<M, S, X, C>(
    parent: &mut Parent,
    open: impl FnOnce(Side<M, S>) -> C,
    round: impl Fn(&C, &Round<X>) -> Result<Vec<u64>, BenchError>,
) -> Result<(), Box<dyn Error>>
where
    M: Shareable,
    S: DeserializeOwned,
    X: DeserializeOwned,
{
    let Some(setup) = parent.hear::<Setup<S>>()? else {
        return Ok(());
    };
    machine::pin(setup.core)?;
    let at_hand = open(Side {
        memory: Shared::inherited(setup.memory)?,
        config: bus_at(setup.folder),
        more: setup.more,
    });
    parent.say(&())?;
    while let Some(told) = parent.hear::<Round<X>>()? {
        slow::spins_for(told.spin_ns);
        parent.say(&round(&at_hand, &told)?)?;
    }
    Ok(())
}

/// What one of the two has at hand all the time.
pub(crate) struct Side<M: Shareable, S> {
    memory: Shared<Memory<M>>,
    pub(crate) config: BusConfig,
    pub(crate) more: S,
}

impl<M: Shareable, S> Side<M, S> {
    /// What both see without a bus.
    pub(crate) fn memory(&self) -> &M {
        &self.memory.more
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
        let meet = |count| match self.memory.barrier.pass(2, count, LIMIT) {
            true => Ok(()),
            false => Err(BenchError::Alone { limit: LIMIT }),
        };
        meet(2 * round.number - 1)?;
        let done = work()?;
        meet(2 * round.number)?;
        Ok(done)
    }
}
