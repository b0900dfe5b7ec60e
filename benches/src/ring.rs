//! `ring-64`: what it costs a writer to wake the one actor of a topic that 64 observers read.
//!
//! ```text
//!   writer, core 0                     readers, core 1: an actor and 64 observers
//!                    <── ready ─────── all drained, the actor waits (mode: asleep or looking)
//!   t0  publish, ring ───────────────>
//!   t1                                 the actor wakes, everybody drains
//! ```
//!
//! Timed is `t1 - t0`, for which the writer is kept from its work. The typed ports publish and
//! ring; bare iceoryx2 publishes the same and notifies a listener for each reader (`event`), or, as
//! the typed ports do it, one listener for the actor while 64 readers poll (`event-1`).
//!
//! The cost of the ring alone is the difference between publishing on a topic with an actor and
//! publishing on one with as many readers but no actor, measured in pairs (`lager/ring`). It
//! compares with iceoryx2 notifying without publishing anything (`notify`, `notify-1`).

mod readers;
mod writer;

use core::sync::atomic::AtomicU64;
use core::time::Duration;

use lager_rig::Shareable;
use lager_rig::process::Main;
use lager_topics::{OBSERVERS, Qos, Topic};
use serde::{Deserialize, Serialize};

use crate::baseline::Fault;
use crate::error::BenchError;
use crate::group::{Entry, Group, Session, wanted};
use crate::pair::{Pair, Side};
use crate::report::{Mode, Options, Regime};
use crate::sample::{Ping, Sample};
use crate::slow;

const WRITER: &str = "writer of ring-64";
const READERS: &str = "readers of ring-64";

pub(crate) const PROCESSES: &[(&str, Main)] =
    &[(WRITER, writer::writer), (READERS, readers::readers)];

/// The same as [`Ping`], but nobody acts on it.
struct Observed;

impl Topic for Observed {
    const NAME: &'static str = "bench/observed";
    type Payload = Sample;
    const QOS: Qos = Qos {
        actors: &[],
        ..Ping::QOS
    };
    const SUMMARY: &'static str = "What observers alone read, during a measurement.";
}

/// Who rings how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Contender {
    /// The typed ports publish and ring.
    Lager,
    /// The same, less what it costs to publish where nobody is to be rung.
    Ring,
    /// Bare iceoryx2 notifies so many listeners.
    Notify(Listeners),
    /// Bare iceoryx2 publishes and then notifies so many listeners.
    Event(Listeners),
}

/// Who listens on bare iceoryx2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Listeners {
    /// Every reader.
    All,
    /// The actor; the observers poll.
    Actor,
}

impl Listeners {
    const fn count(self) -> usize {
        match self {
            Self::All => OBSERVERS + 1,
            Self::Actor => 1,
        }
    }

    /// The event and the topic; a service keeps its number of listeners.
    const fn service(self) -> &'static str {
        match self {
            Self::All => "bench/bare-ring",
            Self::Actor => "bench/bare-ring-1",
        }
    }
}

impl Contender {
    const ALL: [Self; 6] = [
        Self::Lager,
        Self::Ring,
        Self::Event(Listeners::All),
        Self::Notify(Listeners::All),
        Self::Event(Listeners::Actor),
        Self::Notify(Listeners::Actor),
    ];

    fn entry(self, mode: Mode) -> Entry {
        let (name, variant, against): (_, _, &[&str]) = match self {
            Self::Lager => ("lager", "", &["iceoryx2/event", "iceoryx2/event-1"]),
            Self::Ring => ("lager", "ring", &["iceoryx2/notify", "iceoryx2/notify-1"]),
            Self::Notify(Listeners::All) => ("iceoryx2", "notify", &[]),
            Self::Event(Listeners::All) => ("iceoryx2", "event", &[]),
            Self::Notify(Listeners::Actor) => ("iceoryx2", "notify-1", &[]),
            Self::Event(Listeners::Actor) => ("iceoryx2", "event-1", &[]),
        };
        Entry {
            name,
            variant,
            mode,
            against,
        }
    }
}

/// The groups of one regime: `block` with an actor that sleeps when it is rung, `spin` with one
/// that looks.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    let group = |mode: Mode| {
        let all = Contender::ALL.map(|contender| (contender.entry(mode), contender));
        let (entries, contenders) = wanted(all, options);
        let open = move |regime| {
            let ring = Ring {
                pair: Pair::start(regime, [WRITER, READERS], &())?,
                contenders: contenders.clone(),
                mode,
            };
            Ok(Box::new(ring) as Box<dyn Session>)
        };
        Group::new("ring-64", regime, entries, [2, 4], [100, 500], open)
    };
    [Mode::Spin, Mode::Block]
        .into_iter()
        // Nobody looks without pause on the writer's core.
        .filter(|mode| regime != Regime::SameCore || *mode == Mode::Block)
        .map(group)
        .collect()
}

/// What writer and readers share.
#[derive(Debug)]
#[repr(C)]
struct Ready {
    /// The sample that the readers are ready for.
    number: AtomicU64,
}

// SAFETY: atomics only.
#[allow(unsafe_code)]
unsafe impl Shareable for Ready {}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Round {
    contender: Contender,
    mode: Mode,
    samples: usize,
    number: u32,
    /// A deliberate slow-down of each sample, in ns.
    spin_ns: u64,
}

impl Round {
    /// The numbers of the samples; those of [`Contender::Ring`] come in pairs.
    fn all(&self) -> impl Iterator<Item = u64> {
        let base = u64::from(self.number) << 32;
        let each = match self.contender {
            Contender::Ring => 2,
            _ => 1,
        };
        (1..=each * self.samples as u64).map(move |sample| base + sample)
    }

    fn failed(&self, sample: u64, fault: Fault) -> BenchError {
        fault.of(&self.contender.entry(self.mode).label(), sample)
    }
}

struct Ring {
    pair: Pair<Ready>,
    contenders: Vec<Contender>,
    mode: Mode,
}

impl Session for Ring {
    fn round(&mut self, index: usize, samples: usize) -> Result<Vec<u64>, BenchError> {
        const PATIENCE: Duration = Duration::from_secs(60);
        let (contender, mode) = (self.contenders[index], self.mode);
        let round = |number| Round {
            contender,
            mode,
            samples,
            number,
            spin_ns: slow::spin_ns(),
        };
        self.pair.round(round, PATIENCE).map(|(times, ())| times)
    }
}

/// What each of the two has at hand.
type Own = Side<Ready, ()>;
