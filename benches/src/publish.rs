//! What publishing and waking cost a writer: `publish-N` (the scenario `fanout`) and `ring-64`
//! (a part of the scenario `hop`).
//!
//! ```text
//!   writer, core 0                                 readers, core 1
//!                         <── ready ────────────── all drained
//!   |  publish or ring  | ── sample or ring ─────> wait, and drain
//!   |<--- measured ---->|
//! ```
//!
//! The readers live in a process of their own and are drained after each publish, so that no buffer
//! is ever full and the writer finds its queues as readers leave them.
//!
//! **`publish-N`**: our typed ports and bare iceoryx2 with the same user header, the same limits
//! and the same number of subscribers, in turn. Both fill in the whole payload from memory of their
//! own. Rows are called `publish-64` for 64 bytes to 64 subscribers, `publish-8@1MiB`, and so on.
//!
//! **`ring-64`**: what it costs a writer to wake the one actor of a topic that 64 observers read,
//! for which the writer is kept from its work. The cost of the ring alone is the difference between
//! publishing while the actor waits for a ring and publishing on the same ports while it sleeps for
//! something else, measured in pairs (`lager/ring`). It compares with iceoryx2 notifying without
//! publishing anything: a listener for each reader (`notify`), or, as the typed ports do it, one
//! listener for the actor while 64 readers poll (`notify-1`).

mod ends;

use std::error::Error;

use lager_rig::Parent;
use lager_rig::process::Main;
use lager_topics::OBSERVERS;

use crate::group::{Entry, Group};
use crate::pair;
use crate::report::{Mode, Options, Regime};
use ends::{Job, KIB_64, MIB_1, SMALL};

const WRITER: &str = "writer";
const READERS: &str = "readers";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(WRITER, take_turns), (READERS, take_turns)];

fn take_turns(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pair::measure(parent, ends::round)
}

/// `publish-N` in one regime. The readers look without pause, so the only mode there is is `spin`.
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
            group(format!("publish-{readers}{size}"), regime, rows, samples)
        })
    };
    [1, 8, 64].into_iter().flat_map(sizes).collect()
}

/// `ring-64` in one regime. The actor sleeps when it is rung, so the only mode there is is `block`.
pub(crate) fn ring(regime: Regime, options: &Options) -> Option<Group> {
    let entry = |label, against| Entry::new(label, Mode::Block, against);
    let notify = |listeners| Job::Notify { listeners };
    let ours = entry("lager/ring", &["iceoryx2/notify", "iceoryx2/notify-1"]);
    let rows = vec![
        (ours, Job::Ring),
        (entry("iceoryx2/notify", &[]), notify(OBSERVERS + 1)),
        (entry("iceoryx2/notify-1", &[]), notify(1)),
    ];
    let wanted = options.modes.contains(&Mode::Block);
    wanted.then(|| group("ring-64".to_owned(), regime, rows, [100, 500]))
}

fn group(what: String, regime: Regime, rows: Vec<(Entry, Job)>, samples: [usize; 2]) -> Group {
    Group {
        what,
        regime,
        entries: rows.iter().map(|(entry, _)| *entry).collect(),
        rounds: pair::ROUNDS,
        samples,
        open: Box::new(move || pair::open(regime, [WRITER, READERS], &[], rows.clone())),
    }
}
