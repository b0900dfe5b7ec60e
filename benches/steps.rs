//! `steps/*`: criterion times the steps of the path within this process (`lager_benches::steps`), each
//! in one group with its baseline. `benches/guard` holds the ratios. `instructions` counts their
//! instructions, which a busy machine does not change.

use std::time::{Duration, Instant};

use criterion::{BatchSize, Bencher, Criterion, Throughput, criterion_group, criterion_main};
use lager_benches::slow;
use lager_benches::steps::{self, Bare, FRAMES, Ports, a_second_of_bytes, a_second_of_packets};

/// The CRC of a second's packets, beside which decoding them and what is decided on them is timed.
fn crc(bencher: &mut Bencher<'_>) {
    let bytes = a_second_of_bytes();
    bencher.iter(|| steps::check(&bytes));
}

fn decode(criterion: &mut Criterion) {
    let (bytes, packets) = (a_second_of_bytes(), a_second_of_packets().len());
    let mut group = criterion.benchmark_group("steps/decode/second-of-packets");
    group.throughput(Throughput::Elements(packets as u64));
    group.bench_function("lager", |bencher| {
        bencher.iter(|| {
            slow::work(packets);
            assert_eq!(steps::decode(&bytes), packets);
        });
    });
    group.bench_function("crc", crc);
    group.finish();
}

fn encode(criterion: &mut Criterion) {
    let packets = a_second_of_packets();
    let mut group = criterion.benchmark_group("steps/encode/second-of-packets");
    group.throughput(Throughput::Elements(packets.len() as u64));
    group.bench_function("lager", |bencher| {
        bencher.iter(|| {
            slow::work(packets.len());
            steps::encode(&packets);
        });
    });
    group.bench_function("crc", crc);
    group.finish();
}

/// Times `step`, each time after `before`.
fn timed<P>(
    bencher: &mut Bencher<'_>,
    mut ports: P,
    before: impl Fn(&mut P),
    step: impl Fn(&mut P),
) {
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
    for subscribers in [1, 64] {
        let mut group = criterion.benchmark_group(format!("steps/publish/to-{subscribers}"));
        group.bench_function("lager", |bencher| {
            let drain = |ports: &mut Ports| assert!(ports.drain() <= subscribers);
            timed(bencher, Ports::meet(subscribers), drain, |ports| {
                ports.publish();
            });
        });
        group.bench_function("iceoryx2/header", |bencher| {
            let drain = |bare: &mut Bare| assert!(bare.drain() <= subscribers);
            timed(bencher, Bare::meet(subscribers), drain, Bare::publish);
        });
        group.finish();
    }
}

fn receive(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("steps/receive/sample");
    group.bench_function("lager", |bencher| {
        let receive = |ports: &mut Ports| {
            slow::work(1);
            assert!(ports.receive().is_some());
        };
        timed(bencher, Ports::meet(1), |ports| ports.publish(), receive);
    });
    group.bench_function("iceoryx2/header", |bencher| {
        let receive = |bare: &mut Bare| assert!(bare.receive().is_some());
        timed(bencher, Bare::meet(1), Bare::publish, receive);
    });
    group.finish();
}

/// One iteration decides on the line frames of one second.
fn decide(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("steps/decide/second-of-frames");
    group.bench_function("lager", |bencher| {
        let decide = |navigator: &mut _| {
            slow::work(FRAMES as usize);
            steps::navigate(navigator, Duration::ZERO);
        };
        bencher.iter_batched_ref(steps::driving, decide, BatchSize::SmallInput);
    });
    group.bench_function("crc", crc);
    group.finish();
}

fn arbitrate(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("steps/arbitrate/new-order");
    group.bench_function("lager", |bencher| {
        let arbitrate = |arbiter: &mut _| {
            slow::work(1);
            steps::arbitrate(arbiter, 2)
        };
        bencher.iter_batched_ref(steps::steering, arbitrate, BatchSize::SmallInput);
    });
    group.bench_function("crc", crc);
    group.finish();
}

/// Short: the guard runs all of it several times, as a machine changes from second to second.
fn short() -> Criterion {
    Criterion::default()
        .nresamples(10_000)
        .sample_size(10)
        .warm_up_time(Duration::from_millis(30))
        .measurement_time(Duration::from_millis(100))
}

criterion_group!(name = benches; config = short(); targets = decode, encode, publish, receive, decide, arbitrate);
criterion_main!(benches);
