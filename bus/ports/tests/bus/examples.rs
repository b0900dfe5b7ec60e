//! Runs the examples as people run them, and reads their topic in a process that was not built with
//! it.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use lager_ports::{Difference, Layout, PortError};
use lager_sample::{Qos, Topic, payload};
use lager_topics::{Role, SensorLine};
use serde_json::json;

use crate::domain::{Domain, frame, until};

payload! {
    /// A payload with the same name as the examples' one, but another layout.
    pub struct Weather: 8 bytes {
        /// The wind has become a floating-point number.
        pub wind: f32,
        /// From where it blows, in degrees.
        pub from: u16,
        /// Fills the gap.
        pub reserved: [u8; 2],
    }
}

struct OtherWeather;

impl Topic for OtherWeather {
    const NAME: &'static str = "weather/now";
    type Payload = Weather;
    const QOS: Qos = Qos::stream(16).waking(&[Role::Guest.part()]);
    const SUMMARY: &'static str = "The weather of another build.";
}

/// A running example, killed when dropped.
struct Example(Child);

impl Example {
    fn start(domain: &Domain, name: &str) -> Self {
        let child = Command::new(built(name))
            .arg(domain.config.folder.as_ref().unwrap())
            .stdout(Stdio::piped())
            .spawn();
        Self(child.unwrap())
    }

    /// The first line with `text` in it.
    fn line(&mut self, text: &str) -> String {
        let lines = BufReader::new(self.0.stdout.as_mut().unwrap()).lines();
        let mut lines = lines.map(Result::unwrap);
        lines.find(|line| line.contains(text)).unwrap()
    }
}

impl Drop for Example {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program of an example. `cargo test` builds it beside its tests unless tests are chosen by
/// name.
fn built(name: &str) -> PathBuf {
    let deps = std::env::current_exe().unwrap();
    let profile = deps.parent().unwrap().parent().unwrap();
    let program = profile.join("examples").join(name);
    if !program.exists() {
        let mut build = Command::new(env!("CARGO"));
        build.args(["build", "--offline", "--examples", "--target-dir"]);
        build.arg(profile.parent().unwrap());
        if profile.ends_with("release") {
            build.arg("--release");
        }
        build.current_dir(env!("CARGO_MANIFEST_DIR"));
        assert!(build.status().unwrap().success());
    }
    program
}

#[test]
fn the_examples_publish_act_observe_and_watch() {
    let domain = Domain::new();
    let mut observer = Example::start(&domain, "observe");
    let mut watcher = Example::start(&domain, "watch");
    let mut actor = Example::start(&domain, "act");
    let publisher = Example::start(&domain, "publish");
    let acted = actor.line("wind 3 mm/s, received after ");
    assert!(acted.ends_with(" ns"), "{acted}");
    let seen = observer.line("wind: 3,");
    assert!(
        seen.starts_with("number 3: Weather { wind: 3, from: 65535"),
        "{seen}"
    );
    assert_eq!(observer.line(" lost"), "0 lost");
    let woken = watcher.line("wind: 3,");
    assert_eq!(woken, seen);
    drop((observer, watcher, actor, publisher));
}

#[test]
fn a_topic_is_read_by_its_description_alone() {
    let domain = Domain::new();
    let bus = domain.open(Role::Observer);
    assert!(bus.found("weather/now").unwrap().is_none());
    let publisher = Example::start(&domain, "publish");
    let mut found = None;
    until("the topic is there", || {
        found = bus.found("weather/now").unwrap();
        found.is_some()
    });
    let mut found = found.unwrap();
    assert_eq!(found.description().name(), "Weather");
    assert_eq!(
        found.description().fields().collect::<Vec<_>>(),
        ["wind", "from"]
    );
    let mut winds = Vec::new();
    until("three samples have come", || {
        while let Some(sample) = found.receive().unwrap() {
            assert_eq!(sample.stamp().writer, publisher.0.id());
            let wind = sample.stamp().sequence;
            let shown = serde_json::to_value(sample.payload()).unwrap();
            assert_eq!(shown, json!({"wind": wind, "from": 65535}));
            winds.push(wind);
        }
        winds.len() >= 3
    });
    assert_eq!(winds[1], winds[0] + 1);

    let topics = bus.topics().unwrap();
    let weather = topics.iter().find(|topic| topic.name == "weather/now");
    let weather = weather.unwrap();
    assert_eq!(weather.layout, Layout::Described);
    assert_eq!((weather.publishers, weather.observers), (1, 1));

    let refused = bus.subscriber::<OtherWeather>().unwrap_err();
    let difference = Difference::Schema;
    let topic = OtherWeather::NAME.to_owned();
    assert_eq!(refused, PortError::OtherLayout { topic, difference });
    drop(publisher);
}

#[test]
fn what_a_slow_reader_of_a_found_topic_missed_is_counted() {
    let domain = Domain::new();
    let bus = domain.open(Role::Observer);
    let writer = domain.open(Role::Bridge);
    // The topic exists before its writer, so the writer knows the reader from its first sample on.
    let _first = writer.subscriber::<SensorLine>().unwrap();
    let mut found = bus.found(SensorLine::NAME).unwrap().unwrap();
    let publisher = writer.publisher::<SensorLine>().unwrap();
    let buffer = SensorLine::QOS.buffer as u32;
    for number in 0..buffer + 7 {
        let mut sample = publisher.loan_uninit().unwrap();
        *sample = frame(number);
        sample.send().unwrap();
    }
    let first = found.receive().unwrap().unwrap();
    assert_eq!(first.stamp().sequence, 7);
    drop(first);
    assert_eq!(found.lost(), 7);
}

#[test]
fn a_loan_that_is_not_blanked_holds_a_payload_all_the_same() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let publisher = bus.publisher::<SensorLine>().unwrap();
    let mut subscriber = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    let mut sample = publisher.loan_uninit().unwrap();
    sample.packet_id = 9;
    let whole = *sample;
    sample.send().unwrap();
    assert_eq!(*subscriber.receive().unwrap().unwrap(), whole);
}
