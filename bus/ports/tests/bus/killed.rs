//! `kill -9` of every kind of process, and how the others react.

use std::path::Path;
use std::sync::Barrier;
use std::time::{Duration, Instant};

use lager_ports::{CallError, Cause, KeptError};
use lager_sample::Topic;
use lager_topics::{
    Ask, BridgeRequest, NavStatus, NavigatorStatus, Outcome, Role, SensorLine, SteeringCommand,
};
use lager_wake::{Policy, Wake};

use crate::domain::{Domain, drain, send, sweep, until};
use crate::process;

const LONG: Duration = Duration::from_secs(60);

#[test]
fn a_killed_process_is_swept_at_the_next_open() {
    let domain = Domain::new();
    process::start(&domain, "line-writer").kill();
    process::start(&domain, "line-reader").kill();
    assert_ne!(domain.in_shared_memory(), Vec::<String>::new());

    let bus = domain.open(Role::Bridge);
    assert_eq!(domain.in_shared_memory(), Vec::<String>::new());
    assert_eq!(bus.sweep(), 0);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let publisher = bus.publisher::<SensorLine>().unwrap();
    send(&publisher, 1);
    // The killed writer's samples do not arrive, and they are not counted as a gap.
    assert_eq!(drain(&mut subscriber), [1]);
    assert_eq!((subscriber.received(), subscriber.lost()), (1, 0));
}

#[test]
fn a_sweep_counts_the_dead_and_leaves_the_living_alone() {
    let domain = Domain::new();
    let bus = domain.open(Role::Supervisor);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let living = process::start(&domain, "line-writer");
    // Opening the bus sweeps too, so both start before either dies.
    let reader = process::start(&domain, "line-reader");
    let bridge = process::start(&domain, "deaf-bridge");
    reader.kill();
    bridge.kill();
    sweep(&bus, 2);
    assert_eq!(bus.sweep(), 0);
    assert_eq!(drain(&mut subscriber).len(), 10);
    drop(living);
}

#[test]
fn a_successor_of_a_killed_writer_is_a_new_stream_and_no_loss() {
    let domain = Domain::new();
    let bus = domain.open(Role::Logic);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    for restart in 1..=3 {
        let writer = process::start(&domain, "line-writer");
        assert_eq!(drain(&mut subscriber), (0..10).collect::<Vec<_>>());
        writer.kill();
        bus.sweep();
        assert_eq!(subscriber.writers_heard(), restart);
    }
    assert_eq!(subscriber.lost(), 0);
    assert_eq!(subscriber.received(), 30);
}

#[test]
fn places_of_killed_writers_are_taken_again() {
    let domain = Domain::new();
    let reader = domain.open(Role::Logic);
    let mut subscriber = reader.subscriber::<SensorLine>().unwrap();
    // All start before any is swept. Opening the bus sweeps, so they are killed together.
    let writers: Vec<_> = (0..SensorLine::QOS.max_publishers())
        .map(|_| process::start(&domain, "line-writer"))
        .collect();
    for writer in writers {
        writer.kill();
    }
    let publisher = reader.publisher::<SensorLine>().unwrap();
    send(&publisher, 77);
    assert!(drain(&mut subscriber).contains(&77));
}

#[test]
fn what_a_killed_writer_has_sent_can_be_read_before_the_sweep() {
    let domain = Domain::new();
    let bus = domain.open(Role::Logic);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let writer = process::start(&domain, "line-writer");
    writer.kill();
    assert_eq!(drain(&mut subscriber), (0..10).collect::<Vec<_>>());
    assert_eq!(subscriber.lost(), 0);
}

#[test]
fn what_a_killed_writer_has_sent_survives_the_sweep_if_its_reader_had_met_it() {
    let domain = Domain::new();
    let bus = domain.open(Role::Logic);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let writer = process::start(&domain, "line-writer");
    // After one sample they have met; nine samples stay unread.
    assert_eq!(subscriber.receive().unwrap().unwrap().link_epoch, 0);
    writer.kill();
    sweep(&bus, 1);
    assert_eq!(drain(&mut subscriber), (1..10).collect::<Vec<_>>());
    assert_eq!(subscriber.lost(), 0);
}

#[test]
fn a_killed_reader_does_not_hold_the_writer_up() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let mut other = domain
        .open(Role::Observer)
        .subscriber::<SensorLine>()
        .unwrap();
    let reader = process::start(&domain, "line-reader");
    send(&publisher, 0);
    reader.kill();
    for number in 1..1000 {
        send(&publisher, number);
        assert_eq!(drain(&mut other).last(), Some(&number));
    }
    bridge.sweep();
    send(&publisher, 1000);
    assert_eq!(drain(&mut other), [1000]);
}

#[test]
fn the_successor_of_a_killed_actor_is_rung() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let publisher = logic.publisher::<SteeringCommand>().unwrap();
    for swept in [false, true] {
        let actor = process::start(&domain, "deaf-bridge");
        publisher.send(Cause::OWN, Default::default()).unwrap();
        actor.kill();
        for _ in 0..10 {
            publisher.send(Cause::OWN, Default::default()).unwrap();
        }
        if swept {
            logic.sweep();
        }
        let successor = domain.open(Role::Bridge);
        let waiter = successor.waiter(Policy::Block).unwrap();
        publisher.send(Cause::OWN, Default::default()).unwrap();
        assert_eq!(waiter.wait(LONG), Wake::Rung, "swept: {swept}");
    }
}

#[test]
fn the_last_value_of_a_killed_service_is_handed_to_its_successor() {
    let domain = Domain::new();
    let supervisor = domain.open(Role::Supervisor);
    let mut keeper = supervisor.keeper::<NavStatus>().unwrap();
    keeper.hand_over().unwrap();
    assert!(
        !keeper.is_standing_in(),
        "there is nothing to hand over yet"
    );

    let service = process::start(&domain, "navigator");
    let pid = service.pid();
    keeper.remember().unwrap();
    assert_eq!(keeper.value().unwrap().0.order_id, 7);
    service.kill();
    keeper.remember().unwrap();
    sweep(&supervisor, 1);
    keeper.hand_over().unwrap();
    assert!(keeper.is_standing_in());

    // An observer that was there from the start and a new one see the same old value.
    let mut observer = domain
        .open(Role::Observer)
        .subscriber::<NavStatus>()
        .unwrap();
    keeper.remember().unwrap();
    let sample = observer.latest().unwrap().unwrap();
    assert_eq!(sample.order_id, 7);
    assert_eq!(sample.stamp().source_time_ns, 1234);
    assert_ne!(sample.stamp().writer, pid);
    drop(sample);

    let taken_over = Barrier::new(2);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let bus = domain.open(Role::Logic);
            let (kept, _) = bus.kept::<NavStatus>(LONG).unwrap().unwrap();
            assert_eq!(kept.order_id, 7);
            let publisher = bus.publisher::<NavStatus>().unwrap();
            let status = NavigatorStatus {
                order_id: 8,
                ..kept
            };
            publisher.send(Cause::OWN, status).unwrap();
            taken_over.wait();
        });
        until("the successor has taken over", || {
            keeper.remember().unwrap();
            !keeper.is_standing_in()
        });
        assert_eq!(observer.latest().unwrap().unwrap().order_id, 8);
        taken_over.wait();
    });
}

#[test]
fn a_keeper_withdraws_when_the_successor_speaks() {
    let domain = Domain::new();
    let supervisor = domain.open(Role::Supervisor);
    let mut keeper = supervisor.keeper::<NavStatus>().unwrap();
    let service = process::start(&domain, "navigator");
    keeper.remember().unwrap();
    service.kill();
    supervisor.sweep();
    keeper.hand_over().unwrap();

    let bus = domain.open(Role::Logic);
    let publisher = bus.publisher::<NavStatus>().unwrap();
    keeper.remember().unwrap();
    assert!(keeper.is_standing_in(), "nobody has spoken yet");
    let status = NavigatorStatus {
        order_id: 9,
        ..NavigatorStatus::default()
    };
    publisher.send(Cause::OWN, status).unwrap();
    keeper.remember().unwrap();
    assert!(!keeper.is_standing_in());
    assert_eq!(keeper.value().unwrap().0.order_id, 9);

    // From now on a newcomer sees only the successor's value.
    let mut observer = domain
        .open(Role::Observer)
        .subscriber::<NavStatus>()
        .unwrap();
    publisher.tick();
    assert_eq!(observer.latest().unwrap().unwrap().order_id, 9);
    assert_eq!(observer.received(), 1);
}

#[test]
fn a_kept_value_that_cannot_be_read_is_not_taken_for_none() {
    let domain = Domain::new();
    let supervisor = domain.open(Role::Supervisor);
    let publisher = supervisor.publisher::<NavStatus>().unwrap();
    publisher
        .send(Cause::OWN, NavigatorStatus::default())
        .unwrap();
    for name in domain.in_shared_memory() {
        if name.ends_with(".data") {
            std::fs::remove_file(Path::new("/dev/shm").join(name)).unwrap();
        }
    }
    let bus = domain.open(Role::Logic);
    // The error comes at once, not when the time is over.
    let hour = Duration::from_secs(3600);
    let error = bus.kept::<NavStatus>(hour).unwrap_err();
    assert!(matches!(error, KeptError::Unreadable { .. }), "{error}");
}

#[test]
fn a_hand_over_that_failed_is_tried_again() {
    let domain = Domain::new();
    let supervisor = domain.open(Role::Supervisor);
    let mut keeper = supervisor.keeper::<NavStatus>().unwrap();
    let service = process::start(&domain, "navigator");
    keeper.remember().unwrap();
    service.kill();
    keeper.remember().unwrap();
    sweep(&supervisor, 1);
    let others = domain.open(Role::Logic);
    let places = NavStatus::QOS.max_publishers();
    let mut taken: Vec<_> = (0..places)
        .map(|_| others.publisher::<NavStatus>().unwrap())
        .collect();
    assert!(keeper.hand_over().is_err());
    assert!(keeper.remember().is_err() && !keeper.is_standing_in());
    taken.pop();
    keeper.remember().unwrap();
    assert!(keeper.is_standing_in());
    let mut successor = others.subscriber::<NavStatus>().unwrap();
    // A reader that comes late gets the value at the keeper's next `remember`.
    keeper.remember().unwrap();
    assert_eq!(successor.latest().unwrap().unwrap().order_id, 7);
}

#[test]
fn at_a_first_start_nothing_was_kept() {
    let domain = Domain::new();
    let bus = domain.open(Role::Logic);
    let start = Instant::now();
    let wait = Duration::from_millis(20);
    assert_eq!(bus.kept::<NavStatus>(wait).unwrap(), None);
    assert!(start.elapsed() >= wait);
}

#[test]
fn an_asker_survives_the_killing_of_its_server() {
    let domain = Domain::new();
    let station = domain.open(Role::Station);
    let client = station.client::<BridgeRequest>().unwrap();
    let ask = Ask {
        gain_p: 3,
        ..Ask::default()
    };
    for _ in 0..3 {
        let bridge = process::start(&domain, "bridge");
        assert_eq!(client.call(ask, LONG).unwrap().gain_p, 3);
        bridge.kill();
        // Nobody has swept yet, so the dead server seems to be there but does not answer.
        for _ in 0..20 {
            let error = client.call(ask, Duration::from_millis(1)).unwrap_err();
            assert!(matches!(error, CallError::NoAnswer { .. }), "{error:?}");
        }
    }
    station.sweep();
    let error = client.call(ask, Duration::from_millis(1)).unwrap_err();
    assert!(matches!(error, CallError::NoServer { .. }), "{error:?}");
}

#[test]
fn a_question_is_put_again_to_the_successor_of_a_killed_server() {
    let domain = Domain::new();
    let station = domain.open(Role::Station);
    let deaf = process::start(&domain, "deaf-bridge");
    std::thread::scope(|scope| {
        let asking = scope.spawn(|| {
            let client = station.client::<BridgeRequest>().unwrap();
            client.call(Ask::default(), LONG)
        });
        std::thread::sleep(Duration::from_millis(30));
        deaf.kill();
        let successor = process::start(&domain, "bridge");
        assert_eq!(asking.join().unwrap().unwrap().outcome, Outcome::Done);
        drop(successor);
    });
}

#[test]
fn a_server_survives_the_killing_of_its_askers() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let server = bridge.server::<BridgeRequest>().unwrap();
    let answer = |_: &Ask| lager_topics::BridgeAnswer::default();
    for swept in [false, true] {
        process::start(&domain, "asker").kill();
        if swept {
            bridge.sweep();
        }
        // It is not an error if the asker is dead or its request is gone.
        server.serve(answer).unwrap();
    }
    std::thread::scope(|scope| {
        let asking = scope.spawn(|| {
            let bus = domain.open(Role::Station);
            let client = bus.client::<BridgeRequest>().unwrap();
            client.call(Ask::default(), LONG)
        });
        until("the living asker is answered", || {
            server.serve(answer).unwrap();
            asking.is_finished()
        });
        assert!(asking.join().unwrap().is_ok());
    });
}
