//! Actors have a service of their own and are served first. Everybody else gets the same samples,
//! and counts losses as exactly.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use lager_ports::{Cause, Peer, PortError};
use lager_rig::Process;
use lager_sample::{LARGEST_COPY, Qos, Stamp, Topic, payload};
use lager_topics::{Health, LinkHealth, Role, SensorLine};
use lager_wake::{Policy, Wake};

use crate::domain::{Domain, drain, frame, send, sweep};
use crate::interop::stock_listener_of_line;
use crate::process;

const NOTHING: [u32; 0] = [];

/// The publish-subscribe services of a bus, counted by their descriptions.
fn services(domain: &Domain) -> usize {
    let files = domain.left_in_folder();
    let is_one = |path: &std::path::PathBuf| {
        path.extension().is_some_and(|end| end == "service")
            && std::fs::read_to_string(path).is_ok_and(|text| text.contains("PublishSubscribe"))
    };
    files.iter().filter(|path| is_one(path)).count()
}

#[test]
fn actors_and_observers_get_the_same_samples_with_the_same_stamps() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    assert_eq!(services(&domain), 2);
    let roles = [Role::Logic, Role::Observer, Role::Supervisor, Role::Bridge];
    let mut readers: Vec<_> = roles
        .iter()
        .map(|role| domain.open(*role).subscriber::<SensorLine>().unwrap())
        .collect();
    for number in 0..300 {
        let mut loan = publisher.loan().unwrap();
        *loan = frame(number);
        loan.cause(Cause::event(u64::from(number) + 1));
        loan.send().unwrap();
        let seen: Vec<_> = readers
            .iter_mut()
            .map(|reader| {
                let sample = reader.receive().unwrap().unwrap();
                (*sample, *sample.stamp())
            })
            .collect();
        assert!(seen.iter().all(|sample| *sample == seen[0]), "{seen:?}");
        assert_eq!(seen[0].0, frame(number));
        assert_eq!(seen[0].1.sequence, u64::from(number));
    }
}

#[test]
#[ignore = "needs two cores; `tests/run` runs it where there are two"]
fn an_actor_that_looks_without_pause_is_there_before_the_observers_have_the_sample() {
    const ROUNDS: u32 = 10_000;
    // On one core the observer could not run while the writer runs.
    let domain = Domain::new();
    let publisher = domain.open(Role::Bridge).publisher::<SensorLine>().unwrap();
    let looked_at = AtomicU32::new(0);
    let was_first = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let actor = scope.spawn(|| {
            let (logic, observing) = (domain.open(Role::Logic), domain.open(Role::Observer));
            let waiter = logic.waiter(Policy::Spin).unwrap();
            let observers = (0..20).map(|_| observing.subscriber::<SensorLine>().unwrap());
            let mut observers: Vec<_> = observers.collect();
            let last = observers.last_mut().unwrap();
            looked_at.store(1, Ordering::Release);
            for number in 1..=ROUNDS {
                assert_eq!(waiter.wait(Duration::from_secs(60)), Wake::Rung);
                if drain(last).is_empty() {
                    // If the copy came first, the observer would have it when the ring is heard.
                    was_first.store(true, Ordering::Release);
                    break;
                }
                looked_at.store(number + 1, Ordering::Release);
            }
        });
        for number in 1..=ROUNDS {
            while looked_at.load(Ordering::Acquire) < number {
                if actor.is_finished() {
                    return;
                }
                std::thread::yield_now();
            }
            send(&publisher, number);
        }
    });
    assert!(was_first.load(Ordering::Acquire), "in {ROUNDS} rounds");
}

#[test]
fn observers_get_what_was_sent_ahead_when_its_writer_catches_up() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    let mut actor = logic.subscriber::<SensorLine>().unwrap();
    let mut observer = domain
        .open(Role::Observer)
        .subscriber::<SensorLine>()
        .unwrap();
    let (_node, listener) = stock_listener_of_line(&domain);
    let ahead = |number| {
        let mut loan = publisher.loan().unwrap();
        *loan = frame(number);
        loan.send_ahead().unwrap();
    };

    ahead(0);
    assert_eq!(waiter.wait(Duration::from_secs(60)), Wake::Rung);
    assert_eq!(drain(&mut actor), [0]);
    assert_eq!(drain(&mut observer), NOTHING);
    assert_eq!(listener.try_wait(|_| ()).unwrap(), 0);
    publisher.catch_up().unwrap();
    assert_eq!(drain(&mut observer), [0]);
    assert_eq!(listener.try_wait(|_| ()).unwrap(), 1);
    publisher.catch_up().unwrap();
    assert_eq!(drain(&mut observer), NOTHING, "it has caught up");
    assert_eq!(listener.try_wait(|_| ()).unwrap(), 0);

    // In the order in which they were sent, whichever way of sending comes next.
    ahead(1);
    ahead(2);
    assert_eq!(drain(&mut observer), [1]);
    send(&publisher, 3);
    assert_eq!(drain(&mut observer), [2, 3]);
    ahead(4);
    drop(publisher);
    assert_eq!(drain(&mut observer), [4]);
    assert_eq!(drain(&mut actor), [1, 2, 3, 4]);
    assert_eq!((observer.received(), observer.lost()), (5, 0));
    assert_eq!((actor.received(), actor.lost()), (5, 0));
}

#[test]
fn a_killed_writer_takes_no_more_along_than_what_it_had_sent_ahead() {
    let domain = Domain::new();
    let mut actor = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    let mut observer = domain
        .open(Role::Observer)
        .subscriber::<SensorLine>()
        .unwrap();
    process::start(&domain, "line-writer-ahead").kill();
    assert_eq!(drain(&mut actor), (0..10).collect::<Vec<_>>());
    assert_eq!(drain(&mut observer), (0..9).collect::<Vec<_>>());
    // The successor's samples are a new stream and not a loss.
    process::start(&domain, "line-writer").kill();
    for reader in [&mut actor, &mut observer] {
        assert_eq!(drain(reader), (0..10).collect::<Vec<_>>());
        assert_eq!((reader.lost(), reader.writers_heard()), (0, 2));
    }
}

#[test]
fn each_side_counts_its_own_losses() {
    let domain = Domain::new();
    let publisher = domain.open(Role::Bridge);
    let mut actor = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    let mut observer = domain
        .open(Role::Observer)
        .subscriber::<SensorLine>()
        .unwrap();
    let publisher = publisher.publisher::<SensorLine>().unwrap();
    let some = |count| (0..count).for_each(|number| send(&publisher, number));
    some(300);
    assert_eq!(drain(&mut actor).len(), 256);
    some(100);
    assert_eq!(drain(&mut observer).len(), 256);
    some(300);
    assert_eq!(drain(&mut actor).len(), 256);
    assert_eq!(drain(&mut observer).len(), 256);
    assert_eq!((actor.received(), actor.lost()), (512, 188));
    assert_eq!((observer.received(), observer.lost()), (512, 188));
    assert_eq!(publisher.sent(), 700);
}

#[test]
fn observers_that_come_and_go_miss_nothing_of_what_is_theirs() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let _actor = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    send(&publisher, 0);
    let unwatched = domain.in_shared_memory().len();
    for _ in 0..3 {
        // There is no observer, so the writer makes no copies.
        (0..50).for_each(|number| send(&publisher, number));
        let observer = domain.open(Role::Observer);
        let mut observer = observer.subscriber::<SensorLine>().unwrap();
        let before = publisher.sent();
        (0..20).for_each(|number| send(&publisher, number));
        let first = observer.receive().unwrap().unwrap();
        assert_eq!(first.stamp().sequence, before);
        drop(first);
        assert_eq!(drain(&mut observer), (1..20).collect::<Vec<_>>());
        assert_eq!((observer.received(), observer.lost()), (20, 0));
        drop(observer);
        // The next sample frees what connected the writer to the observer.
        send(&publisher, 0);
        assert_eq!(domain.in_shared_memory().len(), unwatched);
    }
}

#[test]
fn an_observer_that_was_there_first_counts_from_the_first_sample() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let mut observer = observer.subscriber::<SensorLine>().unwrap();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    (0..257).for_each(|number| send(&publisher, number));
    assert_eq!(drain(&mut observer).len(), 256);
    assert_eq!(observer.lost(), 1);
}

#[test]
fn a_state_reaches_late_joiners_of_both_kinds() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<LinkHealth>().unwrap();
    // There is no reader yet.
    for bus_lost in 1..=3 {
        let health = Health {
            bus_lost,
            ..Health::default()
        };
        publisher.send(Cause::OWN, health).unwrap();
    }
    let roles = [Role::Logic, Role::Observer];
    let late = || roles.map(|role| domain.open(role).subscriber::<LinkHealth>().unwrap());
    let mut readers = late();
    publisher.tick();
    for reader in &mut readers {
        let sample = reader.latest().unwrap().unwrap();
        assert_eq!((sample.bus_lost, sample.stamp().sequence), (3, 2));
        drop(sample);
        assert_eq!(reader.lost(), 0);
    }
    publisher.tick();
    assert!(
        readers
            .iter_mut()
            .all(|reader| reader.latest().unwrap().is_none())
    );

    // It also works while the writer only waits.
    let waiter = bridge.waiter(Policy::Block).unwrap();
    let mut readers = late();
    assert_eq!(waiter.wait(Duration::from_millis(1)), Wake::TimedOut);
    for reader in &mut readers {
        assert_eq!(reader.latest().unwrap().unwrap().stamp().sequence, 2);
    }
}

#[test]
fn a_state_that_is_handed_over_reaches_the_successor_and_both_kinds_of_readers() {
    let domain = Domain::new();
    let supervisor = domain.open(Role::Supervisor);
    let mut keeper = supervisor.keeper::<LinkHealth>().unwrap();
    let bridge = process::start(&domain, "health-writer");
    let pid = bridge.pid();
    keeper.remember().unwrap();
    bridge.kill();
    keeper.remember().unwrap();
    sweep(&supervisor, 1);
    assert_eq!(keeper.value().unwrap().0.bus_lost, 7);
    keeper.hand_over().unwrap();

    let successor = domain.open(Role::Bridge);
    // The keeper need not tick, because the value was sent after the readers came.
    let roles = [Role::Logic, Role::Observer];
    let mut readers = roles.map(|role| domain.open(role).subscriber::<LinkHealth>().unwrap());
    let kept = std::thread::scope(|scope| {
        let kept = scope.spawn(|| successor.kept::<LinkHealth>(Duration::from_secs(60)));
        while !kept.is_finished() {
            keeper.remember().unwrap();
            std::thread::sleep(Duration::from_millis(1));
        }
        kept.join().unwrap().unwrap()
    });
    let (health, stamp) = kept.unwrap();
    assert_eq!((health.bus_lost, stamp.source_time_ns), (7, 1234));
    for reader in &mut readers {
        let sample = reader.latest().unwrap().unwrap();
        assert_eq!((sample.bus_lost, sample.stamp().source_time_ns), (7, 1234));
        assert_ne!(sample.stamp().writer, pid);
    }
    let publisher = successor.publisher::<LinkHealth>().unwrap();
    publisher.send(Cause::OWN, Health::default()).unwrap();
    keeper.remember().unwrap();
    assert!(!keeper.is_standing_in());
    for reader in &mut readers {
        assert_eq!(reader.latest().unwrap().unwrap().bus_lost, 0);
    }
}

#[test]
fn a_recorded_sample_keeps_its_stamp_on_both_sides() {
    let domain = Domain::new();
    let player = domain.open(Role::Recorder);
    let publisher = player.publisher::<SensorLine>().unwrap();
    let roles = [Role::Logic, Role::Observer];
    let mut readers = roles.map(|role| domain.open(role).subscriber::<SensorLine>().unwrap());
    for sequence in [5, 6, 9] {
        let stamp = Stamp {
            sequence,
            publish_time_ns: 40 + sequence,
            epoch: 3,
            writer: 77,
            ..Stamp::default()
        };
        publisher.replay(frame(1), stamp).unwrap();
        for reader in &mut readers {
            assert_eq!(*reader.receive().unwrap().unwrap().stamp(), stamp);
        }
    }
    for reader in &readers {
        assert_eq!((reader.lost(), reader.writers_heard()), (2, 1));
    }
}

#[test]
fn neither_side_takes_places_of_the_other() {
    let domain = Domain::new();
    let logic = domain.open(Role::Logic);
    let limit = SensorLine::QOS.max_acting();
    let mut actors: Vec<_> = (0..limit)
        .map(|_| logic.subscriber::<SensorLine>().unwrap())
        .collect();
    let topic = SensorLine::NAME.to_owned();
    let refused = logic.subscriber::<SensorLine>().unwrap_err();
    assert_eq!(refused, PortError::TooManyReaders { topic, limit });

    let observers = domain.open(Role::Observer);
    let observers: Vec<_> = (0..SensorLine::QOS.observers)
        .map(|_| observers.subscriber::<SensorLine>().unwrap())
        .collect();
    let services = domain.open(Role::Station);
    let others = SensorLine::QOS.max_subscribers() - SensorLine::QOS.observers;
    let _others: Vec<_> = (0..others)
        .map(|_| services.subscriber::<SensorLine>().unwrap())
        .collect();
    assert!(services.subscriber::<SensorLine>().is_err());
    actors.pop();
    actors.push(logic.subscriber::<SensorLine>().unwrap());

    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    send(&publisher, 5);
    for mut reader in actors.into_iter().chain(observers) {
        assert_eq!(drain(&mut reader), [5]);
    }
}

#[test]
fn places_of_killed_actors_are_taken_again() {
    let domain = Domain::new();
    let players: Vec<_> = (0..SensorLine::QOS.max_acting())
        .map(|_| process::start(&domain, "line-actor"))
        .collect();
    // All start before any is swept, because opening the bus sweeps.
    let bridge = domain.open(Role::Bridge);
    let logic = domain.open(Role::Logic);
    players.into_iter().for_each(Process::kill);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let mut successor = logic.subscriber::<SensorLine>().unwrap();
    send(&publisher, 6);
    assert_eq!(drain(&mut successor), [6]);
}

#[test]
fn a_topic_is_one_whoever_reads_and_writes_it_where() {
    let domain = Domain::new();
    let onlooker = domain.open(Role::Observer);
    let line = || {
        let topics = onlooker.topics().unwrap();
        let names: Vec<_> = topics.iter().map(|topic| topic.name.clone()).collect();
        assert_eq!(names, [SensorLine::NAME]);
        let topic = topics.into_iter().next().unwrap();
        assert_eq!(topic.publishers, topic.writers.len());
        assert_eq!(topic.subscribers, topic.readers.len());
        (topic.publishers, topic.subscribers, topic.observers)
    };
    let logic = domain.open(Role::Logic);
    let actor = logic.subscriber::<SensorLine>().unwrap();
    assert_eq!(line(), (0, 1, 0));
    let _observer = domain
        .open(Role::Monitor)
        .subscriber::<SensorLine>()
        .unwrap();
    let _station = domain
        .open(Role::Station)
        .subscriber::<SensorLine>()
        .unwrap();
    assert_eq!(line(), (0, 3, 1));
    let bridge = domain.open(Role::Bridge);
    let publishers = [(); 2].map(|()| bridge.publisher::<SensorLine>().unwrap());
    let _other = logic.publisher::<SensorLine>().unwrap();
    assert_eq!(line(), (3, 3, 1));
    let pid = std::process::id();
    let peer = |role: Role| Peer {
        part: Some(role.to_string()),
        observes: false,
        pid,
    };
    let mut writers = onlooker.topics().unwrap()[0].writers.clone();
    writers.sort_by_key(|writer| writer.part.clone());
    let expected = [Role::Bridge, Role::Bridge, Role::Logic].map(peer);
    assert_eq!(writers, expected);
    drop((actor, publishers));
    assert_eq!(line(), (1, 2, 1));

    // A tool cannot read the actors' service as if it were a topic of that name.
    assert!(onlooker.found("sensor/line:actors").unwrap().is_none());
    assert!(onlooker.found(SensorLine::NAME).unwrap().is_some());
}

payload! {
    /// A picture, too large to be copied.
    pub struct Picture: 65536 bytes {
        /// The pixels.
        pub pixels: [[[u64; 32]; 16]; 16],
    }
}

struct Camera;

impl Topic for Camera {
    const NAME: &'static str = "camera/front";
    type Payload = Picture;
    const QOS: Qos = Qos::stream(4).waking(&[Role::Logic.part()]).uncopied();
    const SUMMARY: &'static str = "What is in front of the robot.";
}

#[test]
fn a_large_payload_is_not_copied() {
    assert!(size_of::<Picture>() > LARGEST_COPY);
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let camera = bridge.publisher::<Camera>().unwrap();
    assert_eq!(services(&domain), 1);
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    let roles = [Role::Logic, Role::Observer];
    let mut readers = roles.map(|role| domain.open(role).subscriber::<Camera>().unwrap());
    assert_eq!(services(&domain), 1);
    let mut loan = camera.loan_uninit().unwrap();
    loan.pixels[15][15][31] = 9;
    loan.send().unwrap();
    assert_eq!(waiter.wait(Duration::from_secs(60)), Wake::Rung);
    let line = domain.open(Role::Observer).topics().unwrap().remove(0);
    assert_eq!(
        (line.publishers, line.subscribers, line.observers),
        (1, 2, 1)
    );
    for reader in &mut readers {
        let sample = reader.receive().unwrap().unwrap();
        assert_eq!((sample.pixels[15][15][31], sample.stamp().sequence), (9, 0));
    }
}

payload! {
    /// The wind, a payload of another program.
    pub struct Gust: 8 bytes {
        /// In mm/s.
        pub wind: u64,
    }
}

struct Draught;

impl Topic for Draught {
    const NAME: &'static str = "weather/draught";
    type Payload = Gust;
    const QOS: Qos = Qos::stream(16).waking(&[Role::Guest.part()]);
    const SUMMARY: &'static str = "A topic that is in no table.";
}

#[test]
fn a_tool_that_does_not_know_a_topic_serves_its_actors_too() {
    let domain = Domain::new();
    let mut observer = domain.open(Role::Observer).subscriber::<Draught>().unwrap();
    let tool = domain.open(Role::Operator);
    let writer = tool.any_publisher(Draught::NAME).unwrap().unwrap();
    writer.send(&1_u64.to_ne_bytes()).unwrap();
    assert_eq!(observer.receive().unwrap().unwrap().wind, 1);

    let guest = domain.open(Role::Guest);
    let waiter = guest.waiter(Policy::Block).unwrap();
    let mut actor = guest.subscriber::<Draught>().unwrap();
    writer.tick();
    writer.send(&2_u64.to_ne_bytes()).unwrap();
    assert_eq!(waiter.wait(Duration::from_secs(60)), Wake::Rung);
    for reader in [&mut actor, &mut observer] {
        let sample = reader.receive().unwrap().unwrap();
        assert_eq!((sample.wind, sample.stamp().sequence), (2, 1));
        drop(sample);
        assert_eq!(reader.lost(), 0);
    }
    // This also holds for an actor that was there before the tool.
    let tool = domain.open(Role::Recorder);
    let writer = tool.any_publisher(Draught::NAME).unwrap().unwrap();
    writer.send(&3_u64.to_ne_bytes()).unwrap();
    assert_eq!(actor.receive().unwrap().unwrap().wind, 3);
    let seen = domain.open(Role::Observer).topics().unwrap().remove(0);
    assert_eq!((seen.publishers, seen.subscribers), (2, 2));
}
