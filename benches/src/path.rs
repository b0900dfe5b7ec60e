//! `path`: times the whole way from a sensor frame to its command, between the ends of two wires.
//!
//! ```text
//!   t0 | write -> pty -> bridge's reader -> sensor/line -> logic -> steering/command
//!                                            -> bridge's main loop -> pty -> read | t1
//! ```
//!
//! Bridge and logic are the real services in processes of their own ([`robot`]). The floor is the
//! same chain made of bare system calls ([`floor`]). Frames come at 1 kHz; a frame without an
//! answer ends the measurement with an error. The chains take turns within each run; SIGSTOP stops
//! the chains that wait for their turn.
//!
//! | `what` | row | compared with |
//! |---|---|---|
//! | `path` | `lager/block` | `floor` |
//! | `path` | `lager/adaptive` | `lager/block`; both with the processor time of both services |
//! | `path@observed` | `lager/8 observers`, `lager/64 observers` | `lager/alone`; all SCHED_FIFO |
//! | | `lager/observed`, with `--observers` in place of these two | `lager/alone` |
//! | `path@remote` | `lager/8 listeners` | `lager/alone`; all SCHED_FIFO; only with the feature `zenoh` |
//! | `path@watched` | `lager/8 watchers`, `lager/64 watchers` | `lager/alone`; all SCHED_FIFO |
//! | `path-overtaken` | frames of each `lager` row whose command was overtaken | |
//!
//! An observer is a process on an iceoryx2 node of its own. It subscribes to `sensor/line` and
//! `steering/command`, and ten times a second it reads all that has come.
//!
//! A watcher is the same, but every sample wakes it (`lager bench fanout`).
//!
//! A listener is a process that gets every sample of every topic over Zenoh, from a gateway of the
//! robot in a process of its own, as from a network. It is on the robot's cores, as there are no
//! others, and takes only the processor time that nobody else wants (SCHED_IDLE): on a network it
//! would take none. The gateway is scheduled as `lager gateway` is. What the kernel does for the
//! sockets counts.
//!
//! **Cores**: the boards, the bridge and the floor's ends are bound to the first core, logic and
//! the floor's middle to the second. In the regime of one core, all are bound to that core.

mod explain;
mod floor;
mod processes;
mod robot;
mod services;
mod turn;

use lager_rig::Refused;
use lager_rig::schedule::{Bound, NoRealTime, Placement, RealTime};

use crate::error::BenchError;
use crate::group::{Entry, Group, Session};
use crate::machine::cores_for;
use crate::report::{Mode, Options, Regime, Row};
use crate::rounds::Taken;
use crate::stats::Distribution;
use floor::Floor;
use lager_machine::Cores;
use robot::{Places, Robot};
use turn::{Chain, TURN, turn};

pub use explain::{Explained, Wanted, explain};
pub(crate) use floor::PROCESSES as FLOOR_PROCESSES;
pub(crate) use services::PROCESSES;

/// Turns of each chain in one run: with `--quick`, and without.
const TURNS: [usize; 2] = [4, 8];

/// SCHED_FIFO priorities. The boards stand for hardware, so they run before all of the robot.
const SERVICES: u8 = 40;
const BOARDS: u8 = 50;

/// The rows, each with those who are beside the path.
type Rows = Vec<(Entry, Beside)>;

/// Who else gets the samples of a robot, each in a process of its own.
#[derive(Clone, Copy, Debug)]
enum Beside {
    /// Only the services of the path.
    Nobody,
    /// So many observers on the bus.
    Observers(usize),
    /// So many observers that every sample wakes.
    Watchers(usize),
    /// A gateway, and so many listeners of it.
    #[cfg(feature = "zenoh")]
    Listeners(usize),
}

/// The rows without observers.
const ALONE: [(Entry, Beside); 3] = [
    (
        Entry::new("lager/block", Mode::Block, &["floor"]),
        Beside::Nobody,
    ),
    (Entry::new("floor", Mode::Block, &[]), Beside::Nobody),
    (
        Entry::new("lager/adaptive", Mode::Adaptive, &["lager/block", "floor"]),
        Beside::Nobody,
    ),
];

/// The row in real time with which those with observers are compared.
const ALONE_IN_REAL_TIME: &str = "lager/alone";

/// A row in real time with nobody beside it, and those that are compared with it.
fn beside_alone(others: &[(&'static str, Beside)]) -> Rows {
    let alone = (ALONE_IN_REAL_TIME, Beside::Nobody);
    let rows = [alone].into_iter().chain(others.iter().copied());
    rows.map(|(label, beside)| {
        let against: &[&str] = match beside {
            Beside::Nobody => &[],
            _ => &[ALONE_IN_REAL_TIME],
        };
        (Entry::new(label, Mode::Block, against), beside)
    })
    .collect()
}

/// The observers of a row each, unless others are asked for.
const OBSERVED: [(&str, Beside); 2] = [
    ("lager/8 observers", Beside::Observers(8)),
    ("lager/64 observers", Beside::Observers(64)),
];

/// The groups of one regime. No row spins: bridge and logic would use two cores, and the boards
/// need one.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    let group = |what: &str, rows: Rows, observed| group(what, regime, options, rows, observed);
    let wants = |mode| options.modes.contains(&mode);
    // On one core, an adaptive service would spin on the core that the others need.
    let adapts = wants(Mode::Adaptive) && regime != Regime::SameCore;
    let mut groups = Vec::new();
    if adapts || wants(Mode::Block) {
        let rows = ALONE[..if adapts { 3 } else { 2 }].to_vec();
        groups.push(group("path", rows, false));
    }
    if wants(Mode::Block) && regime != Regime::SameCore {
        let observed = match options.observers {
            None => beside_alone(&OBSERVED),
            Some(many) => beside_alone(&[("lager/observed", Beside::Observers(many))]),
        };
        groups.push(group("path@observed", observed, true));
        #[cfg(feature = "zenoh")]
        {
            let remote = beside_alone(&[("lager/8 listeners", Beside::Listeners(8))]);
            groups.push(group("path@remote", remote, true));
        }
    }
    groups
}

/// The group with watchers, which belongs to no limit.
pub(crate) fn watched(regime: Regime, options: &Options) -> Option<Group> {
    let wanted = options.modes.contains(&Mode::Block) && regime != Regime::SameCore;
    let rows = beside_alone(&[
        ("lager/8 watchers", Beside::Watchers(8)),
        ("lager/64 watchers", Beside::Watchers(64)),
    ]);
    wanted.then(|| group("path@watched", regime, options, rows, true))
}

fn group(what: &str, regime: Regime, options: &Options, rows: Rows, observed: bool) -> Group {
    let cores = options.cores;
    Group {
        what: what.to_owned(),
        regime,
        entries: rows.iter().map(|(entry, _)| *entry).collect(),
        rounds: TURNS,
        samples: [TURN; 2],
        open: Box::new(move || {
            Ok(Box::new(Chains::start(
                cores_for(regime, cores)?,
                regime,
                &rows,
                observed,
            )?))
        }),
    }
}

/// The chains that take turns. The thread that plays their boards is bound to a core meanwhile.
struct Chains {
    chains: Vec<Box<dyn Chain>>,
    regime: Regime,
    observed: bool,
    _bound: Bound,
}

impl Chains {
    /// Starts robots and the floor, or observed robots whose services and boards run in real time.
    fn start(
        (first, second): Cores,
        regime: Regime,
        rows: &[(Entry, Beside)],
        observed: bool,
    ) -> Result<Self, BenchError> {
        let [ends, logic] = [first, second].map(|core| Placement {
            core: Some(core),
            priority: observed.then_some(SERVICES),
        });
        let places = Places {
            bridge: ends,
            logic,
            boards: observed.then_some(BOARDS),
        };
        let mut chains: Vec<Box<dyn Chain>> = Vec::new();
        for (entry, beside) in rows {
            let mut chain: Box<dyn Chain> = match entry.label {
                "floor" => Box::new(Floor::start(ends, logic)?),
                label => Box::new(Robot::start(label, entry.mode, places, *beside)?),
            };
            chain.processes().rest();
            chains.push(chain);
        }
        // A real board's UART does not oversleep, so this thread wakes as exactly as it can. All
        // that it starts would inherit that, as it does the core.
        let exactly = std::num::NonZeroU64::MIN;
        rustix::thread::set_current_timer_slack(Some(exactly))
            .map_err(Refused::to_make("timers without slack"))?;
        Ok(Self {
            chains,
            regime,
            observed,
            _bound: Bound::to(first)?,
        })
    }
}

impl Session for Chains {
    fn round(&mut self, index: usize, samples: usize) -> Result<Taken, BenchError> {
        turn(&mut *self.chains[index], samples)
    }

    /// Adds the processor time, except in real time, and for each robot the number of its overtaken
    /// frames, with all figures 0 if there was none.
    fn finish(&mut self, rows: &mut Vec<Row>) -> Result<(), BenchError> {
        let mut more = Vec::new();
        for (row, chain) in rows.iter_mut().zip(&mut self.chains) {
            if !self.observed {
                row.cpu_percent = chain.processes().cpu_percent();
            }
            if let Some(overtaken) = chain.overtaken() {
                let times: Distribution = overtaken.iter().copied().collect();
                let times = times.quantiles();
                let what = "path-overtaken";
                more.push(Row::new(what, &row.label(), row.mode, self.regime, times));
            }
        }
        rows.extend(more);
        Ok(())
    }
}

/// Whether this process may run in real time, which `path@observed` needs.
///
/// # Errors
/// It may not; the sentence says what to do.
pub fn may_have_real_time() -> Result<(), NoRealTime> {
    // The thread that gets real time ends at once.
    std::thread::spawn(|| RealTime::begin(BOARDS).map(drop))
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}
