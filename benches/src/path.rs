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

mod board;
mod cable;
mod floor;
mod pace;
mod players;
mod processes;
mod robot;
mod stages;

use crate::error::BenchError;
use crate::machine::{self, Awake, Bound, cores_for};
use crate::report::{Mode, Options, Regime, Report, Row};
use crate::run::{self, Entry};
use crate::stats::Quantiles;
use floor::Floor;
use pace::{Chain, TURN, turn};
use players::{Place, RealTime};
use robot::Robot;

pub(crate) use floor::PARTS as FLOOR_PARTS;
pub(crate) use players::PARTS;

/// Turns of each chain in one run.
const TURNS: usize = 8;
const QUICK_TURNS: usize = 2;

/// Frames of somewhat more than a second.
const A_SECOND: usize = 1_100;

/// SCHED_FIFO priorities: the boards are hardware, so nothing of the robot comes before them.
const SERVICES: i32 = 40;
const BOARDS: i32 = 50;

const ENTRIES: &[Entry] = &[
    Entry {
        name: "lager",
        variant: "block",
        mode: Mode::Block,
        against: &["floor"],
    },
    Entry {
        name: "floor",
        variant: "",
        mode: Mode::Block,
        against: &[],
    },
    Entry {
        name: "lager",
        variant: "adaptive",
        mode: Mode::Adaptive,
        against: &["lager/block", "floor"],
    },
];

const OBSERVED: &[Entry] = &[
    Entry {
        name: "lager",
        variant: "alone",
        mode: Mode::Block,
        against: &[],
    },
    Entry {
        name: "lager",
        variant: "8 observers",
        mode: Mode::Block,
        against: &["lager/alone"],
    },
    Entry {
        name: "lager",
        variant: "64 observers",
        mode: Mode::Block,
        against: &["lager/alone"],
    },
];

/// Measures the path in every wanted mode and regime. A spinning path is not measured: bridge and
/// logic would keep two cores, and the boards need one.
///
/// # Errors
/// A frame was not answered, a process ended, or the machine lacks something; the sentence says
/// what to do.
pub fn measure(options: &Options) -> Result<Report, BenchError> {
    let mut rows = Vec::new();
    for regime in &options.regimes {
        rows.extend(measure_in(*regime, options)?);
    }
    if rows.is_empty() {
        return Err(BenchError::NothingToMeasure(
            "the path is measured blocking and adaptive, the latter on two cores".to_owned(),
        ));
    }
    Ok(Report {
        machine: machine::describe(),
        rows,
    })
}

fn measure_in(regime: Regime, options: &Options) -> Result<Vec<Row>, BenchError> {
    let mut options = options.clone();
    if regime == Regime::SameCore {
        // Nobody spins on the only core that the others have.
        options.modes.retain(|mode| *mode != Mode::Adaptive);
    }
    let wanted = run::wanted(ENTRIES, &options);
    if wanted.is_empty() {
        return Ok(Vec::new());
    }
    let entries: Vec<Entry> = wanted.iter().map(|index| ENTRIES[*index].clone()).collect();
    // In a thread of its own: bound to a core and in real time only as long as this lasts.
    let observed = regime != Regime::SameCore && options.modes.contains(&Mode::Block);
    let measured = in_a_thread({
        let options = options.clone();
        move || path(regime, &entries, &options)
    })?;
    if !observed {
        return Ok(measured);
    }
    match in_a_thread(move || path_observed(regime, &options)) {
        Ok(more) => Ok([measured, more].concat()),
        Err(BenchError::RealTime { detail }) => {
            // The rest is worth having without the right to real time.
            eprintln!("{}", BenchError::RealTime { detail });
            Ok(measured)
        }
        Err(error) => Err(error),
    }
}

fn in_a_thread(
    work: impl FnOnce() -> Result<Vec<Row>, BenchError> + Send + 'static,
) -> Result<Vec<Row>, BenchError> {
    std::thread::spawn(work)
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Blocking, the floor, and adaptive; then the stages of the blocking path.
fn path(regime: Regime, entries: &[Entry], options: &Options) -> Result<Vec<Row>, BenchError> {
    let (ends, mind) = cores_for(regime)?;
    let [at_ends, at_mind] = [ends, mind].map(|core| Place {
        core: Some(core),
        priority: None,
    });
    let _awake = Awake::during(regime)?;
    let mut chains: Vec<Box<dyn Chain>> = Vec::new();
    for entry in entries {
        let mut chain: Box<dyn Chain> = if entry.name == "floor" {
            Box::new(Floor::start(at_ends, at_mind)?)
        } else {
            Box::new(Robot::start(&entry.label(), entry.mode, at_ends, at_mind)?)
        };
        chain.end()?;
        chains.push(chain);
    }
    machine::pin(ends)?;
    let mut rows = run::measure("path", regime, entries, options, turns(options), |index| {
        turn(&mut *chains[index], TURN)
    })?;
    for (row, chain) in rows.iter_mut().zip(&chains) {
        row.cpu_percent = chain.cpu_percent();
    }
    for (entry, chain) in entries.iter().zip(&mut chains) {
        if entry.name == "floor" {
            continue;
        }
        rows.push(overtaken(chain.overtaken(), entry, regime));
        // Counts are published once a second.
        turn(&mut **chain, A_SECOND)?;
        let before = chain.counted()?;
        turn(&mut **chain, A_SECOND)?;
        if let Some((before, after)) = before.zip(chain.counted()?) {
            rows.extend(stages::rows(&before, &after, regime, entry.mode));
        }
    }
    Ok(rows)
}

/// With nobody watching, and with observers; services and boards in real time.
fn path_observed(regime: Regime, options: &Options) -> Result<Vec<Row>, BenchError> {
    let (ends, mind) = cores_for(regime)?;
    let [at_ends, at_mind] = [ends, mind].map(|core| Place {
        core: Some(core),
        priority: Some(SERVICES),
    });
    let _awake = Awake::during(regime)?;
    let mut robots = Vec::new();
    for (entry, observers) in OBSERVED.iter().zip([0, 8, 64]) {
        let mut robot = Robot::start(&entry.label(), entry.mode, at_ends, at_mind)?;
        robot.observed_by(observers)?;
        robot.with_boards_at(BOARDS)?;
        robot.end()?;
        robots.push(robot);
    }
    // Last of all: what a thread starts inherits its core.
    machine::pin(ends)?;
    let mut rows = run::measure(
        "path@observed",
        regime,
        OBSERVED,
        options,
        turns(options),
        |index| turn(&mut robots[index], TURN),
    )?;
    for (entry, robot) in OBSERVED.iter().zip(&robots) {
        rows.push(overtaken(robot.overtaken(), entry, regime));
    }
    Ok(rows)
}

/// How many of a robot's frames were overtaken; all 0 if none was.
fn overtaken(times: &[u64], entry: &Entry, regime: Regime) -> Row {
    let times = Quantiles::of(&mut times.to_vec());
    let told = |figure: fn(&Quantiles) -> u64| times.as_ref().map_or(0, figure);
    Row {
        name: entry.name.to_owned(),
        variant: entry.variant.to_owned(),
        what: "path-overtaken".to_owned(),
        mode: entry.mode,
        regime,
        n: told(|times| times.n),
        p50_ns: told(|times| times.p50_ns),
        p99_ns: told(|times| times.p99_ns),
        p999_ns: told(|times| times.p999_ns),
        ratio_to: String::new(),
        ratio_p50: 1.0,
        ratio_p99: 1.0,
        ratios: Vec::new(),
        cpu_percent: None,
    }
}

/// Whether this process may have real time, without which nothing is `path@observed`.
///
/// # Errors
/// It may not; the sentence says what to do.
pub fn may_have_real_time() -> Result<(), BenchError> {
    in_a_thread(|| RealTime::begin(BOARDS).map(|_| Vec::new())).map(|_| ())
}

/// One chain for the criterion bench. Stays in the thread that opened it, which is bound to a core
/// meanwhile.
pub struct Session {
    chain: Box<dyn Chain>,
    _bound: Bound,
}

impl Session {
    /// The real services, waiting as `mode` says.
    ///
    /// # Errors
    /// See [`measure`].
    pub fn lager(mode: Mode) -> Result<Self, BenchError> {
        let (ends, mind, core) = placed()?;
        Self::of(Robot::start("lager", mode, ends, mind)?, core)
    }

    /// The same chain of the barest primitives.
    ///
    /// # Errors
    /// See [`measure`].
    pub fn floor() -> Result<Self, BenchError> {
        let (ends, mind, core) = placed()?;
        Self::of(Floor::start(ends, mind)?, core)
    }

    fn of(mut chain: impl Chain + 'static, core: usize) -> Result<Self, BenchError> {
        chain.end()?;
        Ok(Self {
            chain: Box::new(chain),
            _bound: Bound::to(core)?,
        })
    }

    /// Sends `frames` frames, a millisecond apart, and some before that to warm up; how long each
    /// took, in ns.
    ///
    /// # Errors
    /// See [`measure`].
    pub fn round(&mut self, frames: usize) -> Result<Vec<u64>, BenchError> {
        turn(&mut *self.chain, frames)
    }
}

impl core::fmt::Debug for Session {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.debug_struct("Session").finish_non_exhaustive()
    }
}

/// The places of ends and mind on two cores, and the boards' core.
fn placed() -> Result<(Place, Place, usize), BenchError> {
    let (ends, mind) = cores_for(Regime::Plain)?;
    let [at_ends, at_mind] = [ends, mind].map(|core| Place {
        core: Some(core),
        priority: None,
    });
    Ok((at_ends, at_mind, ends))
}

fn turns(options: &Options) -> usize {
    if options.quick { QUICK_TURNS } else { TURNS }
}
