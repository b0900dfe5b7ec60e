//! `codec/decode` and `codec/encode`: a second of both boards' packets, beside copying the same
//! bytes, which is the least any decoder can do.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lager_benches::{a_second_of_bytes, a_second_of_packets};
use lager_wire::{Decoder, PACKET_LENGTH, Version};

fn decode(criterion: &mut Criterion) {
    let bytes = a_second_of_bytes();
    let packets = (bytes.len() / PACKET_LENGTH) as u64;
    let mut group = criterion.benchmark_group("codec/decode");
    group.throughput(Throughput::Elements(packets));
    group.bench_function("baseline-copy", |bencher| {
        let mut target = vec![0; bytes.len()];
        bencher.iter(|| {
            for (to, from) in target.iter_mut().zip(black_box(&bytes)) {
                *to = *from;
            }
            black_box(&target);
        });
    });
    group.bench_function("version-1", |bencher| {
        bencher.iter(|| {
            let mut decoder = Decoder::new(Version::One);
            let decoded = black_box(&bytes)
                .iter()
                .filter(|byte| decoder.push(**byte).is_some())
                .count();
            assert_eq!(decoded as u64, packets);
        });
    });
    group.finish();
}

fn encode(criterion: &mut Criterion) {
    let packets = a_second_of_packets();
    let mut group = criterion.benchmark_group("codec/encode");
    group.throughput(Throughput::Elements(packets.len() as u64));
    group.bench_function("version-1", |bencher| {
        bencher.iter(|| {
            for packet in black_box(&packets) {
                black_box(packet.encode(Version::One));
            }
        });
    });
    group.finish();
}

criterion_group!(benches, decode, encode);
criterion_main!(benches);
