//! Two processes that measure rounds with each other, each on its core, and others that watch
//! ([`observer`]). `hop`, `ring-64` and `publish` use them.
//!
//! ```text
//!   session ── Round ──> first:  opens its ports ─┐  barrier ─ samples ─ barrier ─> times, in ns
//!           ── Round ──> second: opens its ports ─┘
//! ```
//!
//! Each round has new ports, so that their places in memory differ from round to round. The first
//! samples are not timed: meanwhile publisher and subscriber find each other, and caches fill.

pub(crate) mod observer;

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
use crate::rounds::Taken;
use lager_machine::Cores;

/// Rounds of each row in a run: with `--quick`, and without.
pub(crate) const ROUNDS: [usize; 2] = [2, 4];

/// The memory that both processes share beside the bus.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Memory {
    barrier: Barrier,
    /// The lane that each of the two processes writes to.
    pub(crate) lanes: Lanes<8>,
    /// The number of the sample for which the readers are ready: they have read all before it.
    pub(crate) ready: Counter,
    /// The number of the last sample that the writer has published.
    pub(crate) published: Counter,
}

// SAFETY: atomics only, and zeros are valid.
#[allow(unsafe_code)]
unsafe impl Shareable for Memory {}

/// The parent's first message to a process.
#[derive(Serialize, Deserialize)]
struct Setup {
    is_first: bool,
    /// The core to which the process is bound.
    core: usize,
    /// The bus's folder.
    folder: PathBuf,
    /// The descriptor of the shared memory.
    memory: RawFd,
    lines: Vec<[RawFd; 2]>,
}

/// The parent's message to both processes for each round.
#[derive(Serialize, Deserialize)]
pub(crate) struct Round<X> {
    /// The number of the round, from 1.
    pub(crate) number: u32,
    /// The number of samples before the first timed one.
    warm_up: u32,
    /// The number of timed samples.
    samples: u32,
    /// The name of the carrier, for the sentences of errors.
    contender: String,
    /// The measurement.
    pub(crate) what: X,
}

impl<X> Round<X> {
    /// The numbers of all samples, unique within a measurement.
    pub(crate) fn all(&self) -> impl Iterator<Item = u64> + use<X> {
        let base = u64::from(self.number) << 32;
        (1..=u64::from(self.warm_up) + u64::from(self.samples)).map(move |sample| base + sample)
    }

    /// Whether sample `number` is the first timed one.
    pub(crate) fn is_first_timed(&self, number: u64) -> bool {
        number & u64::from(u32::MAX) == u64::from(self.warm_up) + 1
    }

    /// The error of sample `number`.
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

/// What one of the two processes has noted of a round's samples.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Noted {
    /// The time of each sample, in ns. If both processes note some, readings of the clock: when it
    /// was sent and when it was received.
    pub(crate) times: Vec<u64>,
    /// When each was due, and the time between two that are, if there is a plan; in ns.
    pub(crate) due: Option<(Vec<u64>, u64)>,
}

impl From<Vec<u64>> for Noted {
    fn from(times: Vec<u64>) -> Self {
        Self { times, due: None }
    }
}

/// What a round measures.
pub(crate) trait Work: Serialize {
    /// The processes that only watch meanwhile: how many, and the size of a sample in words.
    fn observers(&self) -> (usize, usize) {
        (0, 0)
    }
}

/// Both processes, and the measurement of each row. The fields are dropped in this order, so no
/// process is on the bus when it is removed.
struct Pair<X> {
    first: Process,
    second: Process,
    /// Those that only watch, if a row has any; each sleeps while it is not told to watch.
    observers: Vec<Process>,
    _memory: Shared<Memory>,
    domain: Domain,
    rows: Vec<(Entry, X)>,
    /// The time from one sample to the next that is due.
    gap: Duration,
    rounds: u32,
}

/// Starts both processes on their cores, which inherit `lines`, to measure `rows`, whose samples are
/// due `gap` apart.
pub(crate) fn open<X: Work + 'static>(
    cores: Cores,
    gap: Duration,
    [first, second]: [&str; 2],
    lines: &[[OwnedFd; 2]],
    rows: Vec<(Entry, X)>,
) -> Opened {
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
        observers: Vec::new(),
        _memory: memory,
        domain,
        rows,
        gap,
        rounds: 0,
    }))
}

impl<X> Pair<X> {
    /// Starts observers until there are so many.
    fn start_observers(&mut self, many: usize) -> Result<(), BenchError> {
        while self.observers.len() < many {
            let mut observer = Process::start(observer::NAME)?;
            let () = observer.ask(&self.domain.folder())?;
            self.observers.push(observer);
        }
        Ok(())
    }
}

impl<X: Work> Session for Pair<X> {
    /// The first process's times. If the second process notes times, both note readings of the
    /// clock, and the result is the time from the first's to the second's.
    fn round(&mut self, index: usize, samples: usize) -> Result<Taken, BenchError> {
        // Each process ends a wait by itself, except a bare `read`, which has no time-out. For that
        // one the parent waits ten times as long for a sample as the slowest machine should need.
        const SAMPLE: Duration = Duration::from_millis(1);
        self.rounds += 1;
        let (watching, words) = self.rows[index].1.observers();
        self.start_observers(watching)?;
        for observer in &mut self.observers[..watching] {
            let () = observer.ask(&words)?;
        }
        let (entry, what) = &self.rows[index];
        let samples = u32::try_from(samples).unwrap_or(u32::MAX);
        let round = Round {
            number: self.rounds,
            warm_up: samples / 10 + 10,
            samples,
            contender: format!("{} {}", entry.label, entry.mode),
            what,
        };
        let limit = Duration::from_secs(60) + (SAMPLE + self.gap) * (round.warm_up + samples);
        self.first.tell(&round);
        self.second.tell(&round);
        let (sent, received): (Noted, Noted) =
            Process::both(&mut self.first, &mut self.second, limit)?;
        for observer in &mut self.observers[..watching] {
            let () = observer.ask(&())?;
        }
        let mut taken = Taken::default();
        if received.times.is_empty() {
            taken.service = sent.times;
            return Ok(taken);
        }
        assert_eq!(sent.times.len(), received.times.len(), "a time at each end");
        let ways = sent.times.into_iter().zip(received.times);
        if let Some((due, period)) = sent.due {
            let all = due.into_iter().zip(ways);
            let sample = |(due, (sent, received))| [due, sent, received];
            return Ok(Taken::paced(period, all.map(sample)));
        }
        ways.for_each(|(sent, received)| taken.add(None, sent, received));
        Ok(taken)
    }
}

/// One of the two processes: binds itself to its core, and measures the parent's rounds.
pub(crate) fn measure<X: DeserializeOwned>(
    parent: &mut Parent,
    round: fn(&Side, &Round<X>) -> Result<Noted, BenchError>,
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
        let mut noted = round(&side, &told)?;
        // The times of the warm-up samples do not count.
        if !noted.times.is_empty() {
            noted.times.drain(..told.warm_up as usize);
        }
        parent.say(&noted)?;
    }
    Ok(())
}

/// What one of the two processes keeps during all rounds.
pub(crate) struct Side {
    pub(crate) is_first: bool,
    pub(crate) shared: Shared<Memory>,
    pub(crate) config: BusConfig,
    pub(crate) lines: Vec<[OwnedFd; 2]>,
}

impl Side {
    /// Waits until `counter` has reached sample `number`.
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
