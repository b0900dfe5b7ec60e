//! `latency/path/<mode>/<contender>`: from a sensor frame on one pty to its command on the other,
//! frames a millisecond apart. criterion measures one after the other, so compare what
//! `lager bench path` prints, where they take turns.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, SamplingMode};
use lager_benches::path::Session;
use lager_benches::{BenchError, Mode, cast};

type Open = fn() -> Result<Session, BenchError>;

const SESSIONS: [(Mode, &str, Open); 3] = [
    (Mode::Block, "lager", || Session::lager(Mode::Block)),
    (Mode::Block, "floor", Session::floor),
    (Mode::Adaptive, "lager", || Session::lager(Mode::Adaptive)),
];

fn path(criterion: &mut Criterion) {
    for mode in [Mode::Block, Mode::Adaptive] {
        let mut group = criterion.benchmark_group(format!("latency/path/{mode}"));
        group
            .sampling_mode(SamplingMode::Flat)
            .sample_size(10)
            .warm_up_time(Duration::from_millis(100))
            .measurement_time(Duration::from_secs(1));
        for (_, contender, open) in SESSIONS.iter().filter(|(one, ..)| *one == mode) {
            // Opened when it is measured: a name that was filtered out starts no process.
            let mut session: Option<Session> = None;
            group.bench_function(BenchmarkId::from_parameter(contender), |bencher| {
                bencher.iter_custom(|frames| {
                    let frames = usize::try_from(frames).unwrap_or(usize::MAX);
                    let session = session
                        .get_or_insert_with(|| open().unwrap_or_else(|error| panic!("{error}")));
                    match session.round(frames) {
                        Ok(samples) => Duration::from_nanos(samples.iter().sum()),
                        Err(error) => panic!("{error}"),
                    }
                });
            });
        }
        group.finish();
    }
}

fn main() {
    cast::play_if_asked();
    let mut criterion = Criterion::default().configure_from_args();
    path(&mut criterion);
    criterion.final_summary();
}
