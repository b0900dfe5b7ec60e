//! Tests of `lager topic` and `lager top` on a user's own topics and beside a robot: what they
//! measure, what they may publish, and that they show at once a topic that loses samples.

mod bench;
mod screen;

use std::io::Write;
use std::process::{Output, Stdio};
use std::time::Duration;

use lager_ports::{Bus, Cause, Publisher, Subscriber};
use lager_sample::{Qos, Stamp, Topic, payload};
use lager_tests::{Domain, Running, wait_for};
use lager_topics::{MissionQueue, NavStatus, Phase, Role};
use rustix::process::Signal;
use serde_json::Value;

payload! {
    /// The measurements of a weather station.
    pub struct Weather: 8 bytes {
        /// Wind in mm/s.
        pub wind: u32,
        /// The direction from which the wind blows, in degrees; 65535 = not known.
        pub from: u16 = u16::MAX,
        /// Fills the gap.
        pub reserved: [u8; 2],
    }
}

/// A topic that the robot's table does not have.
#[derive(Clone, Copy, Debug)]
struct WeatherNow;

impl Topic for WeatherNow {
    const NAME: &'static str = "weather/now";
    type Payload = Weather;
    const QOS: Qos = Qos::stream(64).waking(&[Role::Guest.part()]);
    const SUMMARY: &'static str = "The weather.";
}

fn said(output: &Output) -> String {
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    text(&output.stdout) + &text(&output.stderr)
}

fn guest(domain: &Domain) -> Bus {
    Bus::open(&domain.bus("r1", 1.0), Role::Guest).expect("the bus opens")
}

/// Receives this number of samples.
fn hear(from: &mut Subscriber<WeatherNow>, samples: usize) -> Vec<(Weather, Stamp)> {
    let mut heard = Vec::new();
    wait_for("the samples", || {
        while let Some(sample) = from.receive().expect("readable") {
            heard.push((*sample, *sample.stamp()));
        }
        (heard.len() >= samples).then_some(())
    });
    heard
}

/// A robot that drives.
fn up(domain: &Domain) -> Running {
    let up = domain.start(&["up", "--headless", "--mission", "1", "--no-station"]);
    let observer = domain.observe("r1", 1.0);
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    wait_for("the robot to drive", || {
        let status = status.latest().expect("readable")?;
        (status.phase.get() == Some(Phase::Driving)).then_some(())
    });
    up
}

#[test]
fn what_a_person_writes_is_published_on_a_topic_of_his_own() {
    let domain = Domain::new();
    let nobody = domain.run(&["topic", "pub", "weather/now", "{}"]);
    assert_eq!(nobody.status.code(), Some(1), "{}", said(&nobody));
    assert!(
        said(&nobody).contains("nobody has a topic"),
        "{}",
        said(&nobody)
    );

    let bus = guest(&domain);
    let mut weather = bus.subscriber::<WeatherNow>().expect("a topic");
    let thrice = [
        "topic",
        "pub",
        "weather/now",
        r#"{"wind": 3200}"#,
        "--rate",
        "50",
    ];
    // A subscriber finds its publisher only when it looks, so it looks while the tool runs.
    let mut tool = domain.start(&[&thrice[..], &["--count", "3"]].concat());
    let heard = hear(&mut weather, 3);
    assert_eq!(tool.wait(), Some(0), "{}", tool.log());
    let told = tool.output();
    assert!(
        told.contains("3 samples published on weather/now"),
        "{told}"
    );
    for (number, (weather, stamp)) in heard.iter().enumerate() {
        // The tool knows no default values of a topic outside the table.
        assert_eq!((weather.wind, weather.from), (3_200, 0));
        assert_eq!(stamp.sequence, number as u64);
    }
    let span = heard[2].1.publish_time_ns - heard[0].1.publish_time_ns;
    assert!(span > 30_000_000, "three at 50 Hz in {span} ns");

    // It publishes each value of standard input; the first one that does not fit ends it.
    let mut tool = domain
        .lager(&["topic", "pub", "weather/now", "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("lager starts");
    let mut input = tool.stdin.take().expect("its input");
    write!(
        input,
        "{{\"wind\": 1}} {{\"wind\": 2}}\n{{\"wind\": 3, \"from\": 90}}"
    )
    .expect("a pipe");
    drop(input);
    let winds: Vec<u32> = hear(&mut weather, 3).iter().map(|(w, _)| w.wind).collect();
    let output = tool.wait_with_output().expect("a child");
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("\"samples\":3"), "{}", said(&output));
    assert_eq!(winds, [1, 2, 3]);

    for (payload, sentence) in [
        (
            r#"{"wnd": 1}"#,
            "`Weather` has no field `wnd`; its fields are wind, from",
        ),
        (
            r#"{"from": 70000}"#,
            "a whole number from 0 to 65535 in `from`",
        ),
        ("{wind", "the payload is no JSON"),
    ] {
        let wrong = domain.run(&["topic", "pub", "weather/now", payload]);
        assert_eq!(wrong.status.code(), Some(2), "{payload}: {}", said(&wrong));
        assert!(
            said(&wrong).contains(sentence),
            "{payload}: {}",
            said(&wrong)
        );
    }

    // It publishes beside another writer only with a flag.
    let other = bus.publisher::<WeatherNow>().expect("a topic");
    let refused = domain.run(&["topic", "pub", "weather/now", "{}"]);
    assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
    assert!(
        said(&refused).contains("is written by guest"),
        "{}",
        said(&refused)
    );
    let meant = domain.run(&["topic", "pub", "weather/now", "{}", "--live"]);
    assert!(meant.status.success(), "{}", said(&meant));
    drop((other, weather, bus));
    domain.assert_clean();
}

#[test]
fn what_moves_a_robot_is_published_beside_it_only_if_that_is_meant() {
    let domain = Domain::new();
    let order = [
        "topic",
        "pub",
        "mission/order",
        r#"{"id": 4711, "product": 2}"#,
    ];
    let mut up = up(&domain);
    let refused = domain.run(&order);
    let told = said(&refused);
    assert_eq!(refused.status.code(), Some(4), "{told}");
    assert!(
        told.contains("logic would act on it") && told.contains("--live"),
        "{told}"
    );
    // It never publishes on a topic that one service alone writes.
    for topic in ["sensor/line", "nav/status", "link/health"] {
        let refused = domain.run(&["topic", "pub", topic, "{}", "--live"]);
        let told = said(&refused);
        assert_eq!(refused.status.code(), Some(4), "{topic}: {told}");
        assert!(
            told.contains("one service alone writes it"),
            "{topic}: {told}"
        );
    }
    let observer = domain.observe("r1", 1.0);
    let mut queue = observer.subscriber::<MissionQueue>().expect("a topic");
    let meant = domain.run(&[&order[..], &["--live"]].concat());
    assert!(meant.status.success(), "{}", said(&meant));
    wait_for("the order to wait", || {
        let queue = queue.latest().expect("readable")?;
        queue
            .orders()
            .iter()
            .any(|order| order.id == 4_711)
            .then_some(())
    });
    up.signal(Signal::INT);
    up.wait();
    drop((queue, observer));
    // Without a robot it publishes, and no robot can start meanwhile.
    let mut tool = domain.start(&[&order[..], &["--rate", "100"]].concat());
    wait_for("the tool to have the name", || {
        let lock = domain.bus_folder().join("r1/bridge.lock");
        std::fs::exists(lock).ok()?.then_some(())
    });
    let bridge = domain.run(&["bridge"]);
    assert_eq!(bridge.status.code(), Some(4), "{}", said(&bridge));
    // Whoever wants to work on that robot's boards hears who is in its place, and stops nobody.
    let boards = domain.run(&["board", "reset", "sensor", "--port", "/dev/null"]);
    let told = said(&boards);
    assert_eq!(boards.status.code(), Some(4), "{told}");
    let names = format!("process {} ", tool.pid());
    assert!(
        told.contains(&names) && told.contains("topic pub mission/order"),
        "{told}"
    );
    assert!(tool.is_running());
    tool.signal(Signal::INT);
    tool.wait();
}

#[test]
fn rates_delays_bytes_and_fields_are_shown_for_as_long_as_is_asked() {
    let domain = Domain::new();
    let _up = up(&domain);
    let json = |words: &[&str]| -> Vec<Value> {
        let output = domain.run(&[&["topic", "--json"], words].concat());
        assert!(output.status.success(), "{words:?}: {}", said(&output));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let values = text
            .lines()
            .map(|line| serde_json::from_str(line).expect("JSON"));
        values.collect()
    };
    // In every tool, `--count` counts samples.
    for tool in ["hz", "bw", "delay"] {
        let windows = json(&[tool, "sensor/line", "--count", "30"]);
        let samples: u64 = windows.iter().filter_map(|w| w["samples"].as_u64()).sum();
        assert_eq!(samples, 30, "{tool}: {windows:?}");
    }
    let echoed = json(&["echo", "sensor/line", "--count", "30"]);
    assert_eq!(echoed.len(), 30);
    // What each of the eleven sensors sees is told unasked.
    for sample in &echoed {
        let bits = sample["payload"]["bits"].as_u64();
        assert!(bits.is_some_and(|bits| bits < 1 << 11), "{sample}");
    }
    let began = std::time::Instant::now();
    let windows = json(&["hz", "sensor/line", "--duration", "1.5"]);
    assert_eq!(windows.len(), 2, "{windows:?}");
    assert!(began.elapsed() >= Duration::from_millis(1_500));

    let delay = &json(&["delay", "sensor/line", "--count", "50"])[0];
    for stage in ["source_to_publish", "publish_to_receive", "own_wait"] {
        let [p50, p99, max] = ["p50_ns", "p99_ns", "max_ns"].map(|at| delay[stage][at].as_u64());
        assert!(
            p50 <= p99 && p99 <= max && max > Some(0),
            "{stage}: {delay}"
        );
    }
    // Logic counts all of its frames, and tells the tail once a second.
    let windows = json(&["delay", "sensor/line", "--duration", "3"]);
    let mut told = windows.iter().rev().map(|window| &window["actor"]);
    let told = told.find(|actor| !actor.is_null()).expect("logic tells");
    let decided = &told["read_to_decided"];
    assert_eq!(told["role"], "logic");
    assert!(decided["samples"].as_u64() > Some(50), "{told}");
    assert!(
        decided["p99_ns"].is_null() || decided["p99_ns"].as_u64() <= decided["max_ns"].as_u64()
    );
    let shown = domain.run(&["topic", "delay", "steering/command", "--duration", "2"]);
    let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(
        shown.contains("bridge itself, which the bus wakes"),
        "{shown}"
    );
    assert!(shown.contains("read -> written"), "{shown}");
    let bw = &json(&["bw", "sensor/line", "--count", "50"])[0];
    let per_sample = bw["payload_bytes"].as_u64().zip(bw["stamp_bytes"].as_u64());
    assert_eq!(per_sample, Some((8, 56)), "{bw}");

    let fields = ["--field", "sensor.up", "--field", "mode", "--count", "1"];
    let words = [&["topic", "echo", "link/health"], &fields[..]].concat();
    let shown = domain.run(&words);
    assert_eq!(String::from_utf8_lossy(&shown.stdout), "1\tAutonomous\n");
    let wrong = domain.run(&["topic", "echo", "link/health", "--field", "sensor.upp"]);
    assert_eq!(wrong.status.code(), Some(2), "{}", said(&wrong));
    assert!(
        said(&wrong).contains("`sensor` has epoch, packets"),
        "{}",
        said(&wrong)
    );
}

/// Publishes weather, and leaves out one number in ten.
fn send_with_gaps(publisher: &Publisher<WeatherNow>, number: &mut u64) {
    let next = Stamp {
        sequence: *number + *number / 9,
        publish_time_ns: lager_home::Clock::monotonic_ns(),
        source_time_ns: lager_home::Clock::monotonic_ns(),
        epoch: publisher.epoch(),
        writer: std::process::id(),
        ..Stamp::default()
    };
    publisher
        .replay(Weather::default(), next)
        .expect("a sample");
    *number += 1;
}

#[test]
fn a_topic_that_loses_samples_stands_first_and_closed_ones_are_not_read() {
    let domain = Domain::new();
    let mut up = up(&domain);
    let bus = guest(&domain);
    let weather = bus.publisher::<WeatherNow>().expect("a topic");
    let steady = bus
        .publisher::<lager_topics::LogThought>()
        .expect("a topic");
    let mut number = 0;
    let mut sending = |tool: &mut std::process::Child| {
        wait_for("the picture", || {
            send_with_gaps(&weather, &mut number);
            steady
                .send(Cause::OWN, lager_topics::Thought::default())
                .expect("a sample");
            std::thread::sleep(Duration::from_millis(5));
            tool.try_wait().expect("a child")
        });
    };
    let mut top = |words: &[&str]| -> String {
        let mut tool = domain
            .lager(&[&["top", "--once", "--duration", "3"], words].concat())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("lager starts");
        sending(&mut tool);
        let output = tool.wait_with_output().expect("a child");
        assert!(output.status.success(), "{}", said(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let picture = top(&[]);
    let mut rows = picture.lines().skip_while(|line| !line.contains("TOPIC "));
    let first = rows.nth(1).expect("a row");
    assert!(first.starts_with("!weather/now"), "{picture}");
    assert!(picture.contains("IN TROUBLE"), "{picture}");
    assert!(picture.contains("autonomous"), "{picture}");

    let value: Value = serde_json::from_str(&top(&["--json"])).expect("JSON");
    let topics = value["topics"].as_array().expect("topics");
    assert_eq!(topics[0]["topic"], "weather/now", "{value}");
    assert_eq!(topics[0]["trouble"], "losing", "{value}");
    let lost = topics[0]["lost"].as_u64().expect("a count");
    let samples = topics[0]["samples"].as_u64().expect("a count");
    assert!(
        lost.abs_diff(samples / 9) <= 1,
        "{lost} lost beside {samples}"
    );
    let line = topics.iter().find(|topic| topic["topic"] == "sensor/line");
    let line = line.expect("the topic");
    assert_eq!(
        (&line["lost"], &line["expected_hz"]),
        (&0.into(), &100.0.into())
    );
    assert_eq!(line["writers"][0]["role"], "bridge", "{line}");
    assert_eq!(value["sensor"]["up"], true, "{value}");

    // Samples that do not pass the filter are neither shown nor decoded.
    let value: Value =
        serde_json::from_str(&top(&["--json", "--filter", "weather"])).expect("JSON");
    assert_eq!(value["topics"].as_array().map(Vec::len), Some(1), "{value}");
    drop((weather, steady, bus));
    up.signal(Signal::INT);
    up.wait();
}

#[test]
fn the_same_table_stands_over_a_recording() {
    let domain = Domain::new();
    let recorder = domain.start(&["bag", "record", "tour.mcap", "--wait", "--json"]);
    wait_for("the recorder to listen", || {
        (!recorder.output().is_empty()).then_some(())
    });
    let mut up = up(&domain);
    std::thread::sleep(Duration::from_secs(2));
    up.signal(Signal::INT);
    up.wait();
    let mut recorder = recorder;
    recorder.signal(Signal::INT);
    assert_eq!(recorder.wait(), Some(0), "{}", recorder.log());
    let top = ["top", "--bag", "tour.mcap", "--once"];
    let picture = said(&domain.run(&top));
    assert!(
        picture.contains("lager top  r1") && picture.contains("of tour.mcap"),
        "{picture}"
    );
    let value = domain.run(&[&top[..], &["--json"]].concat());
    let value: Value = serde_json::from_str(&said(&value)).expect("JSON");
    let topics = value["topics"].as_array().expect("topics");
    let line = topics.iter().find(|topic| topic["topic"] == "sensor/line");
    let samples = line.expect("the topic")["samples"]
        .as_u64()
        .expect("a count");
    let info = said(&domain.run(&["bag", "info", "tour.mcap", "--json"]));
    let info: Value = serde_json::from_str(&info).expect("JSON");
    let kept = info["topics"].as_array().expect("topics").iter();
    let messages = kept.clone().find(|topic| topic["topic"] == "sensor/line");
    assert_eq!(messages.expect("it")["messages"].as_u64(), Some(samples));
    let piped = domain.run(&["top"]);
    assert_eq!(piped.status.code(), Some(2), "{}", said(&piped));
}
