//! Tests of recordings as people make them: of a mission, of a topic of one's own, cut short by
//! `kill -9` and by a full disk, played under another robot's name, and verified.

mod hard;
mod outside;
mod play;
mod verify;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Output;
use std::time::Duration;

use lager_journal::{Content, Damage, Envelope, Learnt, Message, Visit, Walk};
use lager_ports::{Bus, Cause, Publisher};
use lager_sample::{Qos, Stamp, Topic, payload};
use lager_tests::{Domain, Running, wait_for};
use lager_topics::{MissionEvent, NavStatus, Role, SensorLine, SteeringCommand};
use rustix::process::Signal;
use serde_json::Value;

payload! {
    /// The samples of a user's own program: random numbers, which compress badly.
    pub struct Noise: 1032 bytes {
        /// Counts from 0.
        pub number: u64,
        /// Random words.
        pub words: [[u64; 32]; 4],
    }
}

/// A topic that the robot's table does not have.
#[derive(Clone, Copy, Debug)]
struct NoiseNow;

impl Topic for NoiseNow {
    const NAME: &'static str = "noise/now";
    type Payload = Noise;
    const QOS: Qos = Qos::stream(256);
    const SUMMARY: &'static str = "Noise.";
}

/// A program that publishes noise as robot `r1`.
struct Noisy {
    publisher: Publisher<NoiseNow>,
    dice: u64,
    sent: u64,
}

impl Noisy {
    fn new(bus: &Bus) -> Self {
        let publisher = bus.publisher().expect("a topic");
        let (dice, sent) = (0x5EED, 0);
        Self {
            publisher,
            dice,
            sent,
        }
    }

    fn send(&mut self) {
        let mut noise = Noise {
            number: self.sent,
            ..Noise::default()
        };
        for word in noise.words.as_flattened_mut() {
            self.dice ^= self.dice << 13;
            self.dice ^= self.dice >> 7;
            self.dice ^= self.dice << 17;
            *word = self.dice;
        }
        self.publisher.send(Cause::OWN, noise).expect("a sample");
        self.sent += 1;
    }

    /// Publishes until a reader has found it. Nobody receives the samples before that.
    fn meet(&mut self, recorder: &Running) {
        wait_for("the recorder to hear", || {
            self.send();
            let said = recorder.output();
            let last = said.lines().last()?;
            let progress: Value = serde_json::from_str(last).ok()?;
            let topics = progress["topics"].as_array()?;
            (topics.first()?["received"].as_u64()? > 0).then_some(())
        });
    }
}

fn guest(domain: &Domain) -> Bus {
    Bus::open(&domain.bus("r1", 1.0), Role::Guest).expect("the bus opens")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn said(output: &Output) -> String {
    text(&output.stdout) + &text(&output.stderr)
}

/// Runs `lager` with `args`, which must succeed; returns its output.
fn done(domain: &Domain, args: &[&str]) -> String {
    let output = domain.run(args);
    assert!(output.status.success(), "{args:?}: {}", said(&output));
    said(&output)
}

/// Reads all of a file, which must be complete and correct; returns the tool's output.
fn must_be_right(domain: &Domain, file: &str) -> String {
    let checked = done(domain, &["bag", "check", file]);
    assert!(checked.contains("every number is right"), "{checked}");
    checked
}

/// What `lager bag info` says of a file.
fn info(domain: &Domain, file: &str) -> Value {
    let told = done(domain, &["bag", "--json", "info", file]);
    serde_json::from_str(&told).expect("JSON")
}

/// Asserts that everything that killed processes left on the bus is removed.
fn must_be_swept(domain: &Domain) {
    wait_for("the killed processes' files to be removed", || {
        let _ = domain.run(&["doctor", "--fix"]);
        domain.leftovers().is_empty().then_some(())
    });
}

/// The content of a file, complete or not: each message with its topic.
#[derive(Default)]
struct Seen {
    messages: Vec<(String, Stamp, u64, Value)>,
    damaged: usize,
}

impl Visit for Seen {
    fn message(&mut self, message: &Message<'_>) {
        // Views for viewers are no samples, and a repeated message is in an earlier file.
        if message.topic.content != Content::Samples {
            return;
        }
        let envelope: Envelope<Value> = serde_json::from_slice(message.data).expect("a message");
        let missing = envelope.lost + envelope.dropped;
        let topic = message.topic.name.clone();
        self.messages
            .push((topic, envelope.stamp, missing, envelope.payload));
    }

    fn note(&mut self, _name: &str, _texts: &BTreeMap<String, String>) {}

    fn damage(&mut self, _damage: Damage) {
        self.damaged += 1;
    }
}

fn read(file: &Path) -> Seen {
    let mut seen = Seen::default();
    let mut walk = Walk::knowing(Learnt::default());
    walk.feed(&fs::read(file).expect("a readable file"), &mut seen);
    walk.finish(&mut seen);
    seen
}

fn noise_numbers(file: &Path) -> Vec<u64> {
    let messages = read(file).messages.into_iter();
    messages
        .map(|(.., payload)| payload["number"].as_u64().expect("a number"))
        .collect()
}

/// Ends a recorder by a signal, as Ctrl-C or systemd does, and returns its last line.
fn end(mut recorder: Running) -> Value {
    recorder.signal(Signal::TERM);
    assert_eq!(recorder.wait(), Some(0), "{}", recorder.log());
    let output = recorder.output();
    serde_json::from_str(output.lines().last().expect("a line")).expect("JSON")
}

/// A recorder that already receives.
fn recorder(domain: &Domain, args: &[&str]) -> Running {
    let recorder = domain.start(&[&["bag", "record", "--wait", "--json"], args].concat());
    wait_for("the recorder to listen", || {
        (!recorder.output().is_empty()).then_some(())
    });
    recorder
}

#[test]
fn a_bag_of_a_mission_has_what_the_bus_has_numbered() {
    let domain = Domain::new();
    let observer = domain.observe("r1", 1.0);
    let mut line = observer.subscriber::<SensorLine>().expect("a topic");
    let mut command = observer.subscriber::<SteeringCommand>().expect("a topic");
    let mut event = observer.subscriber::<MissionEvent>().expect("a topic");
    let mut status = observer.subscriber::<NavStatus>().expect("a topic");
    let recorder = recorder(&domain, &["tour.mcap"]);
    let mut up = domain.start(&[
        "up",
        "--headless",
        "--mission",
        "1",
        "--speed",
        "5",
        "--exit-when-done",
        "--no-station",
    ]);
    // When a publisher has ended, its last sample stays for a subscriber that had found it.
    let mut last: BTreeMap<&str, Stamp> = BTreeMap::new();
    wait_for("the delivery", || {
        let is_over = !up.is_running();
        macro_rules! drain {
            ($($topic:ident),*) => { $(
                while let Some(sample) = $topic.receive().expect("readable") {
                    last.insert(stringify!($topic), *sample.stamp());
                }
            )* };
        }
        drain!(line, command, event, status);
        is_over.then_some(())
    });
    assert_eq!(up.wait(), Some(0), "{}", up.log());
    let told = end(recorder);
    must_be_right(&domain, "tour.mcap");

    let seen = read(&domain.folder().join("tour.mcap"));
    assert_eq!(seen.damaged, 0);
    for (name, key) in [
        (SensorLine::NAME, "line"),
        (SteeringCommand::NAME, "command"),
        (MissionEvent::NAME, "event"),
        (NavStatus::NAME, "status"),
    ] {
        let stamp = last[key];
        let of_topic: Vec<_> = seen
            .messages
            .iter()
            .filter(|(topic, ..)| topic == name)
            .collect();
        // The recorder was there before the writers, so it can count every number.
        let of_stream: Vec<_> = of_topic
            .iter()
            .filter(|(_, of, ..)| (of.writer, of.epoch) == (stamp.writer, stamp.epoch))
            .collect();
        let (.., missing, _) = of_topic.last().expect("samples");
        let numbered = of_stream.len() as u64 + missing;
        assert_eq!(numbered, stamp.sequence + 1, "{name}");
        let is_told = |topic: &&Value| topic["topic"] == name;
        let topics = told["topics"].as_array().expect("topics");
        let count = topics.iter().find(is_told).expect("the topic");
        assert_eq!(
            count["received"].as_u64(),
            Some(of_topic.len() as u64),
            "{name}"
        );
        assert_eq!(count["lost"].as_u64(), Some(*missing), "{name}");
    }
    let (.., missing, _) = seen
        .messages
        .iter()
        .rfind(|(topic, ..)| topic == SensorLine::NAME)
        .expect("a line");
    assert_eq!(
        *missing, 0,
        "a stream of 800 samples a second is heard as a whole"
    );

    let info = done(&domain, &["bag", "info", "tour.mcap"]);
    let is_line = |row: &str| {
        row.split_whitespace()
            .take(2)
            .eq(["sensor/line", "LineFrame"])
    };
    assert!(info.lines().any(is_line), "{info}");
    let tables = done(&domain, &["bag", "export", "tour.mcap", "--csv", "tables"]);
    assert!(tables.contains("tables/sensor-line.csv"), "{tables}");
    let table = fs::read_to_string(domain.folder().join("tables/mission-event.csv")).expect("it");
    assert!(table.starts_with("unix_ns,sequence,writer,"), "{table}");
    let events = seen
        .messages
        .iter()
        .filter(|(topic, ..)| topic == MissionEvent::NAME);
    let events = events.count();
    assert_eq!(table.lines().count(), events + 1);
    let export = ["bag", "export", "tour.mcap", "--json", "--csv", "tables"];
    let told = done(
        &domain,
        &[&export[..], &["--topic", MissionEvent::NAME]].concat(),
    );
    let told: Value = serde_json::from_str(&told).expect("one line of JSON");
    assert_eq!(
        (&told["topic"], &told["rows"]),
        (&MissionEvent::NAME.into(), &events.into())
    );
    drop((line, command, event, status, observer));
    domain.assert_clean();
}

#[test]
fn what_a_killed_recorder_had_flushed_is_recovered() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    let mut recorder = recorder(&domain, &["--topic", "noise/now", "noise.mcap"]);
    noisy.meet(&recorder);
    let file = domain.folder().join("noise.mcap");
    for _ in 0..20 {
        (0..40).for_each(|_| noisy.send());
        // Nobody ends the recorder: it writes its samples to the disk by itself.
        wait_for("the samples to be on the disk", || {
            (noise_numbers(&file).last() == Some(&(noisy.sent - 1))).then_some(())
        });
    }
    let flushed = noise_numbers(&file);
    (0..40).for_each(|_| noisy.send());
    recorder.signal(Signal::KILL);
    recorder.wait();

    let check = domain.run(&["bag", "check", "noise.mcap"]);
    assert_eq!(check.status.code(), Some(1));
    assert!(said(&check).contains("it was cut off"), "{}", said(&check));
    let info = domain.run(&["bag", "info", "noise.mcap"]);
    assert_eq!(info.status.code(), Some(1));
    assert!(
        said(&info).contains("`lager bag recover`"),
        "{}",
        said(&info)
    );
    let told = done(&domain, &["bag", "recover", "noise.mcap"]);
    assert!(told.contains("were read again"), "{told}");
    let other = ["--json", "--output", "other.mcap"];
    let told = done(
        &domain,
        &[&["bag", "recover", "noise.mcap"], &other[..]].concat(),
    );
    let told: Value = serde_json::from_str(&told).expect("one line of JSON");
    assert_eq!(
        (&told["copy"], &told["whole"]),
        (&"other.mcap".into(), &false.into())
    );
    assert!(
        told["faults"][0]
            .as_str()
            .is_some_and(|fault| fault.contains("cut off")),
        "{told}"
    );
    must_be_right(&domain, "noise.recovered.mcap");
    let recovered = noise_numbers(&domain.folder().join("noise.recovered.mcap"));
    assert!(recovered.starts_with(&flushed));
    assert!(*recovered.last().expect("samples") < noisy.sent);
    // The samples before the recorder found this writer do not count as missing.
    assert!(recovered.windows(2).all(|pair| pair[0] + 1 == pair[1]));
    let schema = done(&domain, &["bag", "info", "noise.recovered.mcap"]);
    assert!(schema.contains("noise/now  Noise"), "{schema}");

    // The tool overwrites no existing file, and a complete file needs no copy.
    let again = domain.run(&["bag", "recover", "noise.mcap"]);
    assert_eq!(again.status.code(), Some(1), "{}", said(&again));
    let whole = done(&domain, &["bag", "recover", "noise.recovered.mcap"]);
    assert!(whole.contains("is whole"), "{whole}");
    drop((noisy, bus));
    must_be_swept(&domain);
}

#[test]
fn bad_input_is_told_with_what_to_do() {
    let domain = Domain::new();
    fs::write(domain.folder().join("text.mcap"), "no recording at all").expect("a file");
    for (args, code, told) in [
        (&["bag", "info", "none.mcap"][..], 1, "No such file"),
        (&["bag", "info", "text.mcap"], 1, "not an MCAP file"),
        (&["bag", "check", "text.mcap"], 1, "not an MCAP file"),
        (
            &["bag", "recover", "text.mcap"],
            1,
            "nothing can be recovered",
        ),
        (&["bag", "play", "text.mcap"], 1, "not an MCAP file"),
        (
            &["bag", "export", "text.mcap", "--csv", "x"],
            1,
            "not an MCAP file",
        ),
        (&["bag", "info", "."], 1, "directory"),
        (&["bag", "record", "x.mcap"], 1, "no robot `r1` is up"),
        (
            &["bag", "record", "--wait", "text.mcap"],
            1,
            "is there already",
        ),
        (
            &["bag", "record", "--wait", "no/x.mcap"],
            1,
            "cannot make no/x.mcap",
        ),
        (
            &["bag", "record", "--wait", "--topic", "sensor/lime"],
            2,
            "sensor/line",
        ),
        (
            &["bag", "play", "x.mcap", "--from", "3", "--to", "2"],
            2,
            "later than --from",
        ),
    ] {
        let output = domain.run(args);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert!(said.contains(told), "{args:?}: {said}");
    }
    domain.assert_clean();
}

#[test]
fn a_recording_is_split_without_a_loss_and_each_file_is_whole() {
    for split in ["--split-size=1", "--split-time=0.5"] {
        let domain = Domain::new();
        let bus = guest(&domain);
        let mut noisy = Noisy::new(&bus);
        let recorder = recorder(&domain, &["--topic", "noise/now", split, "noise.mcap"]);
        noisy.meet(&recorder);
        let third = domain.folder().join("noise-002.mcap");
        wait_for("three files", || {
            (0..4).for_each(|_| noisy.send());
            std::thread::sleep(Duration::from_millis(2));
            third.is_file().then_some(())
        });
        let told = end(recorder);
        let count = &told["topics"][0];
        let mut numbers = Vec::new();
        let files = told["files"].as_array().expect("files");
        for (part, path) in files.iter().enumerate() {
            let path = path.as_str().expect("a path");
            must_be_right(&domain, path);
            let info = info(&domain, path);
            assert_eq!(info["part"].as_u64(), Some(part as u64), "{info}");
            assert_eq!(info["topics"][0]["type"], "Noise", "{info}");
            // Each file but the last has at least the chosen duration, as exactly as chunks end: a
            // chunk takes 150 ms.
            let is_short = part + 1 == files.len() || split.contains("size");
            assert!(is_short || info["seconds"].as_f64() > Some(0.2), "{info}");
            numbers.extend(noise_numbers(&domain.folder().join(path)));
        }
        let [received, lost, dropped] =
            ["received", "lost", "dropped"].map(|of| count[of].as_u64());
        assert_eq!(received, Some(numbers.len() as u64));
        if (lost, dropped) == (Some(0), Some(0)) {
            assert!(numbers.windows(2).all(|pair| pair[0] + 1 == pair[1]));
        }
        drop((noisy, bus));
        domain.assert_clean();
    }
}
