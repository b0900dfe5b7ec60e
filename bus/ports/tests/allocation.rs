//! The hot path does not allocate: a counting allocator proves it.
//!
//! Loaning, sending, ringing, waiting, receiving, ticking and counting losses allocate nothing once
//! the ends have met.
//!
//! A binary of its own, since the allocator counts for the whole process. One test only, so that
//! nothing else runs meanwhile; what other threads do is not counted.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::time::Duration;

use lager_ports::{Bus, BusConfig, Cause, Policy, Wake};
use lager_topics::{LinkHealth, Role, SensorLine, SteeringCommand};

struct Counting;

thread_local! {
    static COUNT: Cell<Option<u64>> = const { Cell::new(None) };
}

fn count() {
    // The thread may be ending, and then nobody counts any more.
    let _ = COUNT.try_with(|count| count.set(count.get().map(|count| count + 1)));
}

// SAFETY: everything is done by the system's allocator; counting neither allocates nor unwinds.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations while `work` runs in this thread.
fn allocations(work: impl FnOnce()) -> u64 {
    COUNT.set(Some(0));
    work();
    COUNT.replace(None).unwrap()
}

#[test]
fn nothing_is_allocated_per_frame() {
    let counted = allocations(|| drop(std::hint::black_box(Box::new(1))));
    assert_eq!(counted, 1, "the counter counts");

    let id = format!("lpa{}", std::process::id());
    let config = BusConfig {
        folder: Some(std::path::Path::new("/dev/shm").join(id)),
        ..BusConfig::default()
    };
    for policy in [Policy::Block, Policy::Spin, Policy::ADAPTIVE] {
        exchange(&config, policy);
    }
    config.place().unwrap().remove();
}

/// Sensor frame to order, again and again, with observers attached.
fn exchange(config: &BusConfig, policy: Policy) {
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
    // As many as may be open at a time; none was open beside another during start-up.
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

    // Start-up: the ends meet, and their streams become known.
    health_out.send(Cause::OWN, Default::default()).unwrap();
    frame();
    receive();
    order();

    for _ in 0..200 {
        assert_eq!(allocations(frame), 0, "{policy}: send and ring");
        assert_eq!(allocations(&mut receive), 0, "{policy}: wait and receive");
        assert_eq!(allocations(order), 0, "{policy}: answer");
        assert_eq!(allocations(unsent), 0, "{policy}: loans that are not sent");
    }
}
