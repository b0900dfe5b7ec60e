//! The path from a sensor frame to a steering command, with bridge and logic as processes of
//! their own under `strace`: what each hop asks of the kernel, what the stamps tell, and what
//! `latency/path` and `latency/command` count.
//!
//! Here the navigator gives a new order for each frame: it takes line frames for old at once, so a
//! distance frame after a line frame halts the robot, and the next line frame starts it.

mod boards;
mod robot;
mod strace;

use std::error::Error;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use lager_bridge::BridgeConfig;
use lager_logic::LogicConfig;
use lager_ports::{Bus, Shutdown};
use lager_rig::process::run_if_asked;
use lager_rig::{Parent, bus_at};
use lager_tests::Domain;
use lager_topics::{Role, SensorDistance, SensorLine, Topic};

use robot::Robot;
use strace::{Calls, Part};

const BRIDGE: &str = "bridge";
const LOGIC: &str = "logic";

/// What a part is told: the bus's folder and the serial ports.
type Told = (PathBuf, [PathBuf; 2]);

/// Commands to be seen.
const COMMANDS: u64 = 400;

#[test]
#[ignore = "a process that the other tests start"]
fn part() {
    run_if_asked(&[&[(BRIDGE, bridge), (LOGIC, logic)]]);
}

/// Runs one service in a thread of its own until the parent has nothing more to say.
fn play(
    parent: &mut Parent,
    (name, role): (&str, Role),
    service: impl FnOnce(&Bus, [PathBuf; 2], &Shutdown) + Send,
) -> Result<(), Box<dyn Error>> {
    let (folder, ports): Told = parent.told()?;
    let config = bus_at(folder);
    let shutdown = Shutdown::new();
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .name(name.to_owned())
            .spawn_scoped(scope, || {
                let place = config.place().expect("a folder");
                // As `lager bridge` does: by its lock others know that it is up.
                let _lock = place.lock(&config.robot, role).expect("its lock");
                let bus = Bus::open(&config, role).expect("the bus opens");
                service(&bus, ports, &shutdown);
            })
            .expect("a thread");
        while let Ok(Some(())) = parent.hear() {}
        shutdown.request();
    });
    Ok(())
}

fn bridge(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    play(
        parent,
        ("bridge-loop", Role::Bridge),
        |bus, ports, shutdown| {
            let config = BridgeConfig {
                ports,
                ..BridgeConfig::default()
            };
            lager_bridge::run(bus, &config, shutdown).expect("the bridge");
        },
    )
}

fn logic(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    play(parent, ("logic-loop", Role::Logic), |bus, _, shutdown| {
        let config = LogicConfig {
            blind_after: Duration::ZERO,
            ..LogicConfig::default()
        };
        lager_logic::run(bus, &config, shutdown).expect("logic");
    })
}

/// That something was done at most so often. A ring can end two sleeps: the ringer adds to the
/// word, the sleeper sees that on its way to sleep and comes back, and the ringer's wake-up call
/// meets the next sleep. That is rare, so one call in fifty is let pass.
#[track_caller]
fn at_most(limit: u64, actual: u64, what: &str, calls: &Calls) {
    assert!(
        actual <= limit + limit / 50 + 2,
        "{what}: {actual}, at most {limit} are needed; {calls:?}"
    );
}

#[test]
fn a_frame_costs_its_read_its_write_and_one_ring_and_one_sleep_a_hop() {
    let domain = Domain::new();
    let mut robot = Robot::start(&domain, true);
    robot.frames(20);

    let before = robot.seen.samples();
    let (written, reports) = (robot.boards.written, robot.boards.reports);
    let from = SystemTime::now();
    robot.frames(COMMANDS);
    let to = SystemTime::now();
    let after = robot.seen.samples();
    let written = robot.boards.written - written;
    let reports = robot.boards.reports - reports;
    let frames = after.frames - before.frames;
    let orders = after.orders - before.orders;
    let states = after.states - before.states;
    let lapsed = after.lapsed - before.lapsed;

    let calls = |part: &Part, thread: &str| {
        let threads = part.threads();
        let id = threads
            .get(thread)
            .unwrap_or_else(|| panic!("no thread {thread} in {threads:?}"));
        let calls = part.calls(id, from, to);
        println!("{thread}: {calls:?}");
        assert!(calls.others.is_empty(), "{thread}: {:?}", calls.others);
        calls
    };
    println!("{frames} frames, {orders} orders, {written} packets, {states} states");
    // Now and then a report or an idle moment is faster than a frame and takes its place.
    assert!(frames.min(orders).min(written) + reports >= COMMANDS);

    // Reading the port, asleep until something comes; ringing logic.
    let reader = calls(&robot.bridge, "sensor-port");
    at_most(0, reader.polls, "waits for the sensor port", &reader);
    at_most(frames, reader.reads, "reads of the sensor port", &reader);
    at_most(frames, reader.wakes, "rings for a frame", &reader);
    assert_eq!((reader.sleeps, reader.writes), (0, 0), "{reader:?}");
    assert!(reader.reads + 2 >= frames, "strace has seen every read");

    // Sleeping for a ring, ringing the bridge.
    let logic = calls(&robot.logic, "logic-loop");
    at_most(frames + states, logic.sleeps, "sleeps of logic", &logic);
    at_most(orders, logic.wakes, "rings for an order", &logic);
    assert_eq!(
        (logic.polls, logic.reads, logic.writes),
        (0, 0, 0),
        "{logic:?}"
    );

    // Sleeping for a ring, writing the port; ringing logic for reports alone.
    let bridge = calls(&robot.bridge, "bridge-loop");
    at_most(
        orders + reports,
        bridge.sleeps,
        "sleeps of the bridge",
        &bridge,
    );
    at_most(states, bridge.wakes, "rings for a report", &bridge);
    at_most(written, bridge.writes, "writes of a packet", &bridge);
    at_most(reports + lapsed, states, "reports published", &bridge);
    assert_eq!((bridge.polls, bridge.reads), (0, 0), "{bridge:?}");
    assert!(bridge.writes + 2 >= written, "strace has seen every write");

    // After a tenth of a second without a report a read comes back with nothing, and a poll asks
    // why. A report may come just then, so the poll need not time out.
    let reports_reader = calls(&robot.bridge, "steering-port");
    let asked = reports_reader.polls + reports_reader.timeouts;
    let tenths = to.duration_since(from).expect("time goes on").as_millis() / 100;
    at_most(
        u64::try_from(tenths).expect("a test's time") + 1,
        asked,
        "polls of the steering port",
        &reports_reader,
    );
    at_most(
        reports + asked,
        reports_reader.reads,
        "reads of a report",
        &reports_reader,
    );
    at_most(
        reports,
        reports_reader.wakes,
        "rings for a report",
        &reports_reader,
    );

    robot.end();
    domain.assert_clean();
}

#[test]
fn every_frame_counts_and_each_command_that_one_has_caused() {
    let domain = Domain::new();
    let mut robot = Robot::start(&domain, false);
    let frames = robot.seen.samples().frames;
    let before = robot.seen.last_path;
    robot.frames(COMMANDS);
    // Without frames logic halts by the clock and renews its order; a report now and then.
    let sent = robot.seen.sent;
    robot.step_until("the order has been renewed for a while", |robot| {
        robot.seen.sent >= sent + 20
    });
    robot.settle();
    let frames = robot.seen.samples().frames - frames;

    assert_eq!(robot.seen.missed(), 0, "every order is seen");
    let caused: Vec<_> = robot
        .seen
        .orders
        .iter()
        .filter(|stamp| [SensorLine::ID, SensorDistance::ID].contains(&stamp.cause_topic))
        .collect();
    // A report that comes at the very moment of a distance frame halts the robot in its place.
    assert!(caused.len() as u64 + robot.boards.reports >= COMMANDS);
    for stamp in &caused {
        let way = [
            stamp.source_time_ns,
            stamp.cause_publish_time_ns,
            stamp.cause_receive_time_ns,
            stamp.publish_time_ns,
        ];
        assert!(way.is_sorted(), "{stamp:?}");
        let within = |[sent, read]: &[u64; 2]| *sent <= way[0] && way[3] <= *read;
        assert!(robot.spans.iter().any(within), "at no frame: {stamp:?}");
    }
    // An order that halts a robot that sees no frames says nothing of one, nor do its renewals.
    assert!(robot.seen.sent > caused.len() as u64);
    assert!(robot.seen.orders.len() > caused.len());

    // A report that comes right after a line frame can replace the frame's order before it is
    // written.
    let command = robot.seen.last_command;
    let counted = command.total.count;
    let replaced = caused.len() as u64 - counted;
    assert!(
        replaced <= robot.boards.reports,
        "{counted} of {}",
        caused.len()
    );

    // Every frame counts, whether it changes an order or not.
    let path = robot.seen.last_path;
    assert_eq!(path.total.count - before.total.count, frames);
    let stages = [&path.read_publish, &path.publish_receive, &path.decide];
    assert!(stages.iter().all(|stage| stage.count == path.total.count));
    let sums: u64 = stages.iter().map(|stage| stage.sum_ns).sum();
    assert_eq!(sums, path.total.sum_ns, "the stages are the whole");
    assert_eq!(command.receive_write.count, counted);
    assert!(command.order_receive.count >= caused.len() as u64);
    let longest = robot.spans.iter().map(|[sent, read]| read - sent).max();
    assert!(Some(command.total.max_ns) <= longest, "{longest:?}");

    let arguments = ["topic", "echo", "latency/command", "--json", "--count", "1"];
    let shown = domain.run(&arguments);
    let shown: serde_json::Value = serde_json::from_slice(&shown.stdout).expect("a JSON line");
    assert_eq!(shown["payload"]["total"]["count"], counted, "{shown}");
    robot.end();
    domain.assert_clean();
}
