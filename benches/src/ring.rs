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

use core::time::Duration;

use lager_rig::process::Main;
use lager_topics::{OBSERVERS, Qos, Topic};
use serde::{Deserialize, Serialize};

use crate::group::{Entry, Group, wanted};
use crate::pair::{self, Pair};
use crate::report::{Mode, Options, Regime};
use crate::sample::{Ping, Sample};
use crate::turns::Turns;

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
        Entry::new(name, variant, mode, against)
    }
}

/// The groups of one regime: `block` with an actor that sleeps when it is rung, `spin` with one
/// that looks.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    let group = |mode: Mode| {
        let job = |contender: Contender| (contender.entry(mode), Job { contender, mode });
        let rows = wanted(Contender::ALL.map(job), options);
        Group::new(
            "ring-64",
            regime,
            rows,
            [2, 4],
            [100, 500],
            |regime, rows| {
                let ends = [WRITER, READERS];
                let pair = Pair::<Turns, _>::start(regime, ends, &(), rows, Duration::ZERO)?;
                Ok(Box::new(pair))
            },
        )
    };
    [Mode::Spin, Mode::Block]
        .into_iter()
        // Nobody looks without pause on the writer's core.
        .filter(|mode| regime != Regime::SameCore || *mode == Mode::Block)
        .map(group)
        .collect()
}

/// What is measured in a round.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Job {
    contender: Contender,
    mode: Mode,
}

type Round = pair::Round<Job>;

/// The samples of a round; those of [`Contender::Ring`] come in pairs.
fn samples(round: &Round) -> impl Iterator<Item = u64> {
    let each = match round.what.contender {
        Contender::Ring => 2,
        _ => 1,
    };
    round
        .all()
        .flat_map(move |sample| (0..each).map(move |part| 2 * sample + part))
}

/// What each of the two has at hand.
type Own = pair::Side<Turns, ()>;
