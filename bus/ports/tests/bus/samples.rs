//! Sending and receiving: order, loss, history and limits.

use std::sync::Barrier;
use std::time::Duration;

use lager_home::Clock;
use lager_ports::{Bus, BusConfig, Cause, ReceiveError, SendError};
use lager_sample::Topic;
use lager_topics::{NavStatus, NavigatorStatus, OperatorInput, Role, SensorLine};
use lager_wake::{Policy, Wake};

use crate::domain::{Domain, drain, send};

#[test]
fn a_sample_arrives_with_its_stamp() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let publisher = bus.publisher::<SensorLine>().unwrap();
    assert!(subscriber.receive().unwrap().is_none());

    let before = Clock::monotonic_ns();
    let mut loan = publisher.loan().unwrap();
    assert_eq!(*loan, Default::default());
    loan.link_epoch = 42;
    loan.cause(Cause::event(17));
    loan.send().unwrap();
    let after = Clock::monotonic_ns();

    let sample = subscriber.receive().unwrap().unwrap();
    assert_eq!(sample.link_epoch, 42);
    let stamp = sample.stamp();
    assert_eq!(stamp.sequence, 0);
    assert_eq!(stamp.source_time_ns, 17);
    assert!((before..=after).contains(&stamp.publish_time_ns));
    assert_eq!(stamp.epoch, publisher.epoch());
    assert_eq!(stamp.writer, std::process::id());
    assert!(subscriber.receive().unwrap().is_none());
}

#[test]
fn a_dropped_loan_leaves_no_gap() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let publisher = bus.publisher::<SensorLine>().unwrap();
    send(&publisher, 1);
    drop(publisher.loan().unwrap());
    send(&publisher, 2);
    assert_eq!(drain(&mut subscriber), [1, 2]);
    assert_eq!(subscriber.lost(), 0);
}

#[test]
fn two_domains_do_not_meet() {
    let here = Domain::new();
    let there = Domain::new();
    {
        let bus = here.open(Role::Bridge);
        let publisher = bus.publisher::<SensorLine>().unwrap();
        let mut strangers: Vec<_> = (0..2)
            .map(|_| {
                let bus = there.open(Role::Logic);
                let subscriber = bus.subscriber::<SensorLine>().unwrap();
                (bus, subscriber)
            })
            .collect();
        let mut friend = here.open(Role::Logic).subscriber::<SensorLine>().unwrap();
        send(&publisher, 1);
        for (bus, subscriber) in &mut strangers {
            assert_eq!(drain(subscriber), Vec::<u32>::new());
            assert_eq!(bus.nodes().unwrap().len(), 2);
        }
        assert_eq!(drain(&mut friend), [1]);
    }
    drop(there);
}

#[test]
fn two_robots_on_one_bus_do_not_hear_each_other() {
    let domain = Domain::new();
    let bus = domain.open_robot("r1", Role::Bridge);
    let publisher = bus.publisher::<SensorLine>().unwrap();
    let mut own = domain
        .open_robot("r1", Role::Logic)
        .subscriber::<SensorLine>()
        .unwrap();
    let mut other = domain
        .open_robot("r2", Role::Logic)
        .subscriber::<SensorLine>()
        .unwrap();
    send(&publisher, 1);
    assert_eq!(drain(&mut own), [1]);
    assert_eq!(drain(&mut other), Vec::<u32>::new());
}

#[test]
fn who_sleeps_through_a_thousand_samples_knows_how_many_he_missed() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let publisher = bus.publisher::<SensorLine>().unwrap();
    for number in 0..1000 {
        send(&publisher, number);
    }
    assert_eq!(drain(&mut subscriber), (744..1000).collect::<Vec<_>>());
    assert_eq!(subscriber.received(), 256);
    assert_eq!(subscriber.lost(), 744);

    // While it reads it misses nothing; when it sleeps again, it counts on.
    send(&publisher, 1000);
    assert_eq!(drain(&mut subscriber), [1000]);
    assert_eq!(subscriber.lost(), 744);
    for number in 0..300 {
        send(&publisher, number);
    }
    assert_eq!(drain(&mut subscriber).len(), 256);
    assert_eq!(subscriber.lost(), 744 + 44);
}

#[test]
fn each_writer_is_counted_for_itself() {
    let domain = Domain::new();
    let bus = domain.open(Role::Logic);
    let mut subscriber = bus.subscriber::<OperatorInput>().unwrap();
    let one = bus.publisher::<OperatorInput>().unwrap();
    let two = bus.publisher::<OperatorInput>().unwrap();
    for number in 0..20 {
        one.send(Cause::OWN, Default::default()).unwrap();
        if number % 2 == 0 {
            two.send(Cause::OWN, Default::default()).unwrap();
        }
    }
    while subscriber.receive().unwrap().is_some() {}
    // Each writer has its own queue of 16.
    assert_eq!(subscriber.lost(), 4);
    assert_eq!(subscriber.received(), 16 + 10);
    assert_eq!(subscriber.writers_heard(), 2);
}

#[test]
fn who_reads_every_sample_of_a_state_may_look_seldom() {
    let domain = Domain::new();
    let bus = domain.open(Role::Guest);
    let publisher = bus.publisher::<NavStatus>().unwrap();
    let mut subscriber = bus.subscriber::<NavStatus>().unwrap();
    let places = NavStatus::QOS.buffer as u32;
    for (sent, lost) in [(places, 0), (places + 1, 1)] {
        for command_id in 1..=sent {
            let status = NavigatorStatus {
                command_id,
                ..NavigatorStatus::default()
            };
            publisher.send(Cause::OWN, status).unwrap();
        }
        let mut seen = Vec::new();
        while let Some(status) = subscriber.receive().unwrap() {
            seen.push(status.command_id);
        }
        assert_eq!(seen, (1 + lost..=sent).collect::<Vec<_>>());
        assert_eq!(subscriber.lost(), u64::from(lost));
    }
}

#[test]
fn who_comes_late_has_not_lost_what_was_before() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let publisher = bus.publisher::<SensorLine>().unwrap();
    for number in 0..10 {
        send(&publisher, number);
    }
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    send(&publisher, 10);
    assert_eq!(drain(&mut subscriber), [10]);
    assert_eq!(subscriber.lost(), 0);
}

#[test]
fn a_restarted_writer_is_a_new_stream_and_no_loss() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let first = bus.publisher::<SensorLine>().unwrap();
    for number in 0..5 {
        send(&first, number);
    }
    assert_eq!(drain(&mut subscriber).len(), 5);
    let first_epoch = first.epoch();
    drop(first);

    let second = bus.publisher::<SensorLine>().unwrap();
    assert!(second.epoch() > first_epoch);
    send(&second, 5);
    let sample = subscriber.receive().unwrap().unwrap();
    assert_eq!(sample.stamp().sequence, 0);
    assert_eq!(sample.stamp().epoch, second.epoch());
    assert_eq!(subscriber.lost(), 0);
    assert_eq!(subscriber.writers_heard(), 2);
}

#[test]
fn samples_of_a_writer_that_has_left_still_arrive() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let publisher = bus.publisher::<SensorLine>().unwrap();
    send(&publisher, 1);
    assert_eq!(drain(&mut subscriber), [1]);
    send(&publisher, 2);
    send(&publisher, 3);
    drop(publisher);
    assert_eq!(drain(&mut subscriber), [2, 3]);
    assert_eq!(subscriber.lost(), 0);
}

#[test]
fn a_late_joiner_gets_the_last_state_at_the_writers_tick() {
    let domain = Domain::new();
    let bus = domain.open(Role::Logic);
    let publisher = bus.publisher::<NavStatus>().unwrap();
    for order_id in 1..=3 {
        let status = NavigatorStatus {
            order_id,
            ..NavigatorStatus::default()
        };
        publisher.send(Cause::OWN, status).unwrap();
    }
    let mut late = domain
        .open(Role::Observer)
        .subscriber::<NavStatus>()
        .unwrap();
    assert!(late.latest().unwrap().is_none());
    publisher.tick();
    let sample = late.latest().unwrap().unwrap();
    assert_eq!(sample.order_id, 3);
    assert_eq!(sample.stamp().sequence, 2);
    drop(sample);
    assert_eq!(late.lost(), 0);

    // Once is enough.
    publisher.tick();
    assert!(late.latest().unwrap().is_none());
}

#[test]
fn a_state_reaches_late_joiners_while_its_writer_waits() {
    let domain = Domain::new();
    let bus = domain.open(Role::Logic);
    let waiter = bus.waiter(Policy::Block).unwrap();
    let publisher = bus.publisher::<NavStatus>().unwrap();
    publisher
        .send(Cause::OWN, NavigatorStatus::default())
        .unwrap();
    let late = domain.open(Role::Observer);
    let mut late = late.subscriber::<NavStatus>().unwrap();
    assert!(late.latest().unwrap().is_none());
    assert_eq!(waiter.wait(Duration::from_millis(1)), Wake::TimedOut);
    assert_eq!(late.latest().unwrap().unwrap().stamp().sequence, 0);
    // Nobody gets the state of a writer that is gone.
    drop(publisher);
    assert_eq!(waiter.wait(Duration::from_millis(1)), Wake::TimedOut);
    assert!(late.latest().unwrap().is_none());
}

#[test]
fn a_late_joiner_of_a_stream_gets_nothing_old() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let publisher = bus.publisher::<SensorLine>().unwrap();
    send(&publisher, 1);
    let mut late = bus.subscriber::<SensorLine>().unwrap();
    publisher.tick();
    assert_eq!(drain(&mut late), Vec::<u32>::new());
}

#[test]
fn the_latest_keeps_what_came_before_a_failure() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let publisher = bus.publisher::<SensorLine>().unwrap();
    for value in 1..=6 {
        send(&publisher, value);
    }
    // The reader holds one more, so it cannot receive the next.
    let held: Vec<_> = (0..3)
        .map(|_| subscriber.receive().unwrap().unwrap())
        .collect();
    let latest = subscriber.latest().unwrap().unwrap();
    assert_eq!(latest.link_epoch, 4);
    let failed = subscriber.latest().unwrap_err();
    assert_eq!(failed, ReceiveError::TooManyHeld { limit: 4 });
    drop((held, latest));
    assert_eq!(subscriber.latest().unwrap().unwrap().link_epoch, 6);
}

#[test]
fn the_latest_is_what_was_published_last_by_anybody() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let one = bus.publisher::<SensorLine>().unwrap();
    let two = bus.publisher::<SensorLine>().unwrap();
    send(&one, 1);
    send(&two, 2);
    send(&one, 3);
    send(&two, 4);
    send(&one, 5);
    assert_eq!(subscriber.latest().unwrap().unwrap().link_epoch, 5);
    assert!(subscriber.latest().unwrap().is_none());
    assert_eq!(subscriber.received(), 5);
}

#[test]
fn a_fifth_held_sample_is_refused_and_nothing_is_lost_by_it() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let publisher = bus.publisher::<SensorLine>().unwrap();
    for number in 0..5 {
        send(&publisher, number);
    }
    let mut held: Vec<_> = (0..4)
        .map(|_| subscriber.receive().unwrap().unwrap())
        .collect();
    assert_eq!(
        subscriber.receive().unwrap_err(),
        ReceiveError::TooManyHeld { limit: 4 }
    );
    held.pop();
    assert_eq!(drain(&mut subscriber), [4]);
    assert_eq!(held[0].link_epoch, 0);
    assert_eq!(subscriber.lost(), 0);
}

#[test]
fn a_third_open_loan_is_refused() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let publisher = bus.publisher::<SensorLine>().unwrap();
    let _one = publisher.loan().unwrap();
    let two = publisher.loan().unwrap();
    assert_eq!(
        publisher.loan().err(),
        Some(SendError::TooManyLoans { limit: 2 })
    );
    two.send().unwrap();
    assert!(publisher.loan().is_ok());
}

#[test]
fn a_bus_is_shared_between_threads_and_ports_are_made_in_theirs() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let sent = Barrier::new(5);
    let read = Barrier::new(5);
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let bus = bus.clone();
            let (sent, read) = (&sent, &read);
            scope.spawn(move || {
                let publisher = bus.publisher::<SensorLine>().unwrap();
                for number in 0..10 {
                    send(&publisher, thread * 100 + number);
                }
                sent.wait();
                // A publisher that leaves before anybody has heard it is forgotten.
                read.wait();
            });
        }
        sent.wait();
        let mut numbers = drain(&mut subscriber);
        read.wait();
        numbers.sort_unstable();
        let expected: Vec<u32> = (0..4)
            .flat_map(|thread| (0..10).map(move |number| thread * 100 + number))
            .collect();
        assert_eq!(numbers, expected);
        assert_eq!(subscriber.lost(), 0);
    });
}

#[test]
fn the_clock_of_a_hurried_robot_runs_faster() {
    let domain = Domain::new();
    let config = BusConfig {
        speed: 4.0,
        ..domain.config.clone()
    };
    let bus = Bus::open(&config, Role::Logic).unwrap();
    let real = Clock::monotonic_ns();
    let robot = bus.clock().now();
    assert!(robot.as_nanos() >= u128::from(real) * 4);
}

#[test]
fn processes_that_come_and_go_at_once_agree_on_one_topic() {
    const PARTIES: usize = 6;
    let domain = Domain::new();
    let together = Barrier::new(PARTIES);
    std::thread::scope(|scope| {
        for _ in 0..PARTIES {
            scope.spawn(|| {
                for _ in 0..10 {
                    // All create the topic at once, and all leave it at once.
                    together.wait();
                    let bus = domain.open(Role::Logic);
                    let mut subscriber = bus.subscriber::<OperatorInput>().unwrap();
                    together.wait();
                    let publisher = bus.publisher::<OperatorInput>().unwrap();
                    publisher.send(Cause::OWN, Default::default()).unwrap();
                    together.wait();
                    let mut writers = std::collections::HashSet::new();
                    while let Some(sample) = subscriber.receive().unwrap() {
                        writers.insert(sample.stamp().epoch);
                    }
                    assert_eq!(writers.len(), PARTIES);
                    together.wait();
                }
            });
        }
    });
}
