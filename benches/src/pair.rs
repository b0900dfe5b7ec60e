//! Two processes that measure rounds with each other, each on its core: what `hop` and `ring-64`
//! have in common.
//!
//! Each round has ports of its own, so that what a place in memory does to the times differs from
//! round to round.

use core::time::Duration;
use std::os::fd::RawFd;
use std::path::PathBuf;

use lager_ports::{Bus, BusConfig};
use lager_rig::{Barrier, Domain, Parent, Process, Shareable, Shared, bus_at};
use lager_topics::Role;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::{BenchError, no_bus};
use crate::machine;
use crate::report::Regime;

/// What both processes see without a bus.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Memory<M> {
    barrier: Barrier,
    more: M,
}

// SAFETY: a barrier is shareable, as is what is beside it.
#[allow(unsafe_code)]
unsafe impl<M: Shareable> Shareable for Memory<M> {}

/// What a process is told once.
#[derive(Serialize, Deserialize)]
struct Setup<X> {
    /// The core to stay on.
    core: usize,
    /// The bus's folder.
    folder: PathBuf,
    /// The number of the memory.
    memory: RawFd,
    more: X,
}

/// Both processes. Dropped in this order: nobody is on the bus when it is swept.
pub(crate) struct Pair<M: Shareable> {
    first: Process,
    second: Process,
    _memory: Shared<Memory<M>>,
    _domain: Domain,
    rounds: u32,
}

impl<M: Shareable> Pair<M> {
    /// Starts both, and tells them `more`.
    pub(crate) fn start(
        regime: Regime,
        [first, second]: [&str; 2],
        more: &impl Serialize,
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
            rounds: 0,
        })
    }

    /// Tells both the round that `what` makes of its number, from 1, and hears what they say of it
    /// within `limit`.
    pub(crate) fn round<R: Serialize, A: DeserializeOwned, B: DeserializeOwned>(
        &mut self,
        what: impl FnOnce(u32) -> R,
        limit: Duration,
    ) -> Result<(A, B), BenchError> {
        self.rounds += 1;
        let round = what(self.rounds);
        self.first.tell(&round);
        self.second.tell(&round);
        Ok(Process::both(&mut self.first, &mut self.second, limit)?)
    }
}

/// What one of the two has at hand all the time.
pub(crate) struct Side<M: Shareable, X> {
    memory: Shared<Memory<M>>,
    pub(crate) config: BusConfig,
    pub(crate) more: X,
}

impl<M: Shareable, X: DeserializeOwned> Side<M, X> {
    /// What the parent has told; `None` if it is gone.
    pub(crate) fn enter(parent: &mut Parent) -> Result<Option<Self>, BenchError> {
        let Some(setup) = parent.hear::<Setup<X>>()? else {
            return Ok(None);
        };
        machine::pin(setup.core)?;
        let side = Self {
            memory: Shared::inherited(setup.memory)?,
            config: bus_at(setup.folder),
            more: setup.more,
        };
        parent.say(&())?;
        Ok(Some(side))
    }

    /// What both see without a bus.
    pub(crate) fn memory(&self) -> &M {
        &self.memory.more
    }

    pub(crate) fn bus(&self, role: Role) -> Result<Bus, BenchError> {
        Bus::open(&self.config, role).map_err(no_bus)
    }

    /// Runs `work` of round number `number` when the other process is ready, and returns when both
    /// are done.
    pub(crate) fn together<T>(
        &self,
        number: u32,
        work: impl FnOnce() -> Result<T, BenchError>,
    ) -> Result<T, BenchError> {
        const LIMIT: Duration = Duration::from_secs(15);
        let meet = |count| match self.memory.barrier.pass(2, count, LIMIT) {
            true => Ok(()),
            false => Err(BenchError::Alone { limit: LIMIT }),
        };
        meet(2 * number - 1)?;
        let done = work()?;
        meet(2 * number)?;
        Ok(done)
    }
}
