//! `fanout`: what publishing costs the writer when 1, 8 or 64 read.
//!
//! ```text
//!   writer, core 0                                      readers, core 1
//!   | loan, fill in, send |  has published -----------> all subscribers receive --+
//!   |<---- measured ----->|  wait until they are ready <--------------------------+
//! ```
//!
//! Our typed ports and bare iceoryx2 with the same user header, the same limits and the same
//! number of subscribers, in turn. Both fill in the whole payload from memory of their own. The
//! subscribers live in a process of their own on the other core and are drained after each
//! publish, so that no buffer is ever full and the writer finds its queues as readers leave them.
//!
//! Rows are called `publish-64` for 64 bytes to 64 subscribers, `publish-8@1MiB`, and so on.

mod readers;
mod writer;

use core::time::Duration;

use lager_rig::process::Main;
use lager_topics::{Qos, SensorLine, Topic};
use serde::{Deserialize, Serialize};

use crate::group::{Entry, Group, wanted};
use crate::pair::{self, Pair};
use crate::report::{Mode, Options, Regime};
use crate::sample::Block;
use crate::turns::Turns;

const WRITER: &str = "writer of the fan-out";
const READERS: &str = "readers of the fan-out";

pub(crate) const PROCESSES: &[(&str, Main)] =
    &[(WRITER, writer::writer), (READERS, readers::readers)];

/// Sizes of a block, in words of eight bytes.
const SMALL: usize = 8;
const KIB_64: usize = 1 << 13;
const MIB_1: usize = 1 << 17;

/// The topic of blocks of that size. Small ones have `sensor/line`'s depth; large ones the least
/// there is, since a publisher keeps memory for every place that a subscriber could fill.
struct Fan<const WORDS: usize>;

impl<const WORDS: usize> Topic for Fan<WORDS> {
    const NAME: &'static str = "bench/fan";
    type Payload = Block<WORDS>;
    const QOS: Qos = Qos {
        buffer: if WORDS > 512 {
            1
        } else {
            SensorLine::QOS.buffer
        },
        actors: &[],
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "From the publisher of a measurement to all that read.";
}

/// How many subscribers there are.
const READERS_OF: [usize; 3] = [1, 8, 64];

/// Who publishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
        Entry::new(name, variant, Mode::Spin, against)
    }
}

/// What is measured in a round: blocks of so many words go to so many readers.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Job {
    contender: Contender,
    words: usize,
    readers: usize,
}

type Round = pair::Round<Job>;

/// What each of the two has at hand.
type Own = pair::Side<Turns, ()>;

/// Bare iceoryx2's topic, which has the limits of ours.
const BARE: &str = "bench/bare-fan";

/// The groups of one regime. The readers look without pause, so the only mode there is is `spin`.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    let sizes = |readers| {
        [
            ("", SMALL, [500, 2_000]),
            ("@64KiB", KIB_64, [75, 300]),
            ("@1MiB", MIB_1, [12, 50]),
        ]
        .map(|(size, words, samples)| {
            let job = |contender: Contender| {
                let job = Job {
                    contender,
                    words,
                    readers,
                };
                (contender.entry(), job)
            };
            let what = format!("publish-{readers}{size}");
            let rows = wanted(Contender::ALL.map(job), options);
            Group::new(what, regime, rows, [2, 4], samples, |regime, rows| {
                let ends = [WRITER, READERS];
                let pair = Pair::<Turns, _>::start(regime, ends, &(), rows, Duration::ZERO)?;
                Ok(Box::new(pair))
            })
        })
    };
    READERS_OF.into_iter().flat_map(sizes).collect()
}
