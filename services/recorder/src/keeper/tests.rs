//! The keeper with a queue and a folder, and no bus.

use std::fs;
use std::time::Duration;

use lager_journal::{Content, Envelope, EnvelopeSchema, Learnt, Message, Times, Visit, Walk};
use lager_sample::{Description, Stamp, Topic as _};
use lager_topics::{LineFrame, NavMap, WarehouseMap};

use super::*;
use crate::Split;
use crate::tally::{QueueIn, Topic, queue};

/// A folder of our own.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder =
            std::env::temp_dir().join(format!("lager-keeper-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        Self(folder)
    }

    fn config(&self, split: Split) -> RecordConfig {
        RecordConfig {
            file: self.0.join("tour.mcap"),
            or_another: false,
            topics: Vec::new(),
            split,
            queue: 0,
            flush: Duration::ZERO,
        }
    }

    fn names(&self) -> Vec<String> {
        let files = fs::read_dir(&self.0).expect("our folder");
        let names = files.map(|file| file.expect("a file").file_name().into_string());
        let mut names: Vec<_> = names.map(|name| name.expect("a name")).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The lines and the map of a robot.
fn topics() -> Topics {
    let topics = Topics::default();
    let line = EnvelopeSchema::of(&Description::of::<LineFrame>());
    topics.add(Topic::new("sensor/line", line, false));
    let map = EnvelopeSchema::of(&Description::of::<WarehouseMap>());
    topics.add(Topic::new(NavMap::NAME, map, true));
    topics
}

/// A sample of the topic at that place, at that many ms.
fn item(topic: usize, number: u64, ms: u64) -> Item {
    let stamp = Stamp {
        sequence: number,
        publish_time_ns: ms * 1_000_000,
        ..Stamp::default()
    };
    let message = match topic {
        0 => serde_json::to_vec(&Envelope {
            stamp,
            lost: 0,
            dropped: 0,
            payload: LineFrame::default(),
        }),
        _ => serde_json::to_vec(&Envelope {
            stamp,
            lost: 0,
            dropped: 0,
            payload: WarehouseMap::default(),
        }),
    };
    Item {
        topic,
        times: Times {
            log: ms * 1_000_000,
            publish: ms * 1_000_000,
        },
        sequence: number,
        lost: 0,
        dropped: 0,
        message: message.expect("JSON"),
    }
}

fn put(to: &QueueIn, topics: &Topics, item: Item) {
    topics.at(item.topic).receive();
    assert!(to.put(item));
}

/// What a file has: topic, whether repeated, number, log and publish time in ms.
#[derive(Default)]
struct Seen(Vec<(String, bool, u64, u64, u64)>);

impl Visit for Seen {
    fn message(&mut self, message: &Message<'_>) {
        let is_repeated = match message.topic.content {
            Content::Samples => false,
            Content::Repeated => true,
            Content::Derived(_) => return,
        };
        let envelope: Envelope<serde::de::IgnoredAny> =
            serde_json::from_slice(message.data).expect("a message");
        self.0.push((
            message.topic.name.clone(),
            is_repeated,
            envelope.stamp.sequence,
            message.times.log / 1_000_000,
            message.times.publish / 1_000_000,
        ));
    }

    fn note(&mut self, _name: &str, _texts: &BTreeMap<String, String>) {}

    fn damage(&mut self, damage: lager_journal::Damage) {
        panic!("{damage}");
    }
}

fn seen(path: &Path) -> Vec<(String, bool, u64, u64, u64)> {
    let mut seen = Seen::default();
    let mut walk = Walk::knowing(Learnt::default());
    walk.feed(&fs::read(path).expect("a file"), &mut seen);
    walk.finish(&mut seen);
    seen.0
}

/// What `check` says of a file that must be right.
fn right(path: &Path) -> String {
    let mut said = Vec::new();
    let is_right = crate::check(path, false, &mut said).expect("a file");
    let said = String::from_utf8(said).expect("text");
    assert!(is_right, "{said}");
    said
}

#[test]
fn what_waits_when_no_next_file_can_be_made_is_counted_as_dropped() {
    let folder = Folder::new("no-next");
    // The second file is there already.
    fs::write(folder.0.join("tour-001.mcap"), "").expect("a file");
    let config = folder.config(Split {
        bytes: Some(1),
        time: None,
    });
    let topics = topics();
    let (to, from) = queue(BATCH + 7);
    for number in 0..BATCH as u64 + 7 {
        put(&to, &topics, item(0, number, 0));
    }
    let notes = Notes::default();
    let keeper = Keeper::new(&config, Start::default(), &topics, from, &notes);
    let kept = keeper.expect("a file").run();
    assert!(
        matches!(kept.result, Err(RecordError::Exists { .. })),
        "{:?}",
        kept.result
    );
    let count = topics.at(0).count();
    assert_eq!((count.received, count.dropped), (BATCH as u64 + 7, 7));
    let said = right(&kept.files[0]);
    assert!(said.contains("7 dropped by it"), "{said}");
}

#[test]
fn each_file_begins_with_the_last_sample_of_what_holds() {
    let folder = Folder::new("holds");
    let config = folder.config(Split {
        bytes: Some(1),
        time: None,
    });
    let topics = topics();
    let (to, from) = queue(100);
    let notes = Notes::default();
    let keeper = Keeper::new(&config, Start::default(), &topics, from, &notes);
    let mut keeper = keeper.expect("a file");
    // A file for each of these, since a file of one byte is full.
    let parts = [
        vec![item(1, 0, 10), item(1, 1, 11), item(0, 0, 12)],
        vec![item(0, 1, 20)],
        vec![item(0, 2, 30), item(1, 2, 31)],
        vec![item(0, 3, 40)],
    ];
    for items in parts {
        for item in &items {
            topics.at(item.topic).receive();
        }
        keeper.write(items).expect("a disk");
    }
    drop(to);
    let kept = keeper.run();
    kept.result.expect("nothing went wrong");
    let (line, map) = ("sensor/line", NavMap::NAME);
    /// Topic, whether it is repeated, number, log time and publish time in ns.
    type Row = (&'static str, bool, u64, u64, u64);
    let expected: [&[Row]; 6] = [
        &[
            (map, false, 0, 10, 10),
            (map, false, 1, 11, 11),
            (line, false, 0, 12, 12),
        ],
        // With its own number and publish time, at the file's beginning.
        &[(map, true, 1, 20, 11), (line, false, 1, 20, 20)],
        &[
            (map, true, 1, 30, 11),
            (line, false, 2, 30, 30),
            (map, false, 2, 31, 31),
        ],
        &[(map, true, 2, 40, 31), (line, false, 3, 40, 40)],
        // Nothing came any more, and they still say what holds.
        &[(map, true, 2, 40, 31)],
        &[(map, true, 2, 40, 31)],
    ];
    assert_eq!(kept.files.len(), expected.len());
    for (file, expected) in kept.files.iter().zip(expected) {
        let seen = seen(file);
        let seen: Vec<_> = seen
            .iter()
            .map(|(topic, is_repeated, number, log, publish)| {
                (topic.as_str(), *is_repeated, *number, *log, *publish)
            })
            .collect();
        assert_eq!(seen, expected, "{}", file.display());
        // What is repeated is neither a sample more nor one that is missing.
        let said = right(file);
        assert!(said.contains("0 lost before the recorder"), "{said}");
    }
    let mut told = Vec::new();
    crate::info(&kept.files[2], true, &mut told).expect("a file");
    let told: serde_json::Value = serde_json::from_slice(&told).expect("JSON");
    let map = &told["topics"][1];
    assert_eq!(map["topic"], NavMap::NAME);
    assert_eq!(
        (&map["messages"], &map["repeated"], &map["received"]),
        (&2.into(), &1.into(), &1.into())
    );
}

#[test]
fn a_file_that_is_taken_away_is_told_and_the_recording_goes_on_in_another() {
    let folder = Folder::new("gone");
    let config = folder.config(Split::default());
    let topics = topics();
    let (to, from) = queue(100);
    let notes = Notes::default();
    let keeper = Keeper::new(&config, Start::default(), &topics, from, &notes);
    let mut keeper = keeper.expect("a file");
    let write = |keeper: &mut Keeper, item: Item| {
        topics.at(item.topic).receive();
        keeper.write(vec![item]).expect("a disk");
    };
    let tour = folder.0.join("tour.mcap");
    write(&mut keeper, item(1, 0, 10));
    fs::rename(&tour, folder.0.join("kept.mcap")).expect("our file");
    write(&mut keeper, item(0, 0, 20));
    // Somebody's own file takes its place.
    fs::rename(&tour, folder.0.join("second.mcap")).expect("our file");
    fs::write(&tour, "mine").expect("a file");
    write(&mut keeper, item(0, 1, 30));
    fs::remove_file(folder.0.join("tour-2.mcap")).expect("our file");
    write(&mut keeper, item(0, 2, 40));
    drop(to);
    let kept = keeper.run();
    let error = kept
        .result
        .expect_err("somebody took files away")
        .to_string();
    assert!(error.contains("kept.mcap while it was recorded"), "{error}");
    assert_eq!(notes.news().len(), 3);
    assert_eq!(
        folder.names(),
        ["kept.mcap", "second.mcap", "tour-2.mcap", "tour.mcap"]
    );
    assert_eq!(fs::read(&tour).expect("a file"), b"mine");
    let names = ["kept.mcap", "second.mcap", "tour-2.mcap"].map(|name| folder.0.join(name));
    assert_eq!(kept.files, names);
    // Each is whole, and can be used alone.
    let numbers = names.map(|name| {
        right(&name);
        let samples = seen(&name).into_iter();
        samples
            .map(|(topic, is_repeated, number, ..)| (topic, is_repeated, number))
            .collect::<Vec<_>>()
    });
    let line = |number| ("sensor/line".to_owned(), false, number);
    let map = |is_repeated| (NavMap::NAME.to_owned(), is_repeated, 0);
    assert_eq!(numbers[0], [map(false)]);
    assert_eq!(numbers[1], [map(true), line(0)]);
    assert_eq!(numbers[2], [map(true), line(2)]);
}

#[test]
fn a_recording_whose_folder_is_gone_ends_and_says_so() {
    let folder = Folder::new("no-folder");
    let config = folder.config(Split::default());
    let topics = topics();
    let (_to, from) = queue(100);
    let keeper = Keeper::new(&config, Start::default(), &topics, from, &Notes::default());
    let keeper = keeper.expect("a file");
    fs::remove_dir_all(&folder.0).expect("our folder");
    let kept = keeper.run();
    let error = kept.result.expect_err("no folder").to_string();
    assert!(
        error.contains("was removed while it was recorded"),
        "{error}"
    );
    assert!(error.contains("the recording ends here"), "{error}");
    assert!(kept.files.is_empty(), "{:?}", kept.files);
}

#[test]
fn a_name_that_nobody_asked_for_gives_way() {
    let folder = Folder::new("names");
    let topics = topics();
    let begin = |or_another| {
        let config = RecordConfig {
            or_another,
            ..folder.config(Split::default())
        };
        let (to, from) = queue(1);
        drop(to);
        let keeper = Keeper::new(&config, Start::default(), &topics, from, &Notes::default())?;
        keeper.run().result
    };
    begin(true).expect("the name is free");
    begin(true).expect("another name is free");
    begin(true).expect("a third one is free");
    assert!(matches!(begin(false), Err(RecordError::Exists { .. })));
    assert_eq!(folder.names(), ["tour-2.mcap", "tour-3.mcap", "tour.mcap"]);
}
