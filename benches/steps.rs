//! `codec/*`, `publish/*`, `receive`, `decide` and `arbitrate`: criterion times the steps of the
//! path within this process (`lager_benches::steps`). `instructions` counts their instructions,
//! which a busy machine does not change.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BatchSize, Bencher, Criterion, Throughput, criterion_group, criterion_main};
use lager_benches::steps::{self, Ports, a_second_of_bytes, a_second_of_packets};

/// Beside decoding it times a copy of the same bytes: any decoder must do at least that.
fn codec(criterion: &mut Criterion) {
    let (bytes, packets) = (a_second_of_bytes(), a_second_of_packets());
    let mut group = criterion.benchmark_group("codec");
    group.throughput(Throughput::Elements(packets.len() as u64));
    group.bench_function("decode/baseline-copy", |bencher| {
        let mut target = vec![0; bytes.len()];
        bencher.iter(|| {
            for (to, from) in target.iter_mut().zip(black_box(&bytes)) {
                *to = *from;
            }
            black_box(&target);
        });
    });
    group.bench_function("decode/version-1", |bencher| {
        bencher.iter(|| assert_eq!(steps::decode(&bytes), packets.len()));
    });
    group.bench_function("encode/version-1", |bencher| {
        bencher.iter(|| steps::encode(&packets));
    });
    group.finish();
}

/// Times `step` on ports with this number of subscribers, each time after `before`.
fn timed(
    bencher: &mut Bencher<'_>,
    subscribers: usize,
    before: impl Fn(&mut Ports),
    step: impl Fn(&mut Ports),
) {
    let mut ports = Ports::meet(subscribers);
    bencher.iter_custom(|samples| {
        let mut total = Duration::ZERO;
        for _ in 0..samples {
            before(&mut ports);
            let start = Instant::now();
            step(&mut ports);
            total += start.elapsed();
        }
        total
    });
}

/// No queue is ever full: the earlier sample is received first.
fn publish(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("publish");
    for subscribers in [1, 8, 64] {
        group.bench_function(format!("to-{subscribers}"), |bencher| {
            let drain = |ports: &mut Ports| assert!(ports.drain() <= subscribers);
            timed(bencher, subscribers, drain, |ports| ports.publish());
        });
    }
    group.finish();
}

fn receive(criterion: &mut Criterion) {
    criterion.bench_function("receive", |bencher| {
        let receive = |ports: &mut Ports| assert!(ports.receive().is_some());
        timed(bencher, 1, |ports| ports.publish(), receive);
    });
}

/// One iteration decides on the line frames of one second.
fn decide(criterion: &mut Criterion) {
    criterion.bench_function("decide/second-of-frames", |bencher| {
        let decide = |navigator: &mut _| steps::navigate(navigator, Duration::ZERO);
        bencher.iter_batched_ref(steps::driving, decide, BatchSize::SmallInput);
    });
}

fn arbitrate(criterion: &mut Criterion) {
    criterion.bench_function("arbitrate/new-order", |bencher| {
        let arbitrate = |arbiter: &mut _| steps::arbitrate(arbiter, 2);
        bencher.iter_batched_ref(steps::steering, arbitrate, BatchSize::SmallInput);
    });
}

criterion_group!(benches, codec, publish, receive, decide, arbitrate);
criterion_main!(benches);
