//! `latency/<what>/<mode>/<row>`: criterion times every row of every scenario on two cores, one row
//! after the other. To compare rows, use `lager bench`, where they take turns.

use std::time::Duration;

use clap::ValueEnum;
use criterion::{Criterion, SamplingMode};
use lager_benches::{Options, Regime, Scenario, Session};

fn main() {
    lager_benches::run_if_asked();
    let mut criterion = Criterion::default().configure_from_args();
    let options = Options {
        regimes: vec![Regime::Plain],
        ..Options::default()
    };
    for scenario in Scenario::value_variants() {
        for group in scenario.groups(&options) {
            let mut benches = criterion.benchmark_group(format!("latency/{}", group.what));
            benches
                .sampling_mode(SamplingMode::Flat)
                .sample_size(10)
                .warm_up_time(Duration::from_millis(100))
                .measurement_time(Duration::from_secs(1));
            // Opened at the first measurement: a row that the filter leaves out starts no process.
            let mut session: Option<Box<dyn Session>> = None;
            for (index, entry) in group.entries.iter().enumerate() {
                let name = format!("{}/{}", entry.mode, entry.label);
                benches.bench_function(name, |bencher| {
                    bencher.iter_custom(|samples| {
                        let session = session.get_or_insert_with(|| {
                            group.open().unwrap_or_else(|error| panic!("{error}"))
                        });
                        let samples = usize::try_from(samples).unwrap_or(usize::MAX);
                        match session.round(index, samples) {
                            Ok(taken) => Duration::from_nanos(taken.service.iter().sum()),
                            Err(error) => panic!("{error}"),
                        }
                    });
                });
            }
            benches.finish();
        }
    }
    criterion.final_summary();
}
