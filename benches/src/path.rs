//! The whole way from a sensor frame to the command it causes, over the wires' ends.
//!
//! ```text
//!   t0 | write -> pty -> bridge's reader -> sensor/line -> logic -> steering/command
//!                                            -> bridge's main loop -> pty -> read | t1
//! ```
//!
//! Bridge and logic are the real services in processes of their own ([`robot`]). The floor is the
//! same chain made of bare system calls ([`floor`]). Frames come at 1 kHz and each of them must be
//! answered, or the measurement ends with an error. The chains take turns within each run; those
//! that wait for their turn are stopped (SIGSTOP).
//!
//! | `what` | row | compared with |
//! |---|---|---|
//! | `path` | `lager/block` | `floor` |
//! | `path` | `lager/adaptive` | `lager/block`; both with the processor time of both services |
//! | `path@observed` | `lager/8 observers`, `lager/64 observers` | `lager/alone`; all SCHED_FIFO |
//! | `path-overtaken` | the samples of each `lager` row whose command was overtaken | |
//! | `path-stages` | each stage of `lager`, as the robot itself publishes it | |
//!
//! An observer is a process of its own on a node of its own, subscribed to `sensor/line` and
//! `steering/command`, that reads all that has come ten times a second.
//!
//! **Cores**: the boards, the bridge and the floor's ends are bound to the first core, logic and
//! the floor's middle to the second; in the regime of one core all are on that one.

mod floor;
mod pace;
mod processes;
mod robot;
mod services;
mod stages;

use crate::error::BenchError;
use crate::group::{Entry, Group, Session, wanted};
use crate::machine::{Bound, cores_for};
use crate::report::{Mode, Options, Regime, Row};
use crate::stats::Quantiles;
use floor::Floor;
use pace::{Chain, TURN, turn};
use robot::Robot;
use services::{Place, RealTime};

pub(crate) use floor::PROCESSES as FLOOR_PROCESSES;
pub(crate) use services::PROCESSES;

/// Turns of each chain in one run: quick, and in full.
const TURNS: [usize; 2] = [2, 8];

/// Frames of somewhat more than a second.
const A_SECOND: usize = 1_100;

/// SCHED_FIFO priorities: the boards are hardware, so nothing of the robot comes before them.
const SERVICES: i32 = 40;
const BOARDS: i32 = 50;

/// A row of ours or of the floor.
const fn entry(
    name: &'static str,
    variant: &'static str,
    mode: Mode,
    against: &'static [&'static str],
) -> Entry {
    Entry {
        name,
        variant,
        mode,
        against,
    }
}

const ALONE: [Entry; 3] = [
    entry("lager", "block", Mode::Block, &["floor"]),
    entry("floor", "", Mode::Block, &[]),
    entry(
        "lager",
        "adaptive",
        Mode::Adaptive,
        &["lager/block", "floor"],
    ),
];

/// With so many observers.
const OBSERVED: [(Entry, usize); 3] = [
    (entry("lager", "alone", Mode::Block, &[]), 0),
    (
        entry("lager", "8 observers", Mode::Block, &["lager/alone"]),
        8,
    ),
    (
        entry("lager", "64 observers", Mode::Block, &["lager/alone"]),
        64,
    ),
];

/// The groups of one regime. A spinning path is not measured: bridge and logic would keep two cores,
/// and the boards need one.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    let mut options = options.clone();
    if regime == Regime::SameCore {
        // Nobody spins on the only core that the others have.
        options.modes.retain(|mode| *mode != Mode::Adaptive);
    }
    let (entries, _) = wanted(ALONE.map(|entry| (entry, ())), &options);
    let chains = entries.clone();
    let alone = Group::new("path", regime, entries, TURNS, [TURN; 2], move |regime| {
        Ok(Box::new(Chains::alone(regime, &chains)?))
    });
    if regime == Regime::SameCore {
        return vec![alone];
    }
    let (entries, observers) = wanted(OBSERVED, &options);
    let robots: Vec<_> = entries.iter().cloned().zip(observers).collect();
    let what = "path@observed";
    let observed = Group::new(what, regime, entries, TURNS, [TURN; 2], move |regime| {
        Ok(Box::new(Chains::observed(regime, &robots)?))
    });
    vec![
        alone,
        Group {
            is_real_time: true,
            ..observed
        },
    ]
}

/// The chains that take turns; the thread that plays their boards is bound to a core meanwhile.
struct Chains {
    chains: Vec<Box<dyn Chain>>,
    regime: Regime,
    /// The robots publish where the time goes; it is asked of those that nobody watches.
    tells_stages: bool,
    _bound: Bound,
}

impl Chains {
    /// Blocking, the floor, and adaptive.
    fn alone(regime: Regime, entries: &[Entry]) -> Result<Self, BenchError> {
        let [at_ends, at_logic] = places(regime, None)?;
        let start = |entry: &Entry| -> Result<Box<dyn Chain>, BenchError> {
            Ok(if entry.name == "floor" {
                Box::new(Floor::start(at_ends, at_logic)?)
            } else {
                Box::new(Robot::start(&entry.label(), entry.mode, at_ends, at_logic)?)
            })
        };
        Self::of(regime, entries.iter().map(start), true)
    }

    /// With nobody watching, and with observers; services and boards in real time.
    fn observed(regime: Regime, robots: &[(Entry, usize)]) -> Result<Self, BenchError> {
        let [at_ends, at_logic] = places(regime, Some(SERVICES))?;
        let start = |(entry, observers): &(Entry, usize)| -> Result<Box<dyn Chain>, BenchError> {
            let mut robot = Robot::start(&entry.label(), entry.mode, at_ends, at_logic)?;
            robot.observed_by(*observers)?;
            robot.with_boards_at(BOARDS)?;
            Ok(Box::new(robot))
        };
        Self::of(regime, robots.iter().map(start), false)
    }

    fn of(
        regime: Regime,
        started: impl Iterator<Item = Result<Box<dyn Chain>, BenchError>>,
        tells_stages: bool,
    ) -> Result<Self, BenchError> {
        let mut chains = Vec::new();
        for chain in started {
            let mut chain = chain?;
            chain.end()?;
            chains.push(chain);
        }
        Ok(Self {
            chains,
            regime,
            tells_stages,
            // Last of all: what a thread starts inherits its core.
            _bound: Bound::to(cores_for(regime)?.0)?,
        })
    }
}

impl Session for Chains {
    fn round(&mut self, index: usize, samples: usize) -> Result<Vec<u64>, BenchError> {
        turn(&mut *self.chains[index], samples)
    }

    /// Processor time, frames that were overtaken, and the stages of the path.
    fn finish(&mut self, rows: &mut Vec<Row>) -> Result<(), BenchError> {
        let mut more = Vec::new();
        for (row, chain) in rows.iter_mut().zip(&mut self.chains) {
            if self.tells_stages {
                row.cpu_percent = chain.cpu_percent();
            }
            if row.name == "floor" {
                continue;
            }
            // How many of a robot's frames were overtaken; all 0 if none was.
            let times = Quantiles::of(&mut chain.overtaken().to_vec());
            more.push(Row {
                name: row.name.clone(),
                variant: row.variant.clone(),
                ..Row::of("path-overtaken", row.mode, self.regime, times)
            });
            if !self.tells_stages {
                continue;
            }
            // Counts are published once a second.
            turn(&mut **chain, A_SECOND)?;
            let before = chain.counted()?;
            turn(&mut **chain, A_SECOND)?;
            if let Some((before, after)) = before.zip(chain.counted()?) {
                more.extend(stages::rows(&before, &after, self.regime, row.mode));
            }
        }
        rows.extend(more);
        Ok(())
    }
}

/// Where bridge and boards are, and where logic is.
fn places(regime: Regime, priority: Option<i32>) -> Result<[Place; 2], BenchError> {
    let (ends, logic) = cores_for(regime)?;
    Ok([ends, logic].map(|core| Place {
        core: Some(core),
        priority,
    }))
}

/// Whether this process may have real time, without which nothing is `path@observed`.
///
/// # Errors
/// It may not; the sentence says what to do.
pub fn may_have_real_time() -> Result<(), BenchError> {
    // In a thread of its own, which ends with what it got.
    std::thread::spawn(|| RealTime::begin(BOARDS).map(drop))
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}
