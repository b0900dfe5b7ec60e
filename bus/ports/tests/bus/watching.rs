//! Observers that ask to be woken: any number of them, and none that holds another one up.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Barrier, Mutex};
use std::time::{Duration, Instant};

use lager_ports::{Bus, Cause, Watcher};
use lager_rig::Process;
use lager_sample::{Qos, Topic};
use lager_topics::{DistanceFrame, LineFrame, Role, SensorDistance, SensorLine};
use lager_wake::Wake;
use rustix::process::Signal;

use crate::domain::{Domain, drain, send, until};
use crate::process;

/// Long enough that a sample, not the time-out, ends the wait.
const LONG: Duration = Duration::from_secs(60);

/// Short enough that a test that has failed in another thread ends.
const SHORT: Duration = Duration::from_millis(100);

/// How often each watcher of a test must have been rung. A sample that comes while it is awake
/// needs no ring.
const RINGS: u64 = 3;

/// A topic with places for any number of watchers.
struct Crowded;

impl Topic for Crowded {
    const NAME: &'static str = "test/crowded";
    type Payload = LineFrame;
    const QOS: Qos = Qos {
        observers: 512,
        ..Qos::stream(16)
    };
    const SUMMARY: &'static str = "To a crowd.";
}

#[test]
fn any_number_of_watchers_is_rung_and_each_hears_of_every_sample() {
    for (watchers, burst) in [
        (1, 10_000),
        (2, 10_000),
        (8, 10_000),
        (64, 2_000),
        (500, 200),
    ] {
        crowd(watchers, burst);
    }
}

/// Sends until each watcher was rung, then a burst; each watcher ends on the last sample.
fn crowd(watchers: usize, burst: u64) {
    let domain = Domain::new();
    let (writing, observing) = (domain.open(Role::Operator), domain.open(Role::Observer));
    let publisher = writing.publisher::<Crowded>().unwrap();
    // One joins after the other, as people start programs.
    let joining = Mutex::new(());
    let [joined, rung] = [const { AtomicUsize::new(0) }; 2];
    let all = AtomicU64::new(u64::MAX);
    let watch = || {
        let turn = joining.lock();
        let mut subscriber = observing.subscriber::<Crowded>().unwrap();
        let mut watcher = observing.watcher().unwrap();
        subscriber.wakes(&mut watcher);
        drop(turn);
        joined.fetch_add(1, Ordering::AcqRel);
        let mut missing = RINGS;
        while subscriber.received() + subscriber.lost() < all.load(Ordering::Acquire) {
            watcher.wait(SHORT);
            while subscriber.receive().unwrap().is_some() {}
            if missing > 0 && watcher.woken() >= RINGS {
                missing = 0;
                rung.fetch_add(1, Ordering::AcqRel);
            }
        }
        assert_eq!(
            subscriber.received() + subscriber.lost(),
            all.load(Ordering::Acquire)
        );
    };
    std::thread::scope(|scope| {
        for _ in 0..watchers {
            scope.spawn(watch);
        }
        let _ends = EndsAll(&all);
        let mut seen = 0;
        while joined.load(Ordering::Acquire) < watchers {
            until("another watcher has joined", || {
                let before = std::mem::replace(&mut seen, joined.load(Ordering::Acquire));
                seen > before || seen == watchers
            });
        }
        let next = || publisher.send(Cause::OWN, LineFrame::default()).unwrap();
        until("each watcher was rung", || {
            next();
            rung.load(Ordering::Acquire) == watchers
        });
        (0..burst).for_each(|_| next());
        all.store(publisher.sent() + 1, Ordering::Release);
        next();
    });
}

/// Lets the watchers of a test end that has failed.
struct EndsAll<'a>(&'a AtomicU64);

impl Drop for EndsAll<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(0, Ordering::Release);
        }
    }
}

/// Sends line frames until a ring has woken the watcher that many times more, in another thread.
fn rings(domain: &Domain, watcher: &mut Watcher, times: u64, mut drained: impl FnMut()) {
    let bridge = domain.open(Role::Bridge);
    let heard = AtomicU64::new(0);
    std::thread::scope(|scope| {
        let sender = scope.spawn(|| {
            let publisher = bridge.publisher::<SensorLine>().unwrap();
            until("the watcher was rung", || {
                send(&publisher, 0);
                heard.load(Ordering::Acquire) >= times
            });
        });
        let before = watcher.woken();
        while !sender.is_finished() {
            watcher.wait(SHORT);
            drained();
            heard.store(watcher.woken() - before, Ordering::Release);
        }
    });
}

fn watching(bus: &Bus) -> (lager_ports::Subscriber<SensorLine>, Watcher) {
    let subscriber = bus.subscriber::<SensorLine>().unwrap();
    let mut watcher = bus.watcher().unwrap();
    subscriber.wakes(&mut watcher);
    (subscriber, watcher)
}

#[test]
fn watchers_that_are_stopped_or_killed_anywhere_hold_nobody_up() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let (mut subscriber, mut watcher) = watching(&observer);
    for round in 0..4 {
        let victims: Vec<_> = (0..4).map(|_| process::start(&domain, "watcher")).collect();
        for (index, victim) in victims.iter().enumerate() {
            let signal = [Signal::STOP, Signal::KILL][index % 2];
            // While rings come, so that some have just been woken.
            let mut drained = 0;
            rings(&domain, &mut watcher, 20, || {
                drain(&mut subscriber);
                drained += 1;
                if drained == 3 + round {
                    victim.signal(signal);
                }
            });
        }
        victims.into_iter().for_each(Process::kill);
        observer.sweep();
    }
}

#[test]
fn a_watcher_hears_each_of_its_topics() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let (mut lines, mut watcher) = watching(&observer);
    let mut distances = observer.subscriber::<SensorDistance>().unwrap();
    distances.wakes(&mut watcher);
    let bridge = domain.open(Role::Bridge);
    let heard = [const { AtomicU64::new(0) }; 2];
    std::thread::scope(|scope| {
        let sender = scope.spawn(|| {
            let lines = bridge.publisher::<SensorLine>().unwrap();
            let distances = bridge.publisher::<SensorDistance>().unwrap();
            for (topic, heard) in heard.iter().enumerate() {
                until("the watcher was rung for this topic", || {
                    match topic {
                        0 => send(&lines, 0),
                        _ => distances
                            .send(Cause::OWN, DistanceFrame::default())
                            .unwrap(),
                    }
                    heard.load(Ordering::Acquire) >= RINGS
                });
            }
        });
        while !sender.is_finished() {
            let before = watcher.woken();
            watcher.wait(SHORT);
            let rung = watcher.woken() - before;
            if !drain(&mut lines).is_empty() {
                heard[0].fetch_add(rung, Ordering::AcqRel);
            }
            while distances.receive().unwrap().is_some() {
                heard[1].fetch_add(rung, Ordering::AcqRel);
            }
        }
    });
}

#[test]
fn a_watcher_of_a_topic_that_describes_itself_is_rung() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let observer = domain.open(Role::Observer);
    let mut found = observer.found(SensorLine::NAME).unwrap().unwrap();
    let mut watcher = observer.watcher().unwrap();
    found.wakes(&mut watcher);
    send(&publisher, 7);
    assert_eq!(watcher.wait(LONG), Wake::Rung);
    assert!(found.receive().unwrap().is_some());
    rings(&domain, &mut watcher, RINGS, || {
        while found.receive().unwrap().is_some() {}
    });
}

#[test]
fn without_a_sample_the_wait_ends_by_its_time_out() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let (mut subscriber, mut watcher) = watching(&observer);
    let publisher = domain.open(Role::Bridge).publisher::<SensorLine>().unwrap();
    for timeout in [0, 1, 7_000, 30_000].map(Duration::from_micros) {
        let start = Instant::now();
        assert_eq!(watcher.wait(timeout), Wake::TimedOut);
        assert!(start.elapsed() >= timeout, "{timeout:?}");
        // What is left in the queue ends the next wait at once, rung or not.
        send(&publisher, 1);
        assert_eq!(watcher.wait(Duration::ZERO), Wake::Rung);
        assert_eq!(drain(&mut subscriber), [1]);
    }
}

#[test]
fn a_sample_that_comes_without_a_ring_is_found_all_the_same() {
    let domain = Domain::new();
    let publisher = domain.open(Role::Bridge).publisher::<SensorLine>().unwrap();
    let observer = domain.open(Role::Observer);
    let (mut subscriber, mut watcher) = watching(&observer);
    // It is there before the watcher sleeps, and nobody rings after it.
    send(&publisher, 3);
    assert_eq!(watcher.wait(LONG), Wake::Rung);
    assert_eq!(drain(&mut subscriber), [3]);
    assert_eq!(watcher.woken(), 0);
    let elsewhere = domain.open_robot("r2", Role::Observer);
    let mut other = elsewhere.watcher().unwrap();
    subscriber.wakes(&mut other);
    // The writer rings on its own robot's board, which this watcher does not hear. Programs of plain
    // iceoryx2 do not ring at all.
    let bridge = domain.open(Role::Bridge);
    let read = Barrier::new(2);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(30));
            let publisher = bridge.publisher::<SensorLine>().unwrap();
            send(&publisher, 4);
            read.wait();
        });
        assert_eq!(other.wait(LONG), Wake::Rung);
        read.wait();
    });
    assert_eq!(drain(&mut subscriber), [4]);
    assert_eq!(other.woken(), 0);
}

#[test]
fn a_watcher_goes_on_when_its_subscriber_is_gone() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let (subscriber, mut watcher) = watching(&observer);
    drop(subscriber);
    let publisher = domain.open(Role::Bridge).publisher::<SensorLine>().unwrap();
    send(&publisher, 1);
    assert_eq!(watcher.wait(Duration::from_millis(10)), Wake::TimedOut);
    let mut next = observer.subscriber::<SensorLine>().unwrap();
    next.wakes(&mut watcher);
    rings(&domain, &mut watcher, RINGS, || {
        drain(&mut next);
    });
}
