//! Recordings as people make them: of a mission, of somebody's own topic, cut short by `kill -9`
//! and by a full disk, played onto another robot's name, and proved.

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
use lager_tests::{Domain, Running, wait_for};
use lager_topics::{
    MissionEvent, NavStatus, Qos, Role, SensorLine, Stamp, SteeringCommand, Topic, payload,
};
use rustix::process::Signal;
use serde_json::Value;

payload! {
    /// What somebody's own program sends; numbers that no packing makes much smaller.
    pub struct Noise: 1032 bytes {
        /// Counts from 0.
        pub number: u64,
        /// Random.
        pub words: [[u64; 32]; 4],
    }
}

/// A topic that is in no table.
#[derive(Clone, Copy, Debug)]
struct NoiseNow;

impl Topic for NoiseNow {
    const NAME: &'static str = "noise/now";
    type Payload = Noise;
    const QOS: Qos = Qos::stream(256);
    const SUMMARY: &'static str = "Noise.";
}

/// Somebody who sends noise as robot `r1`.
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

    /// Sends until a reader has found it. The samples before that are nobody's.
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

/// `lager` with `args`, which must succeed; what it said.
fn done(domain: &Domain, args: &[&str]) -> String {
    let output = domain.run(args);
    assert!(output.status.success(), "{args:?}: {}", said(&output));
    said(&output)
}

/// Reads all of a file, which must be as its recorder meant it; what it said.
fn must_be_right(domain: &Domain, file: &str) -> String {
    let checked = done(domain, &["bag", "check", file]);
    assert!(checked.contains("every number is right"), "{checked}");
    checked
}

/// What a file says of itself.
fn info(domain: &Domain, file: &str) -> Value {
    let told = done(domain, &["bag", "--json", "info", file]);
    serde_json::from_str(&told).expect("JSON")
}

/// What killed ones left on the bus is removed.
fn must_be_swept(domain: &Domain) {
    wait_for("the killed to be swept", || {
        let _ = domain.run(&["doctor", "--fix"]);
        domain.leftovers().is_empty().then_some(())
    });
}

/// What a file has: each message with its topic, whether or not the file has an end.
#[derive(Default)]
struct Seen {
    messages: Vec<(String, Stamp, u64, Value)>,
    damaged: usize,
}

impl Visit for Seen {
    fn message(&mut self, message: &Message<'_>) {
        // What viewers look at is no sample, and what is repeated stands in an earlier file.
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

/// Ends a recorder as Ctrl-C or systemd does, and returns its last line.
fn end(mut recorder: Running) -> Value {
    recorder.signal(Signal::TERM);
    assert_eq!(recorder.wait(), Some(0), "{}", recorder.log());
    let output = recorder.output();
    serde_json::from_str(output.lines().last().expect("a line")).expect("JSON")
}

/// A recorder that listens.
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
    // The last sample of a stream stays with a reader that has met its writer.
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
        // The recorder was there before the writers, so it knows of every number.
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
        // Nobody ends the recorder: it puts on the disk by itself what it has.
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
    // The samples before the recorder had found this writer are not counted as missing.
    assert!(recovered.windows(2).all(|pair| pair[0] + 1 == pair[1]));
    let schema = done(&domain, &["bag", "info", "noise.recovered.mcap"]);
    assert!(schema.contains("noise/now  Noise"), "{schema}");

    // It does not write over what is there, and a whole file needs no copy.
    let again = domain.run(&["bag", "recover", "noise.mcap"]);
    assert_eq!(again.status.code(), Some(1), "{}", said(&again));
    let whole = done(&domain, &["bag", "recover", "noise.recovered.mcap"]);
    assert!(whole.contains("is whole"), "{whole}");
    drop((noisy, bus));
    must_be_swept(&domain);
}

#[test]
fn a_full_disk_ends_the_recording_with_a_whole_file() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    let mut recorder = hard::record_on_a_small_disk(&domain, 2_048, &["--topic", "noise/now"]);
    wait_for("the disk to be full", || {
        (0..4).for_each(|_| noisy.send());
        recorder.try_wait().expect("a child")
    });
    hard::must_have_filled_its_disk(&domain, recorder);
    let numbers = noise_numbers(&domain.folder().join("full.mcap"));
    // The noise alone takes more than a kilobyte in each message.
    assert!(numbers.len() > 200, "{}", numbers.len());
    let file = fs::metadata(domain.folder().join("full.mcap")).expect("a file");
    assert!(file.len() <= 2 << 20);
    drop((noisy, bus));
    domain.assert_clean();
}

#[test]
fn a_recording_is_split_without_a_loss_and_each_file_is_whole() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    let args = ["--topic", "noise/now", "--split-size", "1", "noise.mcap"];
    let recorder = recorder(&domain, &args);
    noisy.meet(&recorder);
    wait_for("three files", || {
        (0..4).for_each(|_| noisy.send());
        std::thread::sleep(Duration::from_millis(2));
        fs::exists(domain.folder().join("noise-002.mcap"))
            .expect("a folder")
            .then_some(())
    });
    let told = end(recorder);
    let count = &told["topics"][0];
    assert_eq!(
        (count["lost"].as_u64(), count["dropped"].as_u64()),
        (Some(0), Some(0))
    );
    let mut numbers = Vec::new();
    for file in told["files"].as_array().expect("files") {
        let file = file.as_str().expect("a name");
        must_be_right(&domain, file);
        numbers.append(&mut noise_numbers(&domain.folder().join(file)));
    }
    assert_eq!(count["received"].as_u64(), Some(numbers.len() as u64));
    assert!(numbers.windows(2).all(|pair| pair[0] + 1 == pair[1]));
    drop((noisy, bus));
    domain.assert_clean();
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
fn a_recording_is_split_by_time_into_files_that_are_whole() {
    let domain = Domain::new();
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    let args = ["--topic", "noise/now", "--split-time", "0.5", "noise.mcap"];
    let recorder = recorder(&domain, &args);
    noisy.meet(&recorder);
    wait_for("the third file", || {
        noisy.send();
        let third = domain.folder().join("noise-002.mcap");
        third.is_file().then_some(())
    });
    let told = end(recorder);
    let files = told["files"].as_array().expect("files");
    assert!(files.len() >= 3, "{told}");
    let mut numbers = Vec::new();
    for (part, path) in files.iter().enumerate() {
        let path = path.as_str().expect("a path");
        must_be_right(&domain, path);
        let info = info(&domain, path);
        assert_eq!(info["part"].as_u64(), Some(part as u64), "{info}");
        assert_eq!(info["topics"][0]["type"], "Noise", "{info}");
        // All but the last one have been written to for as long as was asked for, as far as chunks
        // end on time: a chunk takes 150 ms.
        let is_last = part + 1 == files.len();
        let seconds = info["seconds"].as_f64().expect("a time");
        assert!(is_last || seconds > 0.2, "{info}");
        numbers.extend(noise_numbers(&domain.folder().join(path)));
    }
    assert!(numbers.windows(2).all(|pair| pair[0] + 1 == pair[1]));
    drop((noisy, bus));
    domain.assert_clean();
}
