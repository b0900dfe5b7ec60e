//! Tests of the path from a sensor frame to a steering command. Bridge and logic are processes of
//! their own under `strace`. The tests check the system calls of each hop, the stamps, and the
//! counts in `latency/path` and `latency/command`.
//!
//! The navigator gives a new order for each frame here: it trusts a line frame for no time, so a
//! distance frame after a line frame halts the robot, and the next line frame starts it.

mod boards;
mod robot;
mod strace;

use std::error::Error;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use lager_bridge::{BridgeConfig, Ports};
use lager_logic::LogicConfig;
use lager_ports::Bus;
use lager_rig::process::run_if_asked;
use lager_rig::{Parent, bus_at};
use lager_sample::Topic;
use lager_tests::Domain;
use lager_topics::{Role, SensorDistance, SensorLine};
use lager_wake::Shutdown;

use robot::Robot;
use strace::{Calls, Part};

const BRIDGE: &str = "bridge";
const LOGIC: &str = "logic";

/// The parent's message to a part: the bus's folder and the serial ports.
type PartSetup = (PathBuf, [PathBuf; 2]);

/// The number of commands that a test waits for.
const COMMANDS: u64 = 400;

#[test]
#[ignore = "a process that the other tests start"]
fn part() {
    run_if_asked(&[&[(BRIDGE, bridge), (LOGIC, logic)]]);
}

/// Runs one service in a thread of its own until the parent closes the line.
fn play(
    parent: &mut Parent,
    (name, role): (&str, Role),
    service: impl FnOnce(&Bus, [PathBuf; 2], &Shutdown) + Send,
) -> Result<(), Box<dyn Error>> {
    let (folder, ports): PartSetup = parent.told()?;
    let config = bus_at(folder);
    let shutdown = Shutdown::new();
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .name(name.to_owned())
            .spawn_scoped(scope, || {
                let place = config.home().expect("a folder");
                // As in `lager bridge`: the lock shows others that the service is up.
                let _lock = place.lock(&config.unit, role).expect("its lock");
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
                ports: Ports::Named(ports),
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

/// Asserts that something was done at most `most` times. One call in fifty more is allowed, since
/// rarely a ring ends two sleeps: the ringer adds to the word, the sleeper sees that on its way to
/// sleep and returns, and the ringer's wake-up call ends the next sleep.
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
    let statuses = robot.boards.statuses;
    let from = SystemTime::now();
    robot.frames(COMMANDS);
    let to = SystemTime::now();
    let after = robot.seen.samples();
    let written = robot.boards.written - written;
    let reports = robot.boards.reports - reports;
    let packets = robot.boards.statuses - statuses + (after.frames - before.frames);
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
    println!("{frames} frames in {packets} packets, {orders} orders in {written}, {states} states");
    // Sometimes a report or an idle moment comes before a frame and halts the robot instead.
    assert!(frames.min(orders).min(written) + reports >= COMMANDS);

    // The reader's calls: sleep on the port and read it; ring logic.
    let reader = calls(&robot.bridge, "sensor-port");
    at_most(0, reader.polls, "waits for the sensor port", &reader);
    at_most(packets, reader.reads, "reads of the sensor port", &reader);
    at_most(packets, reader.wakes, "rings for a packet", &reader);
    assert_eq!((reader.sleeps, reader.writes), (0, 0), "{reader:?}");
    assert!(reader.reads + 2 >= frames, "strace has seen every read");

    // Logic's calls: sleep until it is rung; ring the bridge.
    let logic = calls(&robot.logic, "logic-loop");
    at_most(frames + states, logic.sleeps, "sleeps of logic", &logic);
    at_most(orders, logic.wakes, "rings for an order", &logic);
    assert_eq!(
        (logic.polls, logic.reads, logic.writes),
        (0, 0, 0),
        "{logic:?}"
    );

    // The bridge's calls: sleep until it is rung; write to the port; ring logic only for reports.
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

    // After 100 ms without a report, a read returns nothing, and then a poll asks for the reason. A
    // report may come just then, so the poll need not time out.
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
    // Without frames, logic halts by its clock and renews that order; reports come now and then.
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
    // A report that comes at the same moment as a distance frame halts the robot instead.
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
    // If logic halts because no frame comes, neither the order nor its renewals name a frame.
    assert!(robot.seen.sent > caused.len() as u64);
    assert!(robot.seen.orders.len() > caused.len());

    // A report right after a line frame can replace the frame's order before the bridge writes it.
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
