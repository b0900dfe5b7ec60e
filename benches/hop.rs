//! `latency/hop/<mode>/<contender>`: one way between two processes, as fast as they throw and
//! catch, each on a core of its own; beside every baseline. criterion measures one after the other,
//! so compare what `lager bench hop` prints, where they take turns.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, SamplingMode};
use lager_benches::hop::{Contender, Session, Timing};
use lager_benches::{Mode, Regime, cast};

fn hop(criterion: &mut Criterion) {
    let mut session = match Session::open(Regime::Plain) {
        Ok(session) => session,
        Err(error) => panic!("{error}"),
    };
    for mode in Mode::ALL {
        let timing = match mode {
            Mode::Adaptive => Timing::OneWay { gap_ns: 0 },
            Mode::Spin | Mode::Block => Timing::ThereAndBack,
        };
        let mut group = criterion.benchmark_group(format!("latency/hop/{mode}"));
        group
            .sampling_mode(SamplingMode::Flat)
            .sample_size(10)
            .warm_up_time(Duration::from_millis(100))
            .measurement_time(Duration::from_secs(1));
        for contender in Contender::ALL {
            if contender.mode() != mode {
                continue;
            }
            group.bench_function(BenchmarkId::from_parameter(contender.label()), |bencher| {
                bencher.iter_custom(|balls| {
                    let balls = u32::try_from(balls).unwrap_or(u32::MAX);
                    match session.round(contender, balls, timing) {
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
    hop(&mut criterion);
    criterion.final_summary();
}
