//! `instructions`: how many the codec, publishing, receiving and the decisions take, counted by
//! callgrind. Counts do not drift with the machine's load, so the guard holds them closely.
//!
//! The ports are real: two members of one bus in this process, typed publisher and subscribers, the
//! actor's seat taken and awake, so that a ring makes no system call. What callgrind cannot see is
//! the time of the processor itself: a cache miss, an interrupt, and the kernel's side of a system
//! call, among them, under valgrind, reading the clock. For those the guard has ratios.
//!
//! Each bench runs in a process of its own, after a setup that is not counted: the ends have met,
//! every stream is known, and every function that the dynamic linker binds late is bound.

// What gungraun's macros make public has no documentation.
#![allow(missing_docs)]

use core::time::Duration;
use std::hint::black_box;

use gungraun::prelude::*;
use lager_benches::{a_second_of_bytes, a_second_of_packets, slow};
use lager_bridge::arbiter::{Arbiter, Verdict};
use lager_logic::{Input, LogicConfig, Navigator};
use lager_ports::{Bus, BusConfig, Place, Policy, Publisher, Subscriber, Waiter, Wake};
use lager_topics::{
    MapProduct, Mode, Order, Origin, Phase, Role, SensorLine, Side, SteeringOrder, SteeringReport,
    WarehouseMap,
};
use lager_wire::{Decoder, LineState, Packet, SteerCommand, Version};

#[library_benchmark]
#[bench::second_of_packets(setup = a_second_of_bytes)]
fn decode(bytes: Vec<u8>) -> usize {
    let mut decoder = Decoder::new(Version::One);
    black_box(&bytes)
        .iter()
        .filter(|byte| decoder.push(**byte).is_some())
        .count()
}

#[library_benchmark]
#[bench::second_of_packets(setup = a_second_of_packets)]
fn encode(packets: Vec<Packet>) {
    for packet in black_box(&packets) {
        black_box(packet.encode(Version::One));
    }
}

/// A publisher of line frames, the actor who reads them, and observers, all in this process.
struct Meeting {
    publisher: Publisher<SensorLine>,
    subscribers: Vec<Subscriber<SensorLine>>,
    waiter: Waiter,
    // Dropped after its ports.
    _bridge: Bus,
    _logic: Bus,
    _observer: Bus,
    domain: Domain,
}

/// Where the meeting is, so that it meets nobody else; leaves nothing behind.
struct Domain(Place);

impl Drop for Domain {
    fn drop(&mut self) {
        self.0.remove();
    }
}

fn meeting(subscribers: usize) -> Meeting {
    let folder = format!("/dev/shm/lgi{}", std::process::id());
    let config = BusConfig {
        folder: Some(folder.into()),
        ..BusConfig::default()
    };
    let domain = Domain(config.place().unwrap());
    let bridge = Bus::open(&config, Role::Bridge).unwrap();
    let logic = Bus::open(&config, Role::Logic).unwrap();
    let waiter = logic.waiter(Policy::Block).unwrap();
    let publisher = bridge.publisher().unwrap();
    // The first acts, the others look on.
    let observer = Bus::open(&config, Role::Observer).unwrap();
    let observers = (1..subscribers).map(|_| observer.subscriber().unwrap());
    let subscribers = [logic.subscriber().unwrap()].into_iter();
    let subscribers = subscribers.chain(observers).collect();
    let mut meeting = Meeting {
        publisher,
        subscribers,
        waiter,
        _bridge: bridge,
        _logic: logic,
        _observer: observer,
        domain,
    };
    // More than any queue holds, so that every queue and every chunk has been used.
    for _ in 0..100 {
        meeting.publish();
        assert_eq!(meeting.waiter.wait(Duration::ZERO), Wake::Rung);
        assert_eq!(meeting.drain(), meeting.subscribers.len());
    }
    assert!(
        !meeting.domain.0.segments().is_empty(),
        "it met where it should"
    );
    meeting
}

impl Meeting {
    #[inline(always)]
    fn publish(&self) {
        let mut loan = self.publisher.loan().unwrap();
        loan.link_epoch = black_box(7);
        slow::publish(self.subscribers.len());
        loan.send().unwrap();
    }

    fn drain(&mut self) -> usize {
        let mut received = 0;
        for subscriber in &mut self.subscribers {
            while subscriber.receive().unwrap().is_some() {
                received += 1;
            }
        }
        received
    }
}

fn published() -> Meeting {
    let meeting = meeting(1);
    meeting.publish();
    meeting
}

#[library_benchmark(config = LibraryBenchmarkConfig::default().pass_through_env(slow::VARIABLE))]
#[bench::to_1(args = (1), setup = meeting)]
#[bench::to_64(args = (64), setup = meeting)]
fn publish(meeting: Meeting) -> Meeting {
    meeting.publish();
    meeting
}

#[library_benchmark(config = LibraryBenchmarkConfig::default().pass_through_env(slow::VARIABLE))]
#[bench::sample(setup = published)]
fn receive(mut meeting: Meeting) -> (Meeting, u32) {
    slow::receive();
    let sample = meeting.subscribers[0].receive().unwrap().unwrap();
    let epoch = sample.link_epoch;
    drop(sample);
    (meeting, epoch)
}

#[library_benchmark]
#[bench::nothing(args = (1), setup = meeting)]
fn poll(mut meeting: Meeting) -> Meeting {
    assert!(meeting.subscribers[0].receive().unwrap().is_none());
    meeting
}

#[library_benchmark]
#[bench::rung(setup = published)]
fn wait(meeting: Meeting) -> (Meeting, Wake) {
    let wake = meeting.waiter.wait(black_box(Duration::from_millis(20)));
    (meeting, wake)
}

/// A navigator on its way along the first edge.
fn driving() -> Navigator {
    let mut map = WarehouseMap {
        width: 3,
        height: 3,
        side_length_cm: 200,
        product_count: 1,
        ..WarehouseMap::default()
    };
    map.products[0] = MapProduct {
        id: 1,
        x: 2,
        y: 0,
        side: Side::Right.into(),
        ..MapProduct::default()
    };
    let mut navigator = Navigator::new(LogicConfig::default());
    let mode = Mode::Autonomous;
    let start = [
        Input::Map(&map),
        Input::Mode {
            mode,
            stopped: false,
        },
        Input::Order(&Order { id: 1, product: 1 }),
        Input::Line(LineState::OnLine),
        Input::Steering(&report()),
    ];
    for input in start {
        navigator.handle(Duration::ZERO, input);
    }
    let status = navigator.status();
    assert_eq!(status.phase.get(), Some(Phase::Driving), "{status:?}");
    navigator
}

/// What a steering board says that has just reported.
fn report() -> SteeringReport {
    SteeringReport {
        age_ms: 0,
        ..SteeringReport::default()
    }
}

/// Line frames of a second.
const FRAMES: u32 = 200;

/// Line frames from one report to the next: as few as keep the robot driving.
const SILENCE: u32 = 38;

/// The second was driven, not stood through.
fn still_driving(navigator: Navigator) {
    let status = navigator.status();
    assert_eq!(status.phase.get(), Some(Phase::Driving), "{status:?}");
}

#[library_benchmark]
#[bench::second_of_frames(setup = driving, teardown = still_driving)]
fn navigate(mut navigator: Navigator) -> Navigator {
    let report = report();
    for frame in 1..=FRAMES {
        let now = Duration::from_millis(5) * frame;
        let state = [LineState::OnLine, LineState::LeftOfLine][usize::from(frame % 8 == 0)];
        black_box(navigator.handle(now, Input::Line(black_box(state))));
        if frame % SILENCE == 0 {
            black_box(navigator.handle(now, Input::Steering(black_box(&report))));
        }
    }
    navigator
}

fn order(id: u32) -> SteeringOrder {
    SteeringOrder {
        id,
        origin: Origin::Logic.into(),
        code: 3,
        ..SteeringOrder::default()
    }
}

/// An arbiter that carries out one of logic's orders on a board of ours.
fn steering() -> Arbiter {
    let mut arbiter = Arbiter::new();
    arbiter.board_up(Duration::ZERO, Version::One, false);
    arbiter.set_mode(Mode::Autonomous);
    let verdict = arbiter.order(Duration::ZERO, Duration::ZERO, &order(1));
    assert_eq!(verdict, Verdict::Executes);
    arbiter.advance(Duration::ZERO);
    while arbiter.poll(Duration::ZERO).is_some() {}
    arbiter
}

#[library_benchmark]
#[bench::new_order(setup = steering)]
fn arbitrate(mut arbiter: Arbiter) -> (Arbiter, Option<SteerCommand>) {
    let now = Duration::from_millis(5);
    let verdict = arbiter.order(now, now, black_box(&order(2)));
    assert_eq!(verdict, Verdict::Executes);
    arbiter.advance(now);
    let written = arbiter.poll(now);
    (arbiter, written)
}

library_benchmark_group!(
    name = all,
    benchmarks = [
        decode, encode, publish, receive, poll, wait, navigate, arbitrate
    ]
);

main!(library_benchmark_groups = all);
