//! Proves with a counting allocator that the hot path does not allocate.
//!
//! Once writers and readers have met, and the first watcher was woken, loaning, sending, ringing,
//! waiting, receiving, ticking and counting losses allocate nothing.
//!
//! This is a program of its own because the allocator counts for the whole process. It has only one
//! test, so that nothing else runs meanwhile; allocations of other threads do not count.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use lager_ports::{Bus, BusConfig, Cause};
use lager_rig::Domain;
use lager_rig::allocations::{Counting, of as allocations};
use lager_topics::{LinkHealth, Role, SensorLine, SteeringCommand};
use lager_wake::{Policy, Wake};

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn nothing_is_allocated_per_frame() {
    let counted = allocations(|| drop(std::hint::black_box(Box::new(1))));
    assert_eq!(counted, 1, "the counter counts");

    let domain = Domain::new("lager-ports").unwrap();
    for policy in [Policy::Block, Policy::Spin, Policy::ADAPTIVE] {
        let (ends, woken) = (AtomicBool::new(false), AtomicU64::new(0));
        std::thread::scope(|scope| {
            scope.spawn(|| watch(&domain.config(), &ends, &woken));
            let _ends = Ends(&ends);
            exchange(&domain.config(), policy, &woken);
        });
    }
}

/// Ends the watcher, also when the test fails.
struct Ends<'a>(&'a AtomicBool);

impl Drop for Ends<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// A watcher in a thread of its own; `woken` says how often it was.
fn watch(config: &BusConfig, ends: &AtomicBool, woken: &AtomicU64) {
    let bus = Bus::open(config, Role::Observer).unwrap();
    let mut line = bus.subscriber::<SensorLine>().unwrap();
    let mut watcher = bus.watcher().unwrap();
    line.wakes(&mut watcher);
    while !ends.load(Ordering::Acquire) {
        watcher.wait(Duration::from_millis(10));
        while line.receive().unwrap().is_some() {}
        woken.store(watcher.woken(), Ordering::Release);
    }
}

/// From sensor frame to order, again and again, with observers attached.
fn exchange(config: &BusConfig, policy: Policy, woken: &AtomicU64) {
    let bridge = Bus::open(config, Role::Bridge).unwrap();
    let logic = Bus::open(config, Role::Logic).unwrap();
    let waiter = logic.waiter(policy).unwrap();
    let mut line = logic.subscriber::<SensorLine>().unwrap();
    let mut health = logic.subscriber::<LinkHealth>().unwrap();
    let line_out = bridge.publisher::<SensorLine>().unwrap();
    let health_out = bridge.publisher::<LinkHealth>().unwrap();
    let orders = logic.publisher::<SteeringCommand>().unwrap();
    let _observers: Vec<_> = (0..8)
        .map(|_| bridge.subscriber::<SensorLine>().unwrap())
        .collect();

    let frame = || {
        let mut frame = line_out.loan().unwrap();
        frame.link_epoch += 1;
        frame.cause(Cause::event(5));
        frame.send().unwrap();
    };
    let order = || orders.send(Cause::event(5), Default::default()).unwrap();
    // As many loans as may be open at a time. During start-up only one was open at a time.
    let unsent = || drop((orders.loan().unwrap(), orders.loan().unwrap()));
    let mut receive = || {
        assert_eq!(waiter.wait(Duration::from_secs(60)), Wake::Rung);
        let mut received = 0;
        while let Some(sample) = line.receive().unwrap() {
            received += sample.link_epoch;
        }
        assert_eq!(received, 1);
        assert_eq!(line.lost(), 0);
        health.latest().unwrap();
        health_out.tick();
        assert_eq!(waiter.wait(Duration::from_micros(100)), Wake::TimedOut);
        assert_eq!(waiter.wait(Duration::ZERO), Wake::TimedOut);
        assert!(line.receive().unwrap().is_none());
    };

    // Start-up: writers and readers meet, and readers learn the writers' streams.
    health_out.send(Cause::OWN, Default::default()).unwrap();
    frame();
    receive();
    order();
    // The first ring for a watcher starts the thread that wakes it.
    let began = Instant::now();
    while woken.load(Ordering::Acquire) == 0 {
        assert!(began.elapsed() < Duration::from_secs(60), "it is not woken");
        frame();
        receive();
    }

    for _ in 0..200 {
        assert_eq!(allocations(frame), 0, "{policy}: send and ring");
        assert_eq!(allocations(&mut receive), 0, "{policy}: wait and receive");
        assert_eq!(allocations(order), 0, "{policy}: answer");
        assert_eq!(allocations(unsent), 0, "{policy}: loans that are not sent");
    }
}
