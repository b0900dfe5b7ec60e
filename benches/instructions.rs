//! `instructions`: callgrind counts the instructions of the path's steps (`lager_benches::steps`).
//! A busy machine does not change these counts, so the guard allows them little room.
//!
//! callgrind does not see the processor's own time: a cache miss, an interrupt, the kernel's side
//! of a system call. Under valgrind, reading the clock is such a call. The guard covers these by
//! ratios.
//!
//! Each bench runs in a process of its own. An uncounted setup comes first: publishers and
//! subscribers know each other, and the dynamic linker has bound every function that it binds late.
//! every stream is known, and every function that the dynamic linker binds late is bound.

// gungraun's macros make public items that have no documentation.
#![allow(missing_docs)]

use core::time::Duration;

use gungraun::prelude::*;
use lager_benches::slow;
use lager_benches::steps::{self, Ports, a_second_of_bytes, a_second_of_packets};
use lager_bridge::arbiter::Arbiter;
use lager_logic::Navigator;
use lager_wake::Wake;
use lager_wire::{Packet, SteerCommand};

#[library_benchmark]
#[bench::second_of_packets(setup = a_second_of_bytes)]
fn decode(bytes: Vec<u8>) -> usize {
    steps::decode(&bytes)
}

#[library_benchmark]
#[bench::second_of_packets(setup = a_second_of_packets)]
fn encode(packets: Vec<Packet>) {
    steps::encode(&packets);
}

#[library_benchmark(config = LibraryBenchmarkConfig::default().pass_through_env(slow::VARIABLE))]
#[bench::to_1(args = (1), setup = Ports::meet)]
#[bench::to_64(args = (64), setup = Ports::meet)]
fn publish(ports: Ports) -> Ports {
    ports.publish();
    ports
}

#[library_benchmark(config = LibraryBenchmarkConfig::default().pass_through_env(slow::VARIABLE))]
#[bench::sample(setup = Ports::published)]
fn receive(mut ports: Ports) -> (Ports, Option<u32>) {
    let received = ports.receive();
    (ports, received)
}

#[library_benchmark]
#[bench::nothing(args = (1), setup = Ports::meet)]
fn poll(mut ports: Ports) -> Ports {
    assert!(ports.receive().is_none());
    ports
}

#[library_benchmark]
#[bench::rung(setup = Ports::published)]
fn wait(ports: Ports) -> (Ports, Wake) {
    let wake = ports.wait(Duration::from_millis(20));
    (ports, wake)
}

fn still_driving(navigator: Navigator) {
    steps::still_driving(&navigator);
}

#[library_benchmark]
#[bench::second_of_frames(setup = steps::driving, teardown = still_driving)]
fn navigate(mut navigator: Navigator) -> Navigator {
    steps::navigate(&mut navigator, Duration::ZERO);
    navigator
}

#[library_benchmark]
#[bench::new_order(setup = steps::steering)]
fn arbitrate(mut arbiter: Arbiter) -> (Arbiter, Option<SteerCommand>) {
    let written = steps::arbitrate(&mut arbiter, 2);
    (arbiter, written)
}

library_benchmark_group!(
    name = all,
    benchmarks = [
        decode, encode, publish, receive, poll, wait, navigate, arbitrate
    ]
);

main!(library_benchmark_groups = all);
