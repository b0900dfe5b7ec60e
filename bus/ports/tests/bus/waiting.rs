//! Waking: by a ring, by a time-out, across restarts and threads.

use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use lager_ports::{Cause, PortError};
use lager_sample::{Qos, Topic};
use lager_topics::{OperatorInput, Order, Role, SensorDistance, SensorLine, SteeringCommand};
use lager_wake::{Policy, Shutdown, Waiter, Wake};

use crate::domain::{Domain, drain, send, until};

/// Long enough that a ring, not the time-out, ends the wait.
const LONG: Duration = Duration::from_secs(60);

const POLICIES: [Policy; 3] = [Policy::Block, Policy::Spin, Policy::ADAPTIVE];

#[test]
fn a_sample_wakes_the_actor_under_every_policy() {
    for policy in POLICIES {
        let domain = Domain::new();
        let logic = domain.open(Role::Logic);
        let waiter = logic.waiter(policy).unwrap();
        let mut subscriber = logic.subscriber::<SensorLine>().unwrap();
        let bridge = domain.open(Role::Bridge);
        let publisher = bridge.publisher::<SensorLine>().unwrap();
        for number in 0..100 {
            send(&publisher, number);
            assert_eq!(waiter.wait(LONG), Wake::Rung, "{policy}");
            assert_eq!(drain(&mut subscriber), [number]);
        }
    }
}

#[test]
fn a_sleeping_actor_is_woken_from_another_thread() {
    for policy in POLICIES {
        let domain = Domain::new();
        let logic = domain.open(Role::Logic);
        let waiter = logic.waiter(policy).unwrap();
        let mut subscriber = logic.subscriber::<SensorLine>().unwrap();
        let bridge = domain.open(Role::Bridge);
        let read = Barrier::new(2);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let publisher = bridge.publisher::<SensorLine>().unwrap();
                // Gives the actor time to fall asleep. If it does not, the test is only easier.
                std::thread::sleep(Duration::from_millis(30));
                send(&publisher, 5);
                read.wait();
            });
            let mut numbers = Vec::new();
            while numbers.is_empty() {
                assert_eq!(waiter.wait(LONG), Wake::Rung, "{policy}");
                numbers.extend(drain(&mut subscriber));
            }
            assert_eq!(numbers, [5]);
            read.wait();
        });
    }
}

#[test]
fn without_a_ring_the_wait_ends_by_its_time_out() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    for policy in POLICIES {
        let waiter = logic.waiter(policy).unwrap();
        for timeout in [0, 1, 999, 20_000].map(Duration::from_micros) {
            let start = Instant::now();
            assert_eq!(waiter.wait(timeout), Wake::TimedOut, "{policy} {timeout:?}");
            assert!(start.elapsed() >= timeout, "{policy} {timeout:?}");
        }
    }
}

#[test]
fn a_quiet_adaptive_waiter_sleeps_for_every_ring() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::ADAPTIVE).unwrap();
    let ringer = waiter.ringer();
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(5));
                ringer.ring();
            }
        });
        let _stop = StopsAtTheEnd(&stop);
        let mut slept = 0;
        until("it has slept for forty rings", || {
            let before = waiter.sleeps();
            assert_eq!(waiter.wait(LONG), Wake::Rung);
            let sleeps = waiter.sleeps() - before;
            // On a busy machine the ring may come before the wait, which then needs no sleep. But
            // no ring takes two sleeps.
            assert!(sleeps <= 1, "{sleeps} sleeps for one ring");
            slept += sleeps;
            slept == 40
        });
    });
    // Without any ring it sleeps through its whole time-out at once.
    waiter.wait(Duration::ZERO);
    let before = waiter.sleeps();
    assert_eq!(waiter.wait(Duration::from_millis(5)), Wake::TimedOut);
    assert_eq!(waiter.sleeps() - before, 1);
}

#[test]
#[ignore = "needs two cores; `tests/run` runs it where there are two"]
fn an_adaptive_waiter_does_not_sleep_under_quick_rings() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::ADAPTIVE).unwrap();
    // On one core no waiter may spin, because the ringer needs the core.
    spins_under_quick_rings(&waiter);
}

/// Rings at 10 kHz until the waiter has noticed three rings in a row without a sleep. On a busy
/// machine threads lose their cores and sleeping is right, so this tries many times.
pub(crate) fn spins_under_quick_rings(waiter: &Waiter) {
    const DISTANCE: Duration = Duration::from_micros(100);
    let waited_awake = || {
        let ringer = waiter.ringer();
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !stop.load(Ordering::Relaxed) {
                    ringer.ring();
                    let last = Instant::now();
                    while last.elapsed() < DISTANCE {
                        std::hint::spin_loop();
                    }
                }
            });
            let _stop = StopsAtTheEnd(&stop);
            let mut awake = 0;
            for _ in 0..40 {
                let (before, start) = (waiter.sleeps(), Instant::now());
                assert_eq!(waiter.wait(LONG), Wake::Rung);
                // If the ring was there already, this was no wait.
                let waited = start.elapsed() > DISTANCE / 2;
                awake = if waited && waiter.sleeps() == before {
                    awake + 1
                } else {
                    0
                };
                if awake == 3 {
                    return true;
                }
            }
            false
        })
    };
    until("it looks instead of sleeping", waited_awake);
}

/// Ends the other thread even if this one fails.
struct StopsAtTheEnd<'a>(&'a AtomicBool);

impl Drop for StopsAtTheEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn many_samples_may_come_with_one_ring() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    let mut subscriber = logic.subscriber::<SensorLine>().unwrap();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    for number in 0..50 {
        send(&publisher, number);
    }
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    assert_eq!(drain(&mut subscriber).len(), 50);
    assert_eq!(waiter.wait(Duration::ZERO), Wake::TimedOut);
}

#[test]
fn one_waiter_serves_all_topics_of_its_role() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    let bridge = domain.open(Role::Bridge);
    let line = bridge.publisher::<SensorLine>().unwrap();
    let distance = bridge.publisher::<SensorDistance>().unwrap();
    let input = bridge.publisher::<OperatorInput>().unwrap();
    send(&line, 0);
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    distance.send(Cause::OWN, Default::default()).unwrap();
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    input.send(Cause::OWN, Default::default()).unwrap();
    assert_eq!(waiter.wait(LONG), Wake::Rung);
}

struct Gong;

impl Topic for Gong {
    const NAME: &'static str = "test/gong";
    type Payload = Order;
    const QOS: Qos = Qos::stream(4).waking(&[Role::Logic.part(), Role::Bridge.part()]);
    const SUMMARY: &'static str = "What two actors hear.";
}

#[test]
fn a_sample_rings_every_actor_of_its_topic_and_nobody_else() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let bridge = domain.open(Role::Bridge);
    let logic_waiter = logic.waiter(Policy::Block).unwrap();
    let bridge_waiter = bridge.waiter(Policy::Block).unwrap();
    let comm = domain.open(Role::Comm);

    let gong = comm.publisher::<Gong>().unwrap();
    gong.send(Cause::OWN, Default::default()).unwrap();
    assert_eq!(logic_waiter.wait(LONG), Wake::Rung);
    assert_eq!(bridge_waiter.wait(LONG), Wake::Rung);

    let command = comm.publisher::<SteeringCommand>().unwrap();
    command.send(Cause::OWN, Default::default()).unwrap();
    assert_eq!(bridge_waiter.wait(LONG), Wake::Rung);
    assert_eq!(logic_waiter.wait(Duration::from_millis(5)), Wake::TimedOut);
}

#[test]
fn an_actor_that_starts_after_the_writer_is_rung_too() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    send(&publisher, 0);
    for _ in 0..3 {
        // The waiter comes, is rung and goes, and then comes again.
        let logic = domain.open(Role::Logic);
        let waiter = logic.waiter(Policy::Block).unwrap();
        send(&publisher, 1);
        assert_eq!(waiter.wait(LONG), Wake::Rung);
    }
    send(&publisher, 2);
}

#[test]
fn two_waiters_of_one_role_are_both_rung() {
    let domain = Domain::new();
    let one = domain.open(Role::Logic);
    let two = domain.open(Role::Logic);
    let waiters = [
        one.waiter(Policy::Block).unwrap(),
        two.waiter(Policy::Block).unwrap(),
    ];
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    send(&publisher, 0);
    for waiter in &waiters {
        assert_eq!(waiter.wait(LONG), Wake::Rung);
    }
}

#[test]
fn a_ringer_wakes_from_any_thread() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let waiter = bridge.waiter(Policy::Block).unwrap();
    let ringer = waiter.ringer();
    for _ in 0..10 {
        let ringer = ringer.clone();
        let thread = std::thread::spawn(move || ringer.ring());
        assert_eq!(waiter.wait(LONG), Wake::Rung);
        thread.join().unwrap();
    }
}

#[test]
fn a_wish_to_stop_wakes_whoever_waits() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let waiter = bridge.waiter(Policy::Block).unwrap();
    let shutdown = Shutdown::new();
    shutdown.wake(waiter.ringer());
    assert!(!shutdown.is_requested());
    let thread = std::thread::spawn({
        let shutdown = shutdown.clone();
        move || shutdown.request()
    });
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    until("the wish is seen", || shutdown.is_requested());
    thread.join().unwrap();

    // A waiter that begins to wait after the request is woken as well.
    shutdown.wake(waiter.ringer());
    assert_eq!(waiter.wait(LONG), Wake::Rung);
}

#[test]
fn observers_have_no_waiter() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let error = observer.waiter(Policy::Block).unwrap_err();
    assert_eq!(
        error,
        PortError::NotAnActor {
            part: Role::Observer.part()
        }
    );
    assert!(error.to_string().contains("observers poll"));
}

#[test]
fn no_ring_is_lost_in_a_storm() {
    const LAST: u32 = 100_000;
    for policy in POLICIES {
        let domain = Domain::new();
        let logic = domain.open(Role::Logic);
        let waiter = logic.waiter(policy).unwrap();
        let mut subscriber = logic.subscriber::<SensorLine>().unwrap();
        let bridge = domain.open(Role::Bridge);
        let read = Barrier::new(2);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let publisher = bridge.publisher::<SensorLine>().unwrap();
                for number in 0..=LAST {
                    send(&publisher, number);
                }
                read.wait();
            });
            let mut last = None;
            while last != Some(LAST) {
                assert_eq!(waiter.wait(LONG), Wake::Rung, "{policy} after {last:?}");
                last = drain(&mut subscriber).pop().or(last);
            }
            read.wait();
        });
        assert_eq!(
            subscriber.received() + subscriber.lost(),
            u64::from(LAST) + 1
        );
    }
}
