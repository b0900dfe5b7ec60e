//! The process of those who read: every subscriber of both contenders, drained after each publish.

use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;
use std::error::Error;
use std::os::fd::RawFd;
use std::path::PathBuf;
use std::time::Instant;

use iceoryx2::port::subscriber::Subscriber as BareSubscriber;
use iceoryx2::prelude::ipc;
use lager_ports::{Bus, Subscriber};
use lager_rig::process::Main;
use lager_rig::{Parent, Shareable, Shared, bus_at};
use lager_topics::{Role, Stamp};
use serde::{Deserialize, Serialize};

use super::block::{Block, Fan};
use super::{KIB_64, MIB_1, SMALL, bare_service, failed};
use crate::baseline::iceoryx::Member;
use crate::error::BenchError;
use crate::machine;

/// The process's name.
pub(super) const READERS: &str = "readers of the fan-out";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(READERS, read)];

/// How long a reader waits for what was announced, and a writer for its readers.
pub(super) const LIMIT: Duration = Duration::from_secs(5);

/// What writer and readers share.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct Counter {
    /// Which block was published last, twice, plus 1 if it was bare iceoryx2's.
    pub(super) published: AtomicU64,
    _apart: [AtomicU64; 7],
    /// The same, when all subscribers have it.
    pub(super) drained: AtomicU64,
}

// SAFETY: atomics only, and zeros are valid.
#[allow(unsafe_code)]
unsafe impl Shareable for Counter {}

/// What the readers are told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Setup {
    pub(super) core: usize,
    pub(super) folder: PathBuf,
    pub(super) words: usize,
    pub(super) readers: usize,
    pub(super) counter: RawFd,
}

fn read(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let Some(setup) = parent.hear::<Setup>()? else {
        return Ok(());
    };
    machine::pin(setup.core)?;
    match setup.words {
        SMALL => Readers::<SMALL>::attach(&setup)?.read(parent, &setup),
        KIB_64 => Readers::<KIB_64>::attach(&setup)?.read(parent, &setup),
        _ => Readers::<MIB_1>::attach(&setup)?.read(parent, &setup),
    }
}

/// All subscribers of both contenders.
struct Readers<const WORDS: usize> {
    ours: Vec<Subscriber<Fan<WORDS>>>,
    bare: Vec<BareSubscriber<ipc::Service, Block<WORDS>, Stamp>>,
    // The bare ports need it to live.
    _member: Member,
}

impl<const WORDS: usize> Readers<WORDS> {
    fn attach(setup: &Setup) -> Result<Self, BenchError> {
        let config = bus_at(&setup.folder);
        let bus = Bus::open(&config, Role::Observer).map_err(failed)?;
        let member = Member::join(&config)?;
        let service = bare_service::<WORDS>(&member)?;
        let one = |_| service.subscriber_builder().create();
        Ok(Self {
            ours: (0..setup.readers)
                .map(|_| bus.subscriber().map_err(failed))
                .collect::<Result<_, _>>()?,
            bare: (0..setup.readers)
                .map(one)
                .collect::<Result<_, _>>()
                .map_err(failed)?,
            _member: member,
        })
    }

    /// Reads whatever is announced, until the process is killed.
    fn read(mut self, parent: &mut Parent, setup: &Setup) -> Result<(), Box<dyn Error>> {
        let counter = Shared::<Counter>::inherited(setup.counter)?;
        parent.say(&())?;
        let mut seen = 0;
        loop {
            let published = counter.published.load(Ordering::Acquire);
            if published == seen {
                // The writer may be on this core.
                rustix::thread::sched_yield();
                continue;
            }
            seen = published;
            let number = published / 2;
            if published % 2 == 0 {
                for subscriber in &mut self.ours {
                    drain(number, || {
                        let sample = subscriber.receive().map_err(failed)?;
                        Ok(sample.map(|sample| sample.words[0]))
                    })?;
                }
            } else {
                for subscriber in &self.bare {
                    drain(number, || {
                        let sample = subscriber.receive().map_err(failed)?;
                        Ok(sample.map(|sample| sample.payload().words[0]))
                    })?;
                }
            }
            counter.drained.store(published, Ordering::Release);
        }
    }
}

/// Receives until block `number` has come.
fn drain(
    number: u64,
    mut receive: impl FnMut() -> Result<Option<u64>, BenchError>,
) -> Result<(), BenchError> {
    let mut start = None;
    loop {
        match receive()? {
            Some(got) if got == number => return Ok(()),
            // What was published while subscribers came is older.
            Some(_) => {}
            None if start.get_or_insert_with(Instant::now).elapsed() > LIMIT => {
                return Err(BenchError::NoSample {
                    contender: READERS.to_owned(),
                    expected: number,
                    limit: LIMIT,
                });
            }
            None => {}
        }
    }
}
