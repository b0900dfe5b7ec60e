//! `latency/fanout/<n>/<contender>`: publishing 64 bytes to n subscribers on another core, our
//! typed ports and bare iceoryx2. criterion measures one after the other, so compare what `lager
//! bench fanout` prints, where they take turns.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, SamplingMode};
use lager_benches::fanout::{Contender, READERS_OF, Small};
use lager_benches::{Regime, cast};

fn fanout(criterion: &mut Criterion) {
    for readers in READERS_OF {
        let mut group = criterion.benchmark_group(format!("latency/fanout/{readers}"));
        group
            .sampling_mode(SamplingMode::Flat)
            .sample_size(10)
            .warm_up_time(Duration::from_millis(100))
            .measurement_time(Duration::from_secs(1));
        // Opened when it is measured: a name that was filtered out starts no process.
        let mut session = None;
        for (name, contender) in [
            ("lager", Contender::Lager),
            ("iceoryx2", Contender::Iceoryx2),
        ] {
            group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
                bencher.iter_custom(|publishes| {
                    let publishes = usize::try_from(publishes).unwrap_or(usize::MAX);
                    let session = session.get_or_insert_with(|| {
                        Small::open(Regime::Plain, readers)
                            .unwrap_or_else(|error| panic!("{error}"))
                    });
                    match session.round(contender, publishes) {
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
    fanout(&mut criterion);
    criterion.final_summary();
}
