//! What a waiter can find out about the rings that ended its wait.

use std::time::Duration;

use lager_ports::Cause;
use lager_topics::{LinkHealth, Role, SensorDistance, SensorLine};
use lager_wake::{Policy, Wake};

use crate::domain::{Domain, send};

/// Long enough that a ring, not the time-out, ends the wait.
const LONG: Duration = Duration::from_secs(60);

#[test]
fn a_waiter_is_told_which_topics_it_is_rung_for() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    let bridge = domain.open(Role::Bridge);
    let line = bridge.publisher::<SensorLine>().unwrap();
    let distance = bridge.publisher::<SensorDistance>().unwrap();
    let has = || (waiter.has::<SensorLine>(), waiter.has::<SensorDistance>());
    assert_eq!(has(), (true, true), "before the first wait, everything");

    send(&line, 0);
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    assert_eq!(has(), (true, false));
    assert!(!waiter.has::<SensorLine>(), "it was asked for");
    distance.send(Cause::OWN, Default::default()).unwrap();
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    assert_eq!(has(), (false, true));
    waiter.ringer().ring();
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    assert_eq!(has(), (false, false));
    assert!(waiter.has_inside());

    // A reason that was not read at one wake is still there at the next.
    send(&line, 1);
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    distance.send(Cause::OWN, Default::default()).unwrap();
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    assert_eq!(has(), (true, true));

    assert_eq!(waiter.wait(Duration::ZERO), Wake::TimedOut);
    assert_eq!(has(), (true, true), "without a ring, everything");
}

#[test]
fn a_sample_without_a_ring_wakes_nobody_and_is_found_among_rings_for_others() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    let bridge = domain.open(Role::Bridge);
    let line = bridge.publisher::<SensorLine>().unwrap();
    let health = bridge.publisher::<LinkHealth>().unwrap();
    let mut subscriber = logic.subscriber::<LinkHealth>().unwrap();
    send(&line, 0);
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    assert!(!waiter.has::<LinkHealth>());
    health.loan().unwrap().send_quietly().unwrap();
    assert_eq!(waiter.wait(Duration::from_millis(20)), Wake::TimedOut);
    send(&line, 1);
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    assert!(waiter.has::<LinkHealth>());
    assert!(subscriber.receive().unwrap().is_some());

    health.loan().unwrap().send_quietly().unwrap();
    // Without its reason, the sample looks as if a program that knows no bells had sent it.
    send(&line, 2);
    assert_eq!(waiter.wait(LONG), Wake::Rung);
    assert!(waiter.has::<LinkHealth>());
    let found = (3..100).position(|number| {
        send(&line, number);
        assert_eq!(waiter.wait(LONG), Wake::Rung);
        waiter.has::<LinkHealth>() && subscriber.receive().unwrap().is_some()
    });
    assert!(matches!(found, Some(1..20)), "{found:?}");
}
