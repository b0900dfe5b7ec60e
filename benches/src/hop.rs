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
use crate::group::{Entry, Group, wanted};
use crate::pair::Pair;
use crate::report::{Mode, Options, Ratio, Regime, Row};
use contender::Contender;
use processes::{Job, Lanes, Lines, Timing};

const SENDER: &str = "sender of the hop";
const RECEIVER: &str = "receiver of the hop";

pub(crate) const PROCESSES: &[(&str, Main)] =
    &[(SENDER, processes::sender), (RECEIVER, processes::receiver)];

/// From one sample to the next when they come at 10 kHz.
const PACE: Duration = Duration::from_micros(100);

/// The groups of one regime.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    let mut groups = vec![group("hop", Timing::RoundTrip, regime, options)];
    if options.modes.contains(&Mode::Adaptive) {
        let full_rate = Timing::OneWay(Duration::ZERO);
        groups.push(group("hop@full-rate", full_rate, regime, options));
        groups.push(group("hop@10kHz", Timing::OneWay(PACE), regime, options));
    }
    groups
}

fn group(what: &str, timing: Timing, regime: Regime, options: &Options) -> Group {
    let takes_part = |(entry, contender): &(Entry, Contender)| {
        let is_timed_so = match timing {
            Timing::RoundTrip => entry.mode != Mode::Adaptive,
            Timing::OneWay(_) => matches!(
                contender,
                Contender::Lager(Mode::Spin | Mode::Adaptive) | Contender::IceoryxHeader
            ),
        };
        // On a shared core, whoever looks without pause keeps the sender from sending.
        is_timed_so && (regime != Regime::SameCore || entry.mode == Mode::Block)
    };
    let working = Contender::ALL
        .iter()
        .filter(|one| takes_part(one))
        .cloned()
        .map(|(entry, contender)| (entry, Job { contender, timing }));
    let rows = wanted(working, options);
    let samples = rows
        .iter()
        .map(|(entry, _)| samples(entry.mode, timing))
        .collect();
    let group = Group::new(what, regime, rows, [2, 4], [0; 2], move |regime, rows| {
        let lines = lines()?;
        // Both processes inherit the lines when they start.
        let numbers = lines
            .each_ref()
            .map(|pair| pair.each_ref().map(OwnedFd::as_raw_fd));
        let ends = [SENDER, RECEIVER];
        let pair = Pair::<Lanes, _>::start(regime, ends, &numbers, rows, timing.gap())?;
        Ok(Box::new(pair))
    });
    Group { samples, ..group }
}

/// Samples of a round: as many as take a fraction of a second.
fn samples(mode: Mode, timing: Timing) -> [usize; 2] {
    match (mode, timing.gap().is_zero()) {
        (Mode::Block, _) => [500, 2_500],
        (_, false) => [500, 2_000],
        (_, true) => [5_000, 20_000],
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
