//! Requests and replies between processes that come and go.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use lager_orders::Mode;
use lager_ports::{Bus, CallError};
use lager_topics::{Ask, AskKind, BridgeAnswer, BridgeRequest, Outcome, Role};
use lager_wake::Policy;

use crate::domain::{Domain, until};

const LONG: Duration = Duration::from_secs(60);

fn answer(ask: &Ask) -> BridgeAnswer {
    BridgeAnswer {
        outcome: Outcome::Done.into(),
        mode: ask.mode,
        gain_p: ask.gain_p,
        ..BridgeAnswer::default()
    }
}

/// A bridge that answers until `stop`; returns how many requests it has answered.
fn serve(bus: &Bus, stop: &AtomicBool) -> usize {
    let waiter = bus.waiter(Policy::Block).unwrap();
    let server = bus.server::<BridgeRequest>().unwrap();
    let mut answered = 0;
    while !stop.load(Ordering::SeqCst) {
        waiter.wait(Duration::from_millis(10));
        answered += server.serve(answer).unwrap();
    }
    answered
}

#[test]
fn a_question_is_answered_once() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let station = domain.open(Role::Station);
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let server = scope.spawn(|| serve(&bridge, &stop));
        let client = station.client::<BridgeRequest>().unwrap();
        for gain_p in 0..100 {
            let ask = Ask {
                kind: AskKind::SetGains.into(),
                mode: Mode::Autonomous.into(),
                gain_p,
                ..Ask::default()
            };
            let reply = client.call(ask, LONG).unwrap();
            assert_eq!(reply.gain_p, gain_p);
            assert_eq!(reply.mode, Mode::Autonomous);
        }
        stop.store(true, Ordering::SeqCst);
        assert_eq!(server.join().unwrap(), 100);
    });
}

#[test]
fn several_clients_ask_at_once() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let server = scope.spawn(|| serve(&bridge, &stop));
        let clients: Vec<_> = (0..4_u8)
            .map(|client| {
                let domain = &domain;
                scope.spawn(move || {
                    let bus = domain.open(Role::Operator);
                    let port = bus.client::<BridgeRequest>().unwrap();
                    for turn in 0..25 {
                        let ask = Ask {
                            gain_p: client * 32 + turn,
                            ..Ask::default()
                        };
                        assert_eq!(port.call(ask, LONG).unwrap().gain_p, ask.gain_p);
                    }
                })
            })
            .collect();
        for client in clients {
            client.join().unwrap();
        }
        stop.store(true, Ordering::SeqCst);
        assert_eq!(server.join().unwrap(), 100);
    });
}

#[test]
fn without_a_server_the_asker_is_told_who_is_missing() {
    let domain = Domain::new();
    let station = domain.open(Role::Station);
    let client = station.client::<BridgeRequest>().unwrap();
    let error = client
        .call(Ask::default(), Duration::from_millis(5))
        .unwrap_err();
    assert!(matches!(error, CallError::NoServer { .. }), "{error:?}");
    assert!(error.to_string().contains("bridge is not running"));
}

#[test]
fn a_server_that_starts_while_the_asker_waits_is_asked() {
    let domain = Domain::new();
    let station = domain.open(Role::Station);
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(20));
            let bridge = domain.open(Role::Bridge);
            serve(&bridge, &stop);
        });
        let client = station.client::<BridgeRequest>().unwrap();
        let reply = client.call(Ask::default(), LONG);
        stop.store(true, Ordering::SeqCst);
        assert_eq!(reply.unwrap().outcome, Outcome::Done);
    });
}

#[test]
fn a_question_whose_asker_has_given_up_is_not_carried_out() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let server = bridge.server::<BridgeRequest>().unwrap();
    let station = domain.open(Role::Station);
    let client = station.client::<BridgeRequest>().unwrap();
    let error = client
        .call(Ask::default(), Duration::from_millis(5))
        .unwrap_err();
    assert!(matches!(error, CallError::NoAnswer { .. }), "{error:?}");
    assert_eq!(server.serve(answer).unwrap(), 0);

    // The next request is answered.
    std::thread::scope(|scope| {
        let asking = scope.spawn(|| {
            let client = station.client::<BridgeRequest>().unwrap();
            client.call(Ask::default(), LONG)
        });
        until("the question is answered", || {
            server.serve(answer).unwrap() == 1
        });
        assert!(asking.join().unwrap().is_ok());
    });
}
