//! Measures how long publishing and waking take for the writer: `publish-N` (the scenario `fanout`)
//! and `ring-64` (a part of the scenario `hop`).
//!
//! ```text
//!   writer, core 0                                 readers, core 1
//!                         <── ready ────────────── all drained
//!   |  publish or ring  | ── sample or ring ─────> wait, and drain
//!   |<--- measured ---->|
//! ```
//!
//! The readers are in another process and empty their queues after each publish, so no buffer is
//! ever full.
//!
//! **`publish-N`**: the typed ports and bare iceoryx2 take turns, with the same user header, the
//! same limits and the same number of subscribers. Both fill in the whole payload from their own
//! memory. Rows are called `publish-64` for 64 bytes to 64 subscribers, `publish-8@1MiB`, and so
//! on.
//!
//! **`ring-64`**: the time that a writer needs to wake the one actor of a topic with 64 observers.
//! It is the difference of two publishes on the same ports, measured in pairs (`lager/ring`): one
//! while the actor waits for a ring, one while it sleeps for something else. It is compared with an
//! iceoryx2 notification without a publish: to a listener for each reader (`notify`), or to one
//! listener for the actor while 64 readers poll (`notify-1`), as in the typed ports.

mod ends;

use core::time::Duration;
use std::error::Error;

use lager_rig::Parent;
use lager_rig::process::Main;
use lager_sample::Topic;
use lager_topics::SensorLine;

use crate::group::{Entry, Group};
use crate::machine::cores_for;
use crate::pair;
use crate::report::{Mode, Options, Regime};
use ends::{Job, KIB_64, MIB_1, SMALL};
use lager_machine::Cores;

const WRITER: &str = "writer";
const READERS: &str = "readers";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(WRITER, take_turns), (READERS, take_turns)];

fn take_turns(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pair::measure(parent, ends::round)
}

/// `publish-N` in one regime. The readers look without pause, so the only mode is `spin`.
pub(crate) fn fan_out(regime: Regime, options: &Options) -> Vec<Group> {
    if !options.modes.contains(&Mode::Spin) {
        return Vec::new();
    }
    let sizes = |readers| {
        [
            ("", SMALL, [500, 2_000]),
            ("@64KiB", KIB_64, [75, 300]),
            ("@1MiB", MIB_1, [12, 50]),
        ]
        .map(|(size, words, samples)| {
            let ours = Entry::new("lager", Mode::Spin, &["iceoryx2/header"]);
            let bare = Entry::new("iceoryx2/header", Mode::Spin, &[]);
            let rows = vec![
                (ours, Job::Lager { words, readers }),
                (bare, Job::Iceoryx2 { words, readers }),
            ];
            group(
                format!("publish-{readers}{size}"),
                regime,
                options.cores,
                rows,
                samples,
            )
        })
    };
    [1, 8, 64].into_iter().flat_map(sizes).collect()
}

/// `ring-64` in one regime. The actor sleeps until it is rung, so the only mode is `block`.
pub(crate) fn ring(regime: Regime, options: &Options) -> Option<Group> {
    let entry = |label, against| Entry::new(label, Mode::Block, against);
    let notify = |listeners| Job::Notify { listeners };
    let ours = entry("lager/ring", &["iceoryx2/notify", "iceoryx2/notify-1"]);
    let rows = vec![
        (ours, Job::Ring),
        (
            entry("iceoryx2/notify", &[]),
            notify(SensorLine::QOS.observers + 1),
        ),
        (entry("iceoryx2/notify-1", &[]), notify(1)),
    ];
    let wanted = options.modes.contains(&Mode::Block);
    wanted.then(|| {
        group(
            "ring-64".to_owned(),
            regime,
            options.cores,
            rows,
            [100, 500],
        )
    })
}

fn group(
    what: String,
    regime: Regime,
    cores: Option<Cores>,
    rows: Vec<(Entry, Job)>,
    samples: [usize; 2],
) -> Group {
    Group {
        what,
        regime,
        entries: rows.iter().map(|(entry, _)| *entry).collect(),
        rounds: pair::ROUNDS,
        samples,
        open: Box::new(move || {
            let cores = cores_for(regime, cores)?;
            pair::open(cores, Duration::ZERO, [WRITER, READERS], &[], rows.clone())
        }),
    }
}
