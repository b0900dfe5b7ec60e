//! `hop`: measures the time of a sample from one process to another.
//!
//! ```text
//!              sender, core 0                    receiver, core 1
//!       sent ─ send ────────── 64 bytes ──────────> receive
//!                                                      │
//!   received ─ receive <────── the same back ──────── send      one way = (received - sent) / 2
//! ```
//!
//! Both ends use the same carrier and wait in the same way, except in `adaptive`. There the
//! receiver adapts, and the sender spins to keep the pace in the row's name. Only the way to the
//! receiver is timed then, for the carrier and for its baseline (both ends read the same clock,
//! CLOCK_MONOTONIC): half of a round trip would hide half of a delay at one end.
//!
//! Rows called `hop` are half of the round trip, as fast as samples come back. `hop@full-rate` is
//! one way at the same rate, `hop@10kHz` one way with a sample due every 100 µs. With `--rate`, every
//! mode is measured one way at that rate. With `--size` or `--observers` the rows are those of [`sized`].

mod ends;
mod sized;

use std::error::Error;
use std::os::fd::OwnedFd;

use clap::ValueEnum as _;
use lager_rig::process::Main;
use lager_rig::{Parent, Refused};
use rustix::event::{EventfdFlags, eventfd};
use rustix::pipe::pipe;

use crate::baseline::stream;
use crate::error::BenchError;
use crate::group::{Entry, Group};
use crate::machine::cores_for;
use crate::pair::{self, Noted, Side};
use crate::report::{Mode, Options, Pace, Ratio, Regime, Row};
use ends::{HEADER, Job, One};

const SENDER: &str = "sender of the hop";
const RECEIVER: &str = "receiver of the hop";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(SENDER, exchange), (RECEIVER, exchange)];

fn exchange(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pair::measure(parent, round)
}

/// One round in one of the two processes.
fn round(side: &Side, round: &ends::Round) -> Result<Noted, BenchError> {
    let one = One { side, round };
    match round.what.words {
        None => ends::round(&one),
        Some(words) => sized::round(&one, words),
    }
}

/// The groups of one regime: the rows of one mode, and their baselines.
pub(crate) fn groups(regime: Regime, options: &Options) -> Vec<Group> {
    // For each group: the pace if one way is timed, and the number of samples that take a fraction
    // of a second.
    let mut groups = vec![
        (Mode::Spin, None, [5_000, 20_000]),
        (Mode::Block, None, [500, 2_500]),
        (Mode::Adaptive, Some(Pace::Full), [5_000, 20_000]),
        (Mode::Adaptive, Some(Pace::Hz(10e3)), [2_000; 2]),
    ];
    if let Some(pace) = options.pace {
        let samples = match pace {
            Pace::Full => [5_000, 20_000],
            Pace::Hz(hz) => [(hz / 5.0).clamp(20.0, 5_000.0) as usize; 2],
        };
        groups = Mode::value_variants()
            .iter()
            .map(|mode| (*mode, Some(pace), samples))
            .collect();
    }
    let words = options.words();
    groups
        .into_iter()
        .filter(|(mode, ..)| options.modes.contains(mode))
        // On a shared core, a process that looks without pause keeps the sender from sending.
        .filter(|(mode, ..)| regime != Regime::SameCore || *mode == Mode::Block)
        .map(|(mode, pace, samples)| {
            let (gap, cores) = (pace.map(Pace::gap), options.cores);
            let takes_part = |entry: &Entry| {
                entry.mode == mode || (mode == Mode::Adaptive && entry.label == HEADER)
            };
            let all: Vec<Entry> = match words {
                None => ends::ROWS.iter().map(|(entry, _)| *entry).collect(),
                Some(_) => sized::ROWS.iter().map(|(entry, _)| *entry).collect(),
            };
            let job = |(row, entry): (usize, Entry)| {
                let watched = entry.label == sized::OBSERVED;
                let observers = options.observers.filter(|_| watched).unwrap_or(0);
                let job = Job {
                    row,
                    gap,
                    words,
                    observers,
                };
                (entry, job)
            };
            let numbered = all.into_iter().enumerate();
            let rows: Vec<_> = numbered
                .filter(|(_, entry)| takes_part(entry))
                .filter(|(_, entry)| entry.label != sized::OBSERVED || options.observers.is_some())
                .map(job)
                .collect();
            let samples = words.map_or(samples, |words| {
                samples.map(|usual| sized::samples(usual, 8 * words))
            });
            Group {
                what: what(pace, options),
                regime,
                entries: rows.iter().map(|(entry, _)| *entry).collect(),
                rounds: pair::ROUNDS,
                samples,
                open: Box::new(move || {
                    // Both processes inherit the lines when they start.
                    let cores = cores_for(regime, cores)?;
                    let names = [SENDER, RECEIVER];
                    pair::open(
                        cores,
                        gap.unwrap_or_default(),
                        names,
                        &lines()?,
                        rows.clone(),
                    )
                }),
            }
        })
        .collect()
}

/// The name of a group: `hop`, `hop@10kHz`, `hop@1MiB,10kHz,8 observers`, …
fn what(pace: Option<Pace>, options: &Options) -> String {
    let size = options.size.map(|bytes| match bytes {
        ..1_024 => format!("{bytes}B"),
        1_024..1_048_576 => format!("{}KiB", bytes >> 10),
        _ => format!("{}MiB", bytes >> 20),
    });
    let pace = pace.map(|pace| pace.to_string());
    let observers = options.observers.map(|many| match many {
        1 => "1 observer".to_owned(),
        many => format!("{many} observers"),
    });
    let parts: Vec<_> = [size, pace, observers].into_iter().flatten().collect();
    match &*parts {
        [] => "hop".to_owned(),
        parts => format!("hop@{}", parts.join(",")),
    }
}

/// The descriptors of the kernel's carriers, in the order of the constants in `ends`.
fn lines() -> Result<[[OwnedFd; 2]; 5], BenchError> {
    let a_pipe = || pipe().map_err(Refused::to_make("a pipe"));
    // Without CLOEXEC, so that the processes inherit it.
    let bell = || eventfd(0, EventfdFlags::empty()).map_err(Refused::to_make("an eventfd"));
    let uds = stream::datagrams().map_err(Refused::to_make("a Unix socket"))?;
    let tcp = stream::loopback().map_err(Refused::to_make("a TCP connection over loopback"))?;
    Ok([
        a_pipe()?.into(),
        a_pipe()?.into(),
        [bell()?, bell()?],
        uds.into(),
        tcp.into(),
    ])
}

/// The name of the least time that a blocking hop can take.
const ITS_PARTS: &str = "futex + polled iceoryx2";

/// Compares the blocking hop on one core with the sum of its two parts: a hop of a futex on that
/// core, and a hop of bare iceoryx2 that is polled from another core. Each part passes a cache
/// line, so the sum has one too many.
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
    let ratio = |percentile: fn(&Row) -> Option<u64>| {
        let parts = percentile(&rows[futex])? + percentile(&rows[polled])?;
        Some(percentile(&rows[hop])? as f64 / parts as f64)
    };
    let (Some(p50), p99) = (ratio(|row| row.times.p50_ns), ratio(|row| row.times.p99_ns)) else {
        return;
    };
    rows[hop].ratios.push(Ratio {
        to: ITS_PARTS.to_owned(),
        p50,
        p99,
        runs: vec![(p50, p99)],
    });
}
