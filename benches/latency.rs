//! `latency/<what>/<mode>/<regime>`: criterion times the rows that `benches/limits.toml` limits, each
//! in one group with its baseline. `benches/guard` runs this program several times and holds the
//! ratios of the estimates. `lager bench` measures all other rows, with whole distributions.
//!
//! Criterion's iteration is a round of many samples with ports of its own, and the time of an iteration
//! is the round's median (`lager_benches::Session`): a mean would tell how often the machine
//! interrupted it, and single samples would share the places that one pair of ports has in memory.
//!
//! Exit codes: 75 if a round failed on a machine that was held up, and may be tried again.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process::ExitCode;
use std::time::Duration;

use clap::ValueEnum;
use criterion::{BenchmarkGroup, Criterion, SamplingMode, measurement::WallTime};
use lager_benches::{
    BenchError, Group, Mode, Options, Regime, Scenario, Session, Taken, interrupted, median, slow,
};
use lager_rig::Watch;

/// The exit code for "try again": EX_TEMPFAIL of sysexits.h.
const HELD_UP: u8 = 75;

/// Criterion's samples of a row, each of two rounds or more.
const SAMPLES: usize = 10;

/// A group: its names in `lager bench`, its rows, how many samples a round has, and how long criterion
/// measures a row, in ms.
type Timed = (
    &'static str,
    Mode,
    Regime,
    &'static [&'static str],
    usize,
    u64,
);

/// The groups that have limits.
const GROUPS: &[Timed] = {
    use Mode::{Adaptive, Block, Spin};
    use Regime::{NoHalt, Plain, SameCore};
    &[
        ("hop", Spin, Plain, SPINNING, 2_000, 300),
        ("hop@full-rate", Adaptive, Plain, SPINNING, 2_000, 300),
        ("hop@10kHz", Adaptive, Plain, SPINNING, 250, 700),
        ("hop", Block, SameCore, &["lager", EVENT, "futex"], 500, 300),
        ("hop", Block, NoHalt, &["lager", EVENT], 500, 500),
        ("ring-64", Block, SameCore, RUNG, 50, 900),
        ("publish-1", Spin, Plain, SPINNING, 500, 300),
        ("publish-64", Spin, Plain, SPINNING, 200, 1_000),
        ("path", Block, Plain, &["lager/block", "floor"], 50, 2_000),
        ("path@observed", Block, Plain, OBSERVED, 50, 2_000),
    ]
};
const SPINNING: &[&str] = &["lager", "iceoryx2/header"];
const EVENT: &str = "iceoryx2/event";
const RUNG: &[&str] = &["lager/ring", "iceoryx2/notify"];
const OBSERVED: &[&str] = &["lager/64 observers", "lager/alone"];

fn main() -> ExitCode {
    lager_benches::run_if_asked();
    slow::refuse_in_vain();
    let mut criterion = Criterion::default()
        .nresamples(10_000)
        .configure_from_args();
    for (what, mode, regime, rows, samples, measured_ms) in GROUPS {
        let mut benches = criterion.benchmark_group(format!("latency/{what}/{mode}/{regime}"));
        benches
            .sampling_mode(SamplingMode::Flat)
            .sample_size(SAMPLES)
            .warm_up_time(Duration::from_millis(measured_ms / 10))
            .measurement_time(Duration::from_millis(*measured_ms));
        let group = group(what, *mode, *regime);
        let watch = Watch::begin();
        let timed = catch_unwind(AssertUnwindSafe(|| {
            time(&mut benches, &group, rows, *samples);
        }));
        if let Err(panic) = timed {
            let error = failed(panic).seen_by(watch);
            eprintln!("{error}");
            match error {
                // `path@observed`, whose limits the guard then does not judge.
                BenchError::RealTime(_) => {}
                BenchError::HeldUp(..) => return ExitCode::from(HELD_UP),
                _ => return ExitCode::FAILURE,
            }
        }
    }
    criterion.final_summary();
    ExitCode::SUCCESS
}

/// The group with that name, as `lager bench` measures it.
fn group(what: &str, mode: Mode, regime: Regime) -> Group {
    let options = Options {
        modes: vec![mode],
        regimes: vec![regime],
        ..Options::default()
    };
    let scenarios = Scenario::value_variants().iter();
    let mut groups = scenarios.flat_map(|scenario| scenario.groups(&options));
    groups
        .find(|group| group.what == what)
        .expect("a scenario has it")
}

/// Lets criterion time the rows. What fails in a round leaves this function as a panic with a
/// [`BenchError`], because criterion knows no errors.
fn time(benches: &mut BenchmarkGroup<'_, WallTime>, group: &Group, rows: &[&str], samples: usize) {
    // Opened at the first measurement: a row that the filter leaves out starts no process.
    let mut session: Option<Box<dyn Session>> = None;
    for row in rows {
        let index = group.entries.iter().position(|entry| entry.label == *row);
        let index = index.expect("the group has the row");
        benches.bench_function(*row, |bencher| {
            let session = session.get_or_insert_with(|| or_panic(group.open()));
            bencher.iter_custom(|rounds| {
                let round = |_| match interrupted() {
                    true => or_panic(Err(BenchError::Interrupted)),
                    false => typical_ns(&or_panic(session.round(index, samples))),
                };
                let total_ns: f64 = (0..rounds).map(round).sum();
                Duration::from_secs_f64(total_ns / 1e9)
            });
        });
    }
}

fn or_panic<T>(result: Result<T, BenchError>) -> T {
    result.unwrap_or_else(|error| resume_unwind(Box::new(error)))
}

fn failed(panic: Box<dyn Any + Send>) -> BenchError {
    *panic
        .downcast()
        .unwrap_or_else(|panic| resume_unwind(panic))
}

/// The median of a round, in ns.
fn typical_ns(taken: &Taken) -> f64 {
    let times: Vec<f64> = taken.service.iter().map(|ns| *ns as f64).collect();
    median(times).unwrap_or_default()
}
