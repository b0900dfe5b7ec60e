//! `fanout`: what publishing costs the writer when 1, 8 or 64 read.
//!
//! ```text
//!   | loan, fill in, send |  announce -----> all subscribers receive --+
//!   |<---- measured ----->|  wait until drained <----------------------+
//! ```
//!
//! Our typed ports and bare iceoryx2 with the same user header, the same limits and the same
//! number of subscribers, in turn. Both fill in the whole payload from memory of their own. The
//! subscribers live in a process of their own on the other core and are drained after each
//! publish, so that no buffer is ever full and the writer finds its queues as readers leave them.
//!
//! Rows are called `publish-64` for 64 bytes to 64 subscribers, `publish-8@1MiB`, and so on.

mod block;
mod readers;

use core::fmt;
use core::sync::atomic::Ordering;
use core::time::Duration;
use std::time::Instant;

use iceoryx2::port::publisher::Publisher as BarePublisher;
use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use lager_ports::{Bus, Clock, Publisher};
use lager_rig::{Domain, Process, Shared, interrupted};
use lager_topics::{Role, Stamp, Topic};

use crate::baseline::iceoryx::{Header, Member, Stream};
use crate::error::BenchError;
use crate::group::{self, Entry, Group};
use crate::machine::{Bound, cores_for};
use crate::report::{Mode, Options, Regime};
use crate::slow;
use block::{Block, Fan};
use readers::{Counter, LIMIT, READERS, Setup};

pub(crate) use readers::PROCESSES;

/// Sizes of a block, in words of eight bytes.
const SMALL: usize = 8;
const KIB_64: usize = 1 << 13;
const MIB_1: usize = 1 << 17;

/// How many subscribers there are.
const READERS_OF: [usize; 3] = [1, 8, 64];

/// Who publishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contender {
    /// Our typed ports.
    Lager,
    /// Bare iceoryx2 with the same user header.
    Iceoryx2,
}

impl Contender {
    const ALL: [Self; 2] = [Self::Lager, Self::Iceoryx2];

    const fn entry(self) -> Entry {
        let (name, variant, against): (_, _, &[&str]) = match self {
            Self::Lager => ("lager", "", &["iceoryx2/header"]),
            Self::Iceoryx2 => ("iceoryx2", "header", &[]),
        };
        Entry {
            name,
            variant,
            mode: Mode::Spin,
            against,
        }
    }
}

/// The groups of one regime. The readers look without pause, so the only mode there is is `spin`.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    let sizes = |readers| {
        [
            group::<SMALL>("", readers, [500, 2_000], regime, options),
            group::<KIB_64>("@64KiB", readers, [75, 300], regime, options),
            group::<MIB_1>("@1MiB", readers, [12, 50], regime, options),
        ]
    };
    READERS_OF.into_iter().flat_map(sizes).collect()
}

/// Both contenders with one size and one number of readers.
fn group<const WORDS: usize>(
    size: &str,
    readers: usize,
    publishes: [usize; 2],
    regime: Regime,
    options: &Options,
) -> Group {
    let all = Contender::ALL.map(|contender| (contender.entry(), contender));
    let (entries, contenders) = group::wanted(all, options);
    let what = format!("publish-{readers}{size}");
    Group::new(what, regime, entries, [2, 4], publishes, move |regime| {
        let session = Session::<WORDS>::open(regime, readers, contenders.clone())?;
        Ok(Box::new(session))
    })
}

/// A writer of each contender and the process of their readers. The thread is bound to a core
/// meanwhile.
struct Session<const WORDS: usize> {
    contenders: Vec<Contender>,
    ours: Publisher<Fan<WORDS>>,
    bare: BarePublisher<ipc::Service, Block<WORDS>, Stamp>,
    stream: Stream,
    source: Box<Block<WORDS>>,
    counter: Shared<Counter>,
    number: u64,
    observers: usize,
    // Dropped in this order: nobody is on the bus when it is swept.
    readers: Process,
    _member: Member,
    _bus: Bus,
    _bound: Bound,
    _domain: Domain,
}

impl<const WORDS: usize> Session<WORDS> {
    /// Starts the readers and attaches them to both contenders.
    fn open(
        regime: Regime,
        readers: usize,
        contenders: Vec<Contender>,
    ) -> Result<Self, BenchError> {
        let (first, second) = cores_for(regime)?;
        let domain = Domain::new(crate::FAMILY)?;
        let counter = Shared::<Counter>::new()?;
        let bus = Bus::open(&domain.config(), Role::Operator).map_err(failed)?;
        let member = Member::join(&domain.config())?;
        let ours = bus.publisher().map_err(failed)?;
        let bare = bare_service::<WORDS>(&member)?
            .publisher_builder()
            .create()
            .map_err(failed)?;
        let mut process = Process::start(READERS)?;
        let () = process.ask(&Setup {
            core: second,
            folder: domain.folder().to_owned(),
            words: WORDS,
            readers,
            counter: counter.number(),
        })?;
        let mut session = Self {
            contenders,
            ours,
            bare,
            stream: Stream::new(),
            source: source(),
            counter,
            number: 0,
            observers: readers,
            readers: process,
            _member: member,
            _bus: bus,
            _bound: Bound::to(first)?,
            _domain: domain,
        };
        // The first sample connects the ports, which takes long.
        for contender in Contender::ALL {
            session.publish(contender, 20)?;
        }
        Ok(session)
    }

    /// Publishes `count` blocks; how long each took, in ns.
    fn publish(&mut self, contender: Contender, count: usize) -> Result<Vec<u64>, BenchError> {
        let mut times = Vec::with_capacity(count);
        for _ in 0..count {
            self.number += 1;
            self.source.words[0] = self.number;
            let start = Clock::monotonic_ns();
            match contender {
                Contender::Lager => self.publish_ours()?,
                Contender::Iceoryx2 => self.publish_bare()?,
            }
            let end = Clock::monotonic_ns();
            times.push(end - start);
            self.wait_until_drained(contender)?;
        }
        Ok(times)
    }

    fn publish_ours(&mut self) -> Result<(), BenchError> {
        let mut loan = self.ours.loan_uninit().map_err(failed)?;
        loan.words.copy_from_slice(&self.source.words);
        slow::publish(self.observers);
        loan.send().map_err(failed)
    }

    #[allow(unsafe_code)]
    fn publish_bare(&mut self) -> Result<(), BenchError> {
        let mut sample = self.bare.loan_uninit().map_err(failed)?;
        sample.user_header_mut().fill(self.number, &self.stream);
        sample.payload_mut().write(*self.source);
        // SAFETY: the payload was written just now.
        let sample = unsafe { sample.assume_init() };
        sample.send().map_err(failed)?;
        Ok(())
    }

    fn wait_until_drained(&mut self, contender: Contender) -> Result<(), BenchError> {
        // Looking at the clock and for signals costs more than looking at a word.
        const LOOKS: u32 = 1_000;
        let announced = 2 * self.number + u64::from(contender == Contender::Iceoryx2);
        self.counter.published.store(announced, Ordering::Release);
        let start = Instant::now();
        loop {
            for _ in 0..LOOKS {
                if self.counter.drained.load(Ordering::Acquire) == announced {
                    return Ok(());
                }
                // The readers may be on this core.
                rustix::thread::sched_yield();
            }
            if interrupted() {
                return Err(BenchError::Interrupted);
            }
            if start.elapsed() > LIMIT + Duration::from_secs(1) {
                let () = self.readers.hear_within(Duration::ZERO)?;
            }
        }
    }
}

impl<const WORDS: usize> group::Session for Session<WORDS> {
    fn round(&mut self, index: usize, samples: usize) -> Result<Vec<u64>, BenchError> {
        self.publish(self.contenders[index], samples)
    }
}

/// A block that is not all zeros, on the heap from the start.
fn source<const WORDS: usize>() -> Box<Block<WORDS>> {
    let mut block = Box::<Block<WORDS>>::default();
    for (index, word) in block.words.iter_mut().enumerate() {
        *word = index as u64;
    }
    block
}

/// Bare iceoryx2's topic for blocks of that size, with the limits of ours.
fn bare_service<const WORDS: usize>(
    member: &Member,
) -> Result<PortFactory<ipc::Service, Block<WORDS>, Stamp>, BenchError> {
    member.topic("bench/bare-fan", Some(&Fan::<WORDS>::QOS))
}

fn failed(error: impl fmt::Debug) -> BenchError {
    BenchError::Bus {
        what: "publishing to many readers",
        detail: format!("{error:?}"),
    }
}
