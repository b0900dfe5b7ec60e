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
mod turn;

use crate::error::BenchError;
use crate::group::{Entry, Group, Session, wanted};
use crate::machine::{Bound, cores_for};
use crate::report::{Mode, Options, Regime, Row};
use crate::stats::Quantiles;
use floor::Floor;
use robot::Robot;
use services::{Place, RealTime};
use turn::{Chain, TURN, turn};

pub(crate) use floor::PROCESSES as FLOOR_PROCESSES;
pub(crate) use services::PROCESSES;

/// Turns of each chain in one run: quick, and in full.
const TURNS: [usize; 2] = [2, 8];

/// Frames of somewhat more than a second.
const A_SECOND: usize = 1_100;

/// SCHED_FIFO priorities: the boards are hardware, so nothing of the robot comes before them.
const SERVICES: i32 = 40;
const BOARDS: i32 = 50;

/// What is measured with nobody watching, and the number of observers: 0.
const ALONE: [(Entry, usize); 3] = [
    (Entry::new("lager", "block", Mode::Block, &["floor"]), 0),
    (Entry::new("floor", "", Mode::Block, &[]), 0),
    (
        Entry::new(
            "lager",
            "adaptive",
            Mode::Adaptive,
            &["lager/block", "floor"],
        ),
        0,
    ),
];

/// The same with so many observers.
const OBSERVED: [(Entry, usize); 3] = [
    (Entry::new("lager", "alone", Mode::Block, &[]), 0),
    (
        Entry::new("lager", "8 observers", Mode::Block, &["lager/alone"]),
        8,
    ),
    (
        Entry::new("lager", "64 observers", Mode::Block, &["lager/alone"]),
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
    let group = |what: &str, rows: [(Entry, usize); 3], is_real_time: bool| {
        let rows = wanted(rows, &options);
        let group = Group::new(what, regime, rows, TURNS, [TURN; 2], move |regime, rows| {
            Ok(Box::new(Chains::start(regime, &rows, is_real_time)?))
        });
        Group {
            is_real_time,
            ..group
        }
    };
    let mut groups = vec![group("path", ALONE, false)];
    if regime != Regime::SameCore {
        groups.push(group("path@observed", OBSERVED, true));
    }
    groups
}

/// The chains that take turns; the thread that plays their boards is bound to a core meanwhile.
struct Chains {
    chains: Vec<Box<dyn Chain>>,
    regime: Regime,
    /// The robots publish where the time goes; it is asked of those that are not in real time.
    tells_stages: bool,
    _bound: Bound,
}

impl Chains {
    /// Robots, each with so many observers, and the floor; services and boards in real time, if
    /// that is wanted.
    fn start(
        regime: Regime,
        rows: &[(Entry, usize)],
        is_real_time: bool,
    ) -> Result<Self, BenchError> {
        let (ends, logic) = cores_for(regime)?;
        let [ends, logic] = [ends, logic].map(|core| Place {
            core: Some(core),
            priority: is_real_time.then_some(SERVICES),
        });
        let start = |(entry, observers): &(Entry, usize)| -> Result<Box<dyn Chain>, BenchError> {
            if entry.name == "floor" {
                return Ok(Box::new(Floor::start(ends, logic)?));
            }
            let mut robot = Robot::start(&entry.label(), entry.mode, ends, logic)?;
            robot.observed_by(*observers)?;
            if is_real_time {
                robot.with_boards_at(BOARDS)?;
            }
            Ok(Box::new(robot))
        };
        let mut chains = Vec::new();
        for row in rows {
            let mut chain = start(row)?;
            chain.processes().rest();
            chains.push(chain);
        }
        Ok(Self {
            chains,
            regime,
            tells_stages: !is_real_time,
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
                row.cpu_percent = chain.processes().cpu_percent();
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
