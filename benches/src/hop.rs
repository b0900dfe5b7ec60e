//! `hop`: one way between two processes.
//!
//! ```text
//!            first process, core 0             second process, core 1
//!   thrown ─ send ────────── 64 bytes ──────────> receive
//!                                                   │
//!   caught ─ receive <────── the same back ──────── send         one way = (caught - thrown) / 2
//! ```
//!
//! Both ends are the same contender and wait the same way, except for `adaptive`: of two cores only
//! one is ever given to adaptive spinning, so there the second process adapts and the first one
//! spins. Then only the way to the second process is timed, for the contender and for its baseline
//! (both ends read the same clock, CLOCK_MONOTONIC); half a round trip would hide half of a delay
//! at one end.
//!
//! Every contender plays short rounds in turn with all the others, with ports of its own for each
//! round.

mod contender;
mod ours;
mod players;

use core::fmt;
use core::time::Duration;
use std::os::fd::{AsRawFd, OwnedFd};

use rustix::event::{EventfdFlags, eventfd};

pub use contender::Contender;
pub use players::{Round, Timing};

use crate::baseline::stream;
use crate::domain::Domain;
use crate::error::BenchError;
use crate::machine::{self, Awake};
use crate::parts::{Part, Play};
use crate::report::{Mode, Options, Ratio, Regime, Report, Row};
use crate::ring;
use crate::run::{self, wanted};
use crate::shared::Shared;
use crate::slow;
use players::{Court, Lines, Setup};

const FIRST: &str = "first player of the hop";
const SECOND: &str = "second player of the hop";

pub(crate) const PARTS: &[(&str, Play)] = &[(FIRST, players::first), (SECOND, players::second)];

/// From one throw to the next when they come at 10 kHz.
const PACE_NS: u64 = 100_000;

/// Measures the hop: every contender in every mode and regime that `options` names, and the
/// baselines they are compared with. Rows called `hop` are half of the way there and back, as fast
/// as balls come back; `hop@full-rate` is one way at the same rate, `hop@10kHz` with a ball every
/// 100 µs; those called `ring-64` time the writer that wakes one actor beside 64 observers.
///
/// # Errors
/// See [`BenchError`].
pub fn measure(options: &Options) -> Result<Report, BenchError> {
    let mut rows = Vec::new();
    for regime in Regime::ALL {
        if options.regimes.contains(&regime) {
            rows.extend(in_regime(regime, options)?);
            rows.extend(ring::measure(regime, options)?);
        }
    }
    beside_the_parts(&mut rows);
    if rows.is_empty() {
        return Err(BenchError::NothingToMeasure(
            "no contender works in these modes and regimes".to_owned(),
        ));
    }
    Ok(Report {
        machine: machine::describe(),
        rows,
    })
}

/// What the floor of a blocking hop is called.
const PARTS_OF_A_HOP: &str = "futex + polled iceoryx2";

/// Compares the blocking hop on one core with the sum of what it is made of: a hop of a futex on
/// that core, and one of bare iceoryx2 that is polled from another core. The sum has one cache line
/// too many, which both pass.
fn beside_the_parts(rows: &mut [Row]) {
    let find = |label: &str, mode, regime| {
        let is_it = |row: &&Row| {
            row.what == "hop" && row.label() == label && row.mode == mode && row.regime == regime
        };
        rows.iter().position(|row| is_it(&row))
    };
    let Some(((hop, futex), polled)) = find("lager", Mode::Block, Regime::SameCore)
        .zip(find("futex", Mode::Block, Regime::SameCore))
        .zip(find("iceoryx2/header", Mode::Spin, Regime::Plain))
    else {
        return;
    };
    let ratio = |figure: fn(&Row) -> u64| {
        figure(&rows[hop]) as f64 / (figure(&rows[futex]) + figure(&rows[polled])) as f64
    };
    let [p50, p99] = [ratio(|row| row.p50_ns), ratio(|row| row.p99_ns)];
    rows[hop].ratios.push(Ratio {
        to: PARTS_OF_A_HOP.to_owned(),
        p50,
        p99,
        runs: vec![[p50, p99]],
    });
}

fn in_regime(regime: Regime, options: &Options) -> Result<Vec<Row>, BenchError> {
    let alike: Vec<Contender> = Contender::ALL
        .into_iter()
        .filter(|contender| contender.mode() != Mode::Adaptive)
        .collect();
    const BESIDE_ADAPTIVE: [Contender; 3] = [
        Contender::Lager(Mode::Spin),
        Contender::IceoryxHeader,
        Contender::Lager(Mode::Adaptive),
    ];
    let alike = chosen(&alike, regime, options);
    let adaptive: Vec<Contender> = if options.modes.contains(&Mode::Adaptive) {
        chosen(&BESIDE_ADAPTIVE, regime, options)
    } else {
        Vec::new()
    };
    if alike.is_empty() && adaptive.is_empty() {
        return Ok(Vec::new());
    }
    let mut session = Session::open(regime)?;
    let mut rows = Vec::new();
    for (what, contenders, timing) in [
        ("hop", &alike, Timing::ThereAndBack),
        ("hop@full-rate", &adaptive, Timing::OneWay { gap_ns: 0 }),
        ("hop@10kHz", &adaptive, Timing::OneWay { gap_ns: PACE_NS }),
    ] {
        rows.extend(group(what, contenders, timing, &mut session, options)?);
    }
    Ok(rows)
}

fn chosen(all: &[Contender], regime: Regime, options: &Options) -> Vec<Contender> {
    let working: Vec<Contender> = all
        .iter()
        .copied()
        .filter(|contender| contender.works_in(regime))
        .collect();
    let entries: Vec<_> = working.iter().map(|contender| contender.entry()).collect();
    wanted(&entries, options)
        .into_iter()
        .map(|index| working[index])
        .collect()
}

fn group(
    what: &str,
    contenders: &[Contender],
    timing: Timing,
    session: &mut Session,
    options: &Options,
) -> Result<Vec<Row>, BenchError> {
    let entries: Vec<_> = contenders
        .iter()
        .map(|contender| contender.entry())
        .collect();
    let rounds = if options.quick { 2 } else { 4 };
    let regime = session.regime;
    run::measure(what, regime, &entries, options, rounds, |index| {
        let contender = contenders[index];
        session.round(contender, balls(contender, timing, options.quick), timing)
    })
}

/// Balls of a round: as many as take a fraction of a second.
fn balls(contender: Contender, timing: Timing, quick: bool) -> u32 {
    match (contender.mode(), timing.gap_ns() > 0, quick) {
        (Mode::Block, _, false) => 2_500,
        (Mode::Block, _, true) | (_, true, true) => 500,
        (_, true, false) => 2_000,
        (_, false, false) => 20_000,
        (_, false, true) => 5_000,
    }
}

/// Two processes, each on its core, that play rounds with any contender.
pub struct Session {
    // Dropped in this order: nobody is on the bus when it is swept.
    first: Part,
    second: Part,
    _awake: Awake,
    _lines: Lines<OwnedFd>,
    _court: Shared<Court>,
    _domain: Domain,
    regime: Regime,
    rounds: u32,
}

impl Session {
    /// Starts both processes.
    ///
    /// # Errors
    /// There are too few cores, or something cannot be made.
    pub fn open(regime: Regime) -> Result<Self, BenchError> {
        let cores = machine::cores_for(regime)?;
        let domain = Domain::new()?;
        let court = Shared::<Court>::new()?;
        let lines = lines()?;
        let awake = Awake::during(regime)?;
        let start = |name, core| {
            let mut part = Part::start(name)?;
            let () = part.ask(&Setup {
                core,
                folder: domain.folder().to_owned(),
                court: court.number(),
                lines: numbers(&lines),
            })?;
            Ok::<Part, BenchError>(part)
        };
        Ok(Self {
            first: start(FIRST, cores.0)?,
            second: start(SECOND, cores.1)?,
            _awake: awake,
            _lines: lines,
            _court: court,
            _domain: domain,
            regime,
            rounds: 0,
        })
    }

    /// Throws some balls to warm up and then `balls` that are timed. Returns the time of one way of
    /// each, in ns.
    ///
    /// # Errors
    /// A player failed; the session is of no more use.
    pub fn round(
        &mut self,
        contender: Contender,
        balls: u32,
        timing: Timing,
    ) -> Result<Vec<u64>, BenchError> {
        self.rounds += 1;
        let round = Round {
            contender,
            warm_up: balls / 10 + 10,
            balls,
            timing,
            number: self.rounds,
            spin_ns: slow::spin_ns(),
        };
        // Players give up by themselves when nothing comes; this is for those that cannot, because
        // a bare `read` has no time-out: ten times what the slowest machine should need.
        let limit = Duration::from_secs(60)
            + (Duration::from_nanos(timing.gap_ns()) + Duration::from_micros(500))
                * (balls + balls / 10);
        self.first.tell(&round)?;
        self.second.tell(&round)?;
        let (first, second): (Vec<u64>, Vec<u64>) =
            Part::both(&mut self.first, &mut self.second, limit)?;
        if timing == Timing::ThereAndBack {
            return Ok(first);
        }
        Ok(first
            .iter()
            .zip(&second)
            .map(|(thrown, caught)| caught.saturating_sub(*thrown))
            .collect())
    }
}

impl fmt::Debug for Session {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Session")
            .field("regime", &self.regime)
            .field("rounds", &self.rounds)
            .finish_non_exhaustive()
    }
}

fn lines() -> Result<Lines<OwnedFd>, BenchError> {
    let kernel = |what| {
        move |error: std::io::Error| BenchError::Kernel {
            what,
            detail: error.to_string(),
        }
    };
    let pipe = || stream::a_pipe().map_err(|error| kernel("a pipe")(error.into()));
    // Without CLOEXEC: the players inherit it.
    let bell =
        || eventfd(0, EventfdFlags::empty()).map_err(|error| kernel("an eventfd")(error.into()));
    let uds = stream::datagrams().map_err(|error| kernel("a Unix socket")(error.into()))?;
    let tcp = stream::loopback().map_err(kernel("a TCP connection over loopback"))?;
    Ok(Lines {
        pipes: [pipe()?, pipe()?],
        eventfds: [bell()?, bell()?],
        uds: [uds.0, uds.1],
        tcp: [tcp.0, tcp.1],
    })
}

fn numbers(lines: &Lines<OwnedFd>) -> Lines<i32> {
    let number = AsRawFd::as_raw_fd;
    Lines {
        pipes: [0, 1].map(|index| {
            let (read, write) = &lines.pipes[index];
            (number(read), number(write))
        }),
        eventfds: [0, 1].map(|index| number(&lines.eventfds[index])),
        uds: [0, 1].map(|index| number(&lines.uds[index])),
        tcp: [0, 1].map(|index| number(&lines.tcp[index])),
    }
}
