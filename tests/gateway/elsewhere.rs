//! Tests of `--remote` for what shows or keeps the whole robot: `top`, `bag record`, the gateway's
//! figures and views, and the clocks of two machines.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use lager_ports::{Bus, Publisher};
use lager_remote::Remote;
use lager_tests::{Domain, Running, free, pid, wait_for};
use lager_topics::Role;
use lager_wake::Shutdown;
use rustix::process::{Signal, kill_process};
use serde_json::Value;

use crate::live::{Much, MuchNow, send};
use crate::relay::Relay;
use crate::remote::{lines, numbers, robot, said};
use crate::{LINES, ORDERED, figures, until};

/// The JSON lines of a tool that still runs, or has ended.
pub(crate) fn told(of: &Running) -> Vec<Value> {
    let output = of.output();
    let whole = output.rsplit_once('\n').map_or("", |(whole, _)| whole);
    whole
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

/// A gateway of its own beside a robot, which nobody replaces.
pub(crate) fn gateway(domain: &Domain, endpoint: &str) -> Running {
    let gateway = domain.start(&["gateway", "--zenoh", endpoint]);
    wait_for("the gateway", || {
        let listed = domain.run(&["topic", "list", "--remote", endpoint]);
        listed.status.success().then_some(())
    });
    gateway
}

fn one_picture(domain: &Domain, more: &[&str]) -> Value {
    let top = ["top", "--once", "--json"];
    lines(&domain.run(&[&top[..], more].concat())).remove(0)
}

#[test]
fn top_shows_the_robot_from_afar_and_says_what_is_old() {
    let domain = Domain::new();
    let endpoint = format!("tcp/{}", free());
    let up = domain.start(&["up", "--headless", "--no-station"]);
    let listens = gateway(&domain, &endpoint);
    let names = |picture: &Value| -> Vec<String> {
        let topics = picture["topics"].as_array().expect("a list").iter();
        let mut names: Vec<String> = topics
            .map(|row| row["topic"].as_str().expect("a name").to_owned())
            .collect();
        names.sort();
        names
    };
    let near = one_picture(&domain, &[]);
    let far = one_picture(&domain, &["--duration", "4", "--remote", &endpoint]);
    assert_eq!(names(&far), names(&near));
    for key in ["mode", "robot"] {
        assert_eq!(far[key], near[key], "{key}");
    }
    assert!(far["sensor"]["up"].as_bool().expect("a link"), "{far}");
    assert!(far["battery_V"].as_f64().expect("volts") > 8.0, "{far}");
    assert_eq!(far["failing"], Value::Array(Vec::new()));
    let row = |picture: &Value, name: &str| -> Value {
        let topics = picture["topics"].as_array().expect("a list").iter();
        let mut found = topics.filter(|row| row["topic"] == name);
        found.next().expect("a row").clone()
    };
    let line = row(&far, "sensor/line");
    assert!(line["hz"].as_f64().expect("a rate") > 50.0, "{line}");
    assert_eq!(line["lost"], 0);
    assert_eq!(line["writers"], row(&near, "sensor/line")["writers"]);
    // The robot's clock runs as fast as this one, as the gateway tells.
    let pace = far["robot_seconds_per_second"].as_f64().expect("a pace");
    assert!((0.5..2.0).contains(&pace), "{pace}");

    // A gateway that stands still: what was heard is old, and top says so.
    let watching = [
        "top",
        "--once",
        "--json",
        "--duration",
        "12",
        "--remote",
        &endpoint,
    ];
    let mut watching = domain.start(&watching);
    std::thread::sleep(Duration::from_secs(3));
    kill_process(pid(listens.pid()), Signal::STOP).expect("a living process");
    assert_eq!(watching.wait(), Some(0), "{}", watching.log());
    kill_process(pid(listens.pid()), Signal::CONT).expect("a living process");
    let picture = watching.json();
    let failing = &picture["failing"][0];
    assert_eq!(
        (&failing["service"], &failing["state"]),
        (&"gateway".into(), &"silent".into())
    );
    let age_ns = row(&picture, "sensor/line")["age_ns"]
        .as_u64()
        .expect("an age");
    assert!(age_ns > 3_000_000_000, "{picture}");

    let stopped = |picture: &Value| picture["stop"].is_string();
    domain.done(&["stop"]);
    wait_for("the stop", || {
        stopped(&one_picture(&domain, &["--remote", &endpoint])).then_some(())
    });
    domain.done(&["resume"]);
    drop((listens, up));
    domain.assert_clean();
}

/// More than fits between a gateway and a listener that reads nothing: queues and both sockets.
const MUCH: u64 = 24 << 20;

/// A bus on which the test publishes, its gateway, and a listener that hears all of it.
struct Source {
    publisher: Publisher<MuchNow>,
    awake: lager_remote::Listening,
    _gateway: Running,
    _remote: Remote,
    _bus: Bus,
    sent: u64,
}

impl Source {
    fn new(domain: &Domain, endpoint: &str) -> Self {
        let bus = Bus::open(&domain.bus("r1", 1.0), Role::Guest).expect("the bus opens");
        let publisher: Publisher<MuchNow> = bus.publisher().expect("a topic");
        let gateway = domain.start(&["gateway", "--zenoh", endpoint]);
        let (r1, at) = (
            "r1".parse().expect("a name"),
            endpoint.parse().expect("an endpoint"),
        );
        let remote = wait_for("the gateway", || {
            let remote = Remote::open(&at, &r1, None, &Shutdown::new()).ok()?;
            let topics = remote.topics().ok()?;
            topics.contains_key("much/now").then_some(remote)
        });
        let awake = remote.listen("much/now").expect("a topic");
        Self {
            publisher,
            awake,
            _gateway: gateway,
            _remote: remote,
            _bus: bus,
            sent: 0,
        }
    }

    fn send(&mut self) {
        send(&self.publisher, self.sent);
        self.sent += 1;
    }

    /// Sends so many bytes, and no sample before the gateway has taken the ones before.
    fn send_much(&mut self, bytes: u64) {
        let until = self.sent + bytes / size_of::<Much>() as u64;
        while self.sent < until {
            (0..32).for_each(|_| self.send());
            let last = self.sent - 1;
            wait_for("the last one so far", || {
                numbers(&mut self.awake).contains(&last).then_some(())
            });
        }
    }
}

/// The samples of a recording, by their numbers, and how many were lost up to each.
fn recorded(domain: &Domain, file: &str) -> Vec<(u64, u64)> {
    let tables = format!("{file}-tables");
    domain.done(&["bag", "export", file, "--csv", &tables]);
    let table = domain.folder().join(tables).join("much-now.csv");
    let table = fs::read_to_string(table).expect("a table");
    let columns: Vec<&str> = table.lines().next().expect("a head").split(',').collect();
    let column = |name: &str| {
        columns
            .iter()
            .position(|column| *column == name)
            .expect(name)
    };
    let (sequence, lost) = (column("sequence"), column("lost"));
    let rows = table.lines().skip(1).map(|row| {
        let fields: Vec<&str> = row.split(',').collect();
        let number = |place: usize| fields[place].parse().expect("a number");
        (number(sequence), number(lost))
    });
    rows.collect()
}

#[test]
fn a_recording_from_afar_has_each_gap_marked_and_the_sum_is_the_truth() {
    let domain = Domain::new();
    let address = free();
    let mut source = Source::new(&domain, &format!("tcp/{address}"));
    let relay = Relay::to(&address);
    let record = |file: &str| {
        let from = relay.endpoint();
        let args = [
            "bag", "--json", "record", file, "--topic", "much/now", "--remote", &from,
        ];
        domain.start(&args)
    };
    let count = |recording: &Running, key: &str| -> u64 {
        let last = told(recording).pop();
        let topic = last.and_then(|last| last["topics"].get(0).cloned());
        topic.map_or(0, |topic| topic[key].as_u64().expect("a number"))
    };
    for (file, is_paused) in [("clean.mcap", false), ("gaps.mcap", true)] {
        let mut recording = record(file);
        wait_for("the first sample", || {
            source.send();
            std::thread::sleep(Duration::from_millis(20));
            (count(&recording, "received") > 0).then_some(())
        });
        if is_paused {
            relay.pause();
            source.send_much(MUCH);
            relay.free();
            wait_for("a loss", || {
                source.send();
                std::thread::sleep(Duration::from_millis(20));
                (count(&recording, "lost") > 0).then_some(())
            });
        }
        (0..50).for_each(|_| {
            source.send();
            std::thread::sleep(Duration::from_millis(5));
        });
        // Until nothing more comes.
        wait_for("the last sample", || {
            let progress = told(&recording);
            let of = |back: usize| {
                progress.get(progress.len().checked_sub(back)?)?["topics"]
                    .get(0)
                    .cloned()
            };
            (of(1)? == of(2)? && of(2)? == of(3)?).then_some(())
        });
        recording.signal(Signal::INT);
        assert_eq!(recording.wait(), Some(0), "{}", recording.log());
        let samples = recorded(&domain, file);
        let (first, last) = (samples[0].0, samples[samples.len() - 1].0);
        assert_eq!(last, source.sent - 1);
        let [received, lost, dropped] =
            ["received", "lost", "dropped"].map(|key| count(&recording, key));
        assert_eq!((received, dropped), (samples.len() as u64, 0));
        assert_eq!(received + lost, last + 1 - first, "in {file}");
        assert_eq!(lost > 0, is_paused, "in {file}");
        // In the file each sample says what was lost up to it.
        for (sequence, lost) in &samples {
            let place = samples
                .binary_search(&(*sequence, *lost))
                .expect("in order") as u64;
            assert_eq!(first + place + lost, *sequence, "in {file}");
        }
        let info = lines(&domain.run(&["bag", "info", file, "--json"])).remove(0);
        let topic = &info["topics"][0];
        assert_eq!(
            (&topic["received"], &topic["lost"]),
            (&received.into(), &lost.into())
        );
        domain.done(&["bag", "check", file]);
    }
    drop(source);
    domain.assert_clean();
}

/// At random some recordings would miss what was published before they began.
#[test]
fn twenty_recordings_have_the_map_that_was_sent_before_they_began() {
    const AT_ONCE: usize = 5;
    let domain = Domain::new();
    let endpoint = format!("tcp/{}", free());
    let up = robot(&domain, &endpoint);
    // A robot that stands finds no way blocked, so nobody sends the map again.
    domain.done(&["stop"]);
    domain.done(&["topic", "echo", "nav/map", "--count", "1"]);
    // How many samples of each topic have come so far.
    let counts = |recording: &Running| -> BTreeMap<String, u64> {
        let last = told(recording).pop().unwrap_or_default();
        let topics = last["topics"].as_array().into_iter().flatten();
        let count = |topic: &Value| {
            let name = topic["topic"].as_str().expect("a name").to_owned();
            (name, topic["received"].as_u64().expect("a number"))
        };
        topics.map(count).collect()
    };
    let record = |file: &str, more: &[&str]| {
        domain.start(&[&["bag", "--json", "record", file], more].concat())
    };
    let mut near = record("near.mcap", &[]);
    let names = wait_for("the topics of the bus", || {
        let counts = counts(&near);
        (counts.get("nav/map") == Some(&1)).then(|| counts.into_keys().collect::<Vec<_>>())
    });
    for round in 0..4 {
        let begin = |number| {
            let file = format!("far-{round}-{number}.mcap");
            (record(&file, &["--remote", &endpoint]), file)
        };
        let recordings: Vec<_> = (0..AT_ONCE).map(begin).collect();
        for (mut recording, file) in recordings {
            wait_for("the map, and every topic", || {
                let counts = counts(&recording);
                let has_map = counts.get("nav/map") == Some(&1);
                (has_map && counts.into_keys().eq(names.iter().cloned())).then_some(())
            });
            recording.signal(Signal::INT);
            assert_eq!(recording.wait(), Some(0), "{}", recording.log());
            let info = lines(&domain.run(&["bag", "info", &file, "--json"])).remove(0);
            let mut topics = info["topics"].as_array().expect("a list").iter();
            let map = topics.find(|topic| topic["topic"] == "nav/map");
            assert_eq!(map.expect("the map")["received"], 1, "{file}: {info}");
        }
    }
    near.signal(Signal::INT);
    assert_eq!(near.wait(), Some(0), "{}", near.log());
    // A stop in force would outlive the robot.
    domain.done(&["resume"]);
    drop(up);
    domain.assert_clean();
}

#[test]
fn figures_and_views_of_a_robot_elsewhere_are_those_of_its_own_gateway() {
    let domain = Domain::new();
    let endpoint = format!("tcp/{}", free());
    let up = robot(&domain, &endpoint);
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Guest).expect("the bus opens");
    let publisher: Publisher<MuchNow> = bus.publisher().expect("a topic");
    let (metrics, foxglove) = (free(), free());
    let elsewhere = domain.start(&[
        "gateway",
        "--metrics",
        &metrics,
        "--foxglove",
        &foxglove,
        "--remote",
        &endpoint,
    ]);
    until(&metrics, LINES, |samples| samples > 100.0);
    until(
        &metrics,
        "lager_link_up{robot=\"r1\",board=\"sensor\"}",
        |up| up == 1.0,
    );
    until(&metrics, ORDERED, |latched| latched == 0.0);
    domain.done(&["stop"]);
    until(&metrics, ORDERED, |latched| latched == 1.0);
    domain.done(&["resume"]);
    // A topic of a user's own, in both.
    let mut number = 0;
    let mut publish = || {
        send(&publisher, number);
        number += 1;
    };
    wait_for("its figure", || {
        publish();
        let much = "lager_topic_samples_total{robot=\"r1\",topic=\"much/now\"}";
        figures(&metrics)?
            .get(much)
            .filter(|samples| **samples > 0.0)
            .map(|_| ())
    });
    let mut viewer = wait_for("the view", || {
        crate::live::Viewer::connect(&foxglove, "much/now")
    });
    wait_for("its sample in the view", || {
        publish();
        viewer.number()
    });
    let figures = figures(&metrics).expect("figures");
    // A moment is one of the robot's calendar, and no process of this machine is the robot's.
    let published =
        "lager_topic_last_publish_timestamp_seconds{robot=\"r1\",topic=\"sensor/line\"}";
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let now = now.expect("after 1970").as_secs_f64();
    assert!(
        (now - figures[published]).abs() < 60.0,
        "{}",
        figures[published]
    );
    assert!(!figures.keys().any(|name| name.starts_with("lager_process")));
    drop((viewer, elsewhere, publisher, bus, up));
    domain.assert_clean();
}

/// `lager` with a clock that is so many seconds ahead of the robot's.
fn with_other_clock(domain: &Domain, ahead: i32, args: &[&str]) -> Command {
    let lager = domain.lager(args);
    let ahead = ahead.to_string();
    let mut command = Command::new("unshare");
    command
        .args([
            "--user",
            "--map-root-user",
            "--time",
            "--fork",
            "--kill-child",
        ])
        .args(["--monotonic", &ahead, "--boottime", &ahead])
        .arg(lager.get_program())
        .args(lager.get_args());
    for (name, value) in lager.get_envs() {
        if let Some(value) = value {
            command.env(name, value);
        }
    }
    if let Some(folder) = lager.get_current_dir() {
        command.current_dir(folder);
    }
    command
}

#[test]
#[ignore = "needs the right to a clock of its own; `tests/run` runs it where that can be had"]
fn a_listener_whose_clock_is_another_one_counts_and_times_as_the_robot_does() {
    let domain = Domain::new();
    let endpoint = format!("tcp/{}", free());
    let up = robot(&domain, &endpoint);
    let afar = |ahead: i32, args: &[&str]| {
        let args = [args, &["--remote", &endpoint]].concat();
        let output = with_other_clock(&domain, ahead, &args).output();
        let output = output.expect("`unshare` is there");
        assert!(output.stderr.is_empty(), "{ahead} s: {}", said(&output));
        output
    };
    for ahead in [10, -10] {
        let delays = ["topic", "delay", "sensor/line", "--json", "--duration", "3"];
        for told in lines(&afar(ahead, &delays)) {
            let unsure_ns = told["clock_unsure_ns"].as_u64().expect("a number");
            assert!(unsure_ns > 0, "{told}");
            let read = &told["publish_to_receive"];
            for figure in ["p50_ns", "p99_ns", "max_ns"] {
                // None that the clocks cannot tell, and none of the 10 s.
                if let Some(ns) = read[figure].as_u64() {
                    assert!((unsure_ns..5_000_000_000).contains(&ns), "{told}");
                }
            }
            assert_eq!(told["lost"], 0);
        }
        let echo = ["topic", "echo", "sensor/line", "--json", "--count", "200"];
        let samples = lines(&afar(ahead, &echo));
        assert_eq!(samples.len(), 200);
        for pair in samples.windows(2) {
            let [before, after] = [&pair[0], &pair[1]];
            let next = before["sequence"].as_u64().map(|sequence| sequence + 1);
            assert_eq!(after["sequence"].as_u64(), next);
            assert_eq!(after["lost"], 0);
        }
        let top = one(&afar(
            ahead,
            &["top", "--once", "--json", "--duration", "3"],
        ));
        let rows = top["topics"].as_array().expect("a list").iter();
        let ages: BTreeMap<&str, u64> = rows
            .filter_map(|row| Some((row["topic"].as_str()?, row["age_ns"].as_u64()?)))
            .collect();
        assert!(ages["sensor/line"] < 5_000_000_000, "{ages:?}");

        let file = format!("ahead{ahead}.mcap");
        let record = [
            "bag",
            "record",
            &file,
            "--topic",
            "sensor/line",
            "--remote",
            &endpoint,
        ];
        let mut recording = domain.launch(with_other_clock(&domain, ahead, &record));
        let bag = domain.folder().join(&file);
        let began = Instant::now();
        wait_for("some of it", || {
            (began.elapsed().as_secs() > 3 && is_long(&bag)).then_some(())
        });
        // `unshare` hands nothing on, so the tool itself is asked to end.
        let tools = lager_tests::children(recording.pid());
        tools
            .iter()
            .for_each(|tool| kill_process(pid(*tool), Signal::INT).expect("it lives"));
        assert_eq!(recording.wait(), Some(0), "{}", recording.log());
        domain.done(&["bag", "check", &file]);
        let table = format!("t{ahead}");
        domain.done(&["bag", "export", &file, "--csv", &table]);
        let table = fs::read_to_string(domain.folder().join(table).join("sensor-line.csv"));
        let table = table.expect("a table");
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let now = now.expect("after 1970").as_nanos() as u64;
        for row in table.lines().skip(1) {
            let fields: Vec<u64> = row
                .split(',')
                .take(7)
                .map(|it| it.parse().expect("a number"))
                .collect();
            let (unix_ns, lost) = (fields[0], fields[6]);
            // The robot's own stamp and calendar.
            let offset = lager_home::Clock::unix_offset_ns();
            assert!(unix_ns.abs_diff(fields[5].saturating_add_signed(offset)) < 1_000_000_000);
            assert!(now.abs_diff(unix_ns) < 60_000_000_000 && lost == 0, "{row}");
        }
    }
    drop(up);
    domain.assert_clean();
}

fn is_long(file: &Path) -> bool {
    fs::metadata(file).is_ok_and(|found| found.len() > 10_000)
}

fn one(of: &std::process::Output) -> Value {
    lines(of).remove(0)
}
