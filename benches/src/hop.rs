//! `hop`: one way between two processes.
//!
//! ```text
//!              sender, core 0                    receiver, core 1
//!       sent ─ send ────────── 64 bytes ──────────> receive
//!                                                      │
//!   received ─ receive <────── the same back ──────── send      one way = (received - sent) / 2
//! ```
//!
//! Both ends are the same contender and wait the same way, except for `adaptive`: of two cores only
//! one is ever given to adaptive spinning, so there the receiver adapts and the sender spins. Then
//! only the way to the receiver is timed, for the contender and for its baseline (both ends read
//! the same clock, CLOCK_MONOTONIC); half a round trip would hide half of a delay at one end.
//!
//! Rows called `hop` are half of the round trip, as fast as samples come back; `hop@full-rate` is
//! one way at the same rate, `hop@10kHz` with a sample every 100 µs.

mod contender;
mod ours;
mod processes;

use core::time::Duration;
use std::os::fd::{AsRawFd, OwnedFd};

use lager_rig::Refused;
use lager_rig::process::Main;
use rustix::event::{EventfdFlags, eventfd};

use crate::baseline::stream;
use crate::error::BenchError;
use crate::group::{Group, Session, wanted};
use crate::pair::Pair;
use crate::report::{Mode, Options, Ratio, Regime, Row};
use crate::slow;
use contender::Contender;
use processes::{Lanes, Lines, Round, Timing};

const SENDER: &str = "sender of the hop";
const RECEIVER: &str = "receiver of the hop";

pub(crate) const PROCESSES: &[(&str, Main)] =
    &[(SENDER, processes::sender), (RECEIVER, processes::receiver)];

/// From one sample to the next when they come at 10 kHz.
const PACE_NS: u64 = 100_000;

/// What takes part where the receiver adapts.
const BESIDE_ADAPTIVE: [Contender; 3] = [
    Contender::Lager(Mode::Spin),
    Contender::IceoryxHeader,
    Contender::Lager(Mode::Adaptive),
];

/// The groups of one regime.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    let alike = Contender::ALL
        .into_iter()
        .filter(|contender| contender.mode() != Mode::Adaptive)
        .collect();
    let adaptive = match options.modes.contains(&Mode::Adaptive) {
        true => BESIDE_ADAPTIVE.to_vec(),
        false => Vec::new(),
    };
    [
        ("hop", alike, Timing::RoundTrip),
        (
            "hop@full-rate",
            adaptive.clone(),
            Timing::OneWay { gap_ns: 0 },
        ),
        ("hop@10kHz", adaptive, Timing::OneWay { gap_ns: PACE_NS }),
    ]
    .map(|(what, contenders, timing)| group(what, contenders, timing, regime, options))
    .into()
}

fn group(
    what: &str,
    contenders: Vec<Contender>,
    timing: Timing,
    regime: Regime,
    options: &Options,
) -> Group {
    let working = contenders
        .into_iter()
        .filter(|contender| contender.works_in(regime))
        .map(|contender| (contender.entry(), contender));
    let (entries, contenders) = wanted(working, options);
    let samples = contenders
        .iter()
        .map(|contender| samples(*contender, timing))
        .collect();
    let group = Group::new(what, regime, entries, [2, 4], [0; 2], move |regime| {
        Ok(Box::new(Hop::open(regime, contenders.clone(), timing)?))
    });
    Group { samples, ..group }
}

/// Samples of a round: as many as take a fraction of a second.
fn samples(contender: Contender, timing: Timing) -> [usize; 2] {
    match (contender.mode(), timing.gap_ns() > 0) {
        (Mode::Block, _) => [500, 2_500],
        (_, true) => [500, 2_000],
        (_, false) => [5_000, 20_000],
    }
}

/// Sender and receiver, which measure any contender.
struct Hop {
    pair: Pair<Lanes>,
    // The processes have inherited them.
    _lines: Lines<OwnedFd>,
    contenders: Vec<Contender>,
    timing: Timing,
}

impl Hop {
    fn open(
        regime: Regime,
        contenders: Vec<Contender>,
        timing: Timing,
    ) -> Result<Self, BenchError> {
        let lines = lines()?;
        let numbers: Lines<i32> = lines.each_ref().map(|pair| {
            pair.each_ref()
                .map(|descriptor: &OwnedFd| descriptor.as_raw_fd())
        });
        Ok(Self {
            pair: Pair::start(regime, [SENDER, RECEIVER], &numbers)?,
            _lines: lines,
            contenders,
            timing,
        })
    }
}

impl Session for Hop {
    /// Some samples more are sent before, to warm up.
    fn round(&mut self, index: usize, samples: usize) -> Result<Vec<u64>, BenchError> {
        let (contender, timing) = (self.contenders[index], self.timing);
        let samples = u32::try_from(samples).unwrap_or(u32::MAX);
        // Both give up by themselves when nothing comes; this is for those that cannot, because
        // a bare `read` has no time-out: ten times what the slowest machine should need.
        let limit = Duration::from_secs(60)
            + (Duration::from_nanos(timing.gap_ns()) + Duration::from_micros(500))
                * (samples + samples / 10);
        let round = |number| Round {
            contender,
            warm_up: samples / 10 + 10,
            samples,
            timing,
            number,
            spin_ns: slow::spin_ns(),
        };
        let (sender, receiver): (Vec<u64>, Vec<u64>) = self.pair.round(round, limit)?;
        if timing == Timing::RoundTrip {
            return Ok(sender);
        }
        Ok(sender
            .iter()
            .zip(&receiver)
            .map(|(sent, received)| received.saturating_sub(*sent))
            .collect())
    }
}

fn lines() -> Result<Lines<OwnedFd>, BenchError> {
    let pipe = || {
        let (read, write) = stream::a_pipe().map_err(Refused::to_make("a pipe"))?;
        Ok::<_, Refused>([read, write])
    };
    // Without CLOEXEC: the processes inherit it.
    let bell = || eventfd(0, EventfdFlags::empty()).map_err(Refused::to_make("an eventfd"));
    let uds = stream::datagrams().map_err(Refused::to_make("a Unix socket"))?;
    let tcp = stream::loopback().map_err(Refused::to_make("a TCP connection over loopback"))?;
    Ok([
        pipe()?,
        pipe()?,
        [bell()?, bell()?],
        [uds.0, uds.1],
        [tcp.0, tcp.1],
    ])
}

/// What the floor of a blocking hop is called.
const ITS_PARTS: &str = "futex + polled iceoryx2";

/// Compares the blocking hop on one core with the sum of what it is made of: a hop of a futex on
/// that core, and one of bare iceoryx2 that is polled from another core. The sum has one cache line
/// too many, which both pass.
pub(crate) fn beside_its_parts(rows: &mut [Row]) {
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
        to: ITS_PARTS.to_owned(),
        p50,
        p99,
        runs: vec![[p50, p99]],
    });
}
