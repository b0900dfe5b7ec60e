//! Files without a disk: written, read, cut off, damaged and recovered.

use std::collections::BTreeMap;

use lager_journal::{
    Channel, Check, Count, Counts, Damage, Envelope, EnvelopeSchema, Fault, Journal, Learnt,
    Message, Ordered, Overview, OverviewReader, Part, ReadError, Recovered, Recovery, Report,
    Selection, Start, Step, Times, Visit, Walk,
};
use lager_sample::{Description, Field, Stamp, describe};
use lager_topics::{LineFrame, Truth};
use proptest::prelude::*;

const TOPICS: [&str; 2] = ["sensor/line", "truth/pose"];
/// Some moment, in ns since 1970.
const BEGIN: u64 = 1_795_449_546_000_000_000;

/// Numbers that are the same in each run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit as u64) as usize
    }
}

fn schema(topic: usize) -> EnvelopeSchema {
    let make = [LineFrame::MAKE, Truth::MAKE][topic];
    EnvelopeSchema::of(&Description::parse(&describe(&make)).unwrap())
}

fn message(topic: usize, number: u64, lost: u64) -> Vec<u8> {
    let stamp = Stamp {
        sequence: number,
        epoch: 5,
        writer: 4711,
        publish_time_ns: 1_000_000 * number,
        ..Stamp::default()
    };
    let dropped = 0;
    let text = match topic {
        0 => serde_json::to_vec(&Envelope {
            stamp,
            lost,
            dropped,
            payload: LineFrame::default(),
        }),
        _ => serde_json::to_vec(&Envelope {
            stamp,
            lost,
            dropped,
            payload: Truth::default(),
        }),
    };
    text.unwrap()
}

/// A file of `messages` messages of both topics in chunks of 17, and where its chunks end: bytes of
/// the file and messages before.
struct File {
    bytes: Vec<u8>,
    chunks: Vec<(usize, u64)>,
}

fn begin() -> (Journal, [Channel; 2]) {
    let start = Start {
        robot: "r1".to_owned(),
        part: 0,
        unix_offset_ns: BEGIN as i64,
    };
    let mut journal = Journal::begin(&start).unwrap();
    let channels = [0, 1].map(|topic| journal.topic(TOPICS[topic], &schema(topic)).unwrap());
    (journal, channels)
}

fn write(journal: &mut Journal, channels: [Channel; 2], at: u64, number: u64) {
    let topic = (at % 2) as usize;
    let time = BEGIN + 1_000_000 * at;
    let times = Times {
        log: time,
        publish: time,
    };
    let message = message(topic, number, 0);
    journal
        .write(channels[topic], times, number, &message)
        .unwrap();
}

fn counts(messages: u64) -> Counts {
    let count = |received| Count {
        received,
        ..Count::default()
    };
    let (line, truth) = (messages.div_ceil(2), messages / 2);
    [(TOPICS[0], count(line)), (TOPICS[1], count(truth))]
        .map(|(topic, count)| (topic.to_owned(), count))
        .into()
}

fn file(messages: u64) -> File {
    let (mut journal, channels) = begin();
    let (mut bytes, mut chunks) = (Vec::new(), Vec::new());
    for at in 0..messages {
        write(&mut journal, channels, at, at / 2);
        if at % 17 == 16 {
            journal.flush().unwrap();
            journal.take(&mut bytes);
            chunks.push((bytes.len(), at + 1));
        }
    }
    bytes.append(&mut journal.end(&counts(messages)).unwrap());
    File { bytes, chunks }
}

/// Reads `bytes` in pieces of such sizes.
fn walk(bytes: &[u8], piece: usize, visit: &mut impl Visit) -> Learnt {
    walk_knowing(Learnt::default(), bytes, piece, visit)
}

fn walk_knowing(known: Learnt, bytes: &[u8], piece: usize, visit: &mut impl Visit) -> Learnt {
    let mut walk = Walk::knowing(known);
    for piece in bytes.chunks(piece) {
        walk.feed(piece, visit);
    }
    walk.finish(visit)
}

fn check(bytes: &[u8]) -> Report {
    let mut check = Check::default();
    walk(bytes, 4096, &mut check);
    check.finish()
}

fn recover(bytes: &[u8]) -> (Vec<u8>, Recovered) {
    let learnt = walk(bytes, 4096, &mut Check::default());
    let mut recovery = Recovery::default();
    walk_knowing(learnt, bytes, 4096, &mut recovery);
    let mut out = Vec::new();
    recovery.take(&mut out);
    let (mut last, recovered) = recovery.finish().unwrap();
    out.append(&mut last);
    (out, recovered)
}

fn part(bytes: &[u8], part: Part) -> &[u8] {
    let at = usize::try_from(part.at).unwrap().min(bytes.len());
    &bytes[at..(at + part.length).min(bytes.len())]
}

fn overview(bytes: &[u8]) -> Result<Overview, ReadError> {
    let mut reader = OverviewReader::new(bytes.len() as u64);
    while let Some(wanted) = reader.wants()? {
        reader.supply(part(bytes, wanted));
    }
    reader.finish()
}

/// The messages that an index leads to: topic, log time and the stamp's number.
fn ordered(bytes: &[u8], selection: &Selection) -> Vec<(String, u64, u64)> {
    let overview = overview(bytes).unwrap();
    let mut ordered = Ordered::new(&overview, selection).unwrap();
    let mut found = Vec::new();
    loop {
        let wanted = match ordered.step() {
            None => return found,
            Some(Ok(Step::Wants(part))) => part,
            Some(Ok(Step::Message(placed))) => {
                let envelope: Envelope<serde_json::Value> =
                    serde_json::from_slice(placed.message).unwrap();
                let number = envelope.stamp.sequence;
                found.push((placed.topic.to_owned(), placed.times.log, number));
                continue;
            }
            Some(Err(error)) => panic!("{error}"),
        };
        ordered.supply(part(bytes, wanted)).unwrap();
    }
}

#[test]
fn what_is_written_is_read_in_pieces_of_any_size() {
    let file = file(100);
    for piece in [1, 7, 4096, 1 << 20] {
        let mut check = Check::default();
        walk(&file.bytes, piece, &mut check);
        let report = check.finish();
        assert!(report.faults.is_empty(), "{piece}: {:?}", report.faults);
        assert_eq!(report.chunks, 6);
        let told = counts(100);
        for (topic, found) in &report.topics {
            assert_eq!((found.messages, found.gaps), (50, 0), "{topic}");
            assert_eq!(found.count, told.get(topic).copied());
        }
    }
}

#[test]
fn the_end_of_a_file_says_what_it_is() {
    let overview = overview(&file(101).bytes).unwrap();
    assert_eq!(overview.messages, 101);
    assert_eq!(overview.chunks, 6);
    assert_eq!(overview.begin_ns, BEGIN);
    assert_eq!(overview.end_ns, BEGIN + 100_000_000);
    assert_eq!(overview.start.unwrap().robot, "r1");
    let topics: Vec<_> = overview
        .topics
        .iter()
        .map(|topic| (topic.name.as_str(), topic.schema.as_str(), topic.messages))
        .collect();
    let expected = [
        ("sensor/line", "LineFrame", 51),
        ("truth/pose", "Truth", 50),
    ];
    assert_eq!(topics, expected);
    assert_eq!(overview.topics[0].count.unwrap().received, 51);
}

#[test]
fn messages_come_by_their_time_and_as_selected() {
    let (mut journal, channels) = begin();
    for at in [3, 1, 2, 0, 9, 5, 8, 4] {
        write(&mut journal, channels, at, at / 2);
        if at == 0 {
            journal.flush().unwrap();
        }
    }
    let mut bytes = Vec::new();
    journal.take(&mut bytes);
    bytes.append(&mut journal.end(&Counts::new()).unwrap());
    let times = |selection: &Selection| -> Vec<u64> {
        let found = ordered(&bytes, selection).into_iter();
        found.map(|(_, at, _)| (at - BEGIN) / 1_000_000).collect()
    };
    assert_eq!(times(&Selection::default()), [0, 1, 2, 3, 4, 5, 8, 9]);
    let some = Selection {
        topics: Some(vec!["sensor/line".to_owned()]),
        from_ns: Some(BEGIN + 2_000_000),
        before_ns: Some(BEGIN + 8_000_000),
        is_backwards: false,
    };
    assert_eq!(times(&some), [2, 4]);
    let backwards = Selection {
        is_backwards: true,
        ..some
    };
    assert_eq!(times(&backwards), [4, 2]);
    // Topics that it does not have are not all of them.
    let none = Selection {
        topics: Some(vec!["nav/map".to_owned()]),
        ..Selection::default()
    };
    assert!(times(&none).is_empty());
}

#[test]
fn a_file_cut_off_at_any_byte_gives_every_whole_chunk_back() {
    let whole = file(1_000);
    let mut dice = Dice(0x5EED);
    let mut partial = 0;
    for _ in 0..1_000 {
        let cut = dice.below(whole.bytes.len());
        let (bytes, recovered) = recover(&whole.bytes[..cut]);
        let messages = whole.chunks.iter().rfind(|(end, _)| *end <= cut);
        // The last chunk has no message index behind it when the cut is there, and is whole anyway.
        let least = messages.map_or(0, |(_, messages)| *messages);
        assert!(recovered.messages >= least, "cut at {cut}: {recovered:?}");
        assert!(
            recovered.messages < least + 34,
            "cut at {cut}: {recovered:?}"
        );
        assert!(!recovered.damage.is_empty(), "cut at {cut} is not told");
        if bytes.is_empty() {
            assert_eq!(least, 0);
            continue;
        }
        partial += u32::from(recovered.messages > 0);
        let report = check(&bytes);
        assert!(
            report.faults.is_empty(),
            "cut at {cut}: {:?}",
            report.faults
        );
        let there: u64 = report.topics.values().map(|topic| topic.messages).sum();
        assert_eq!(there, recovered.messages, "cut at {cut}");
        assert_eq!(ordered(&bytes, &Selection::default()).len() as u64, there);
    }
    assert!(partial > 900, "{partial}");
}

#[test]
fn every_flipped_bit_is_found_and_what_is_recovered_has_no_fault() {
    let whole = file(300);
    let mut dice = Dice(0xB17);
    for _ in 0..1_000 {
        let (at, bit) = (dice.below(whole.bytes.len()), dice.below(8));
        let mut bytes = whole.bytes.clone();
        bytes[at] ^= 1 << bit;
        let report = check(&bytes);
        assert!(!report.faults.is_empty(), "bit {bit} of byte {at}");
        // None of this panics or takes memory without end, whatever it says.
        let _ = overview(&bytes);
        let (bytes, _) = recover(&bytes);
        let report = check(&bytes);
        let fine = |fault: &Fault| {
            matches!(
                fault,
                Fault::Damage(Damage::Cut { whole: 8 } | Damage::NotMcap)
            )
        };
        assert!(report.faults.iter().all(fine), "{at}: {:?}", report.faults);
    }
}

#[test]
fn a_damaged_chunk_costs_no_other_one_and_is_told_as_a_loss() {
    let whole = file(170);
    // Within the packed messages of the fifth chunk, and in the byte that says that it is a chunk.
    for (offset, bit) in [(200, 4), (0, 0x10)] {
        let mut bytes = whole.bytes.clone();
        bytes[whole.chunks[3].0 + offset] ^= bit;
        let (bytes, recovered) = recover(&bytes);
        assert_eq!((recovered.chunks, recovered.messages), (9, 153));
        let report = check(&bytes);
        assert!(report.faults.is_empty(), "{:?}", report.faults);
        let lost: u64 = report
            .topics
            .values()
            .map(|topic| topic.count.unwrap().lost)
            .sum();
        assert_eq!(lost, 17);
    }
}

#[test]
fn the_names_of_topics_are_found_in_the_index_if_their_chunk_is_damaged() {
    let whole = file(170);
    let mut bytes = whole.bytes.clone();
    // Within the packed schemas, which the first chunk begins with.
    bytes[500] ^= 4;
    let (bytes, recovered) = recover(&bytes);
    assert_eq!((recovered.chunks, recovered.messages), (9, 153));
    let report = check(&bytes);
    assert!(report.faults.is_empty(), "{:?}", report.faults);
    assert!(report.topics.keys().eq(&TOPICS));
}

#[test]
fn a_number_that_nobody_told_of_is_missing() {
    let (mut journal, channels) = begin();
    for (at, number) in [(0, 0), (2, 1), (4, 4), (6, 5), (1, 9), (3, 9)] {
        write(&mut journal, channels, at, number);
    }
    let mut bytes = Vec::new();
    let mut counts = counts(5);
    counts.get_mut("sensor/line").unwrap().dropped = 1;
    let mut last = journal.end(&counts).unwrap();
    bytes.append(&mut last);
    let faults: Vec<_> = check(&bytes)
        .faults
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(
        faults,
        [
            "truth/pose: number 9 comes where 10 or a greater one should",
            "sensor/line: 2 samples are missing, and the file says 1",
        ]
    );
}

#[test]
fn a_cut_file_says_that_it_is_no_whole_one() {
    let whole = file(100).bytes;
    let cut = &whole[..whole.len() - 9];
    assert!(matches!(overview(cut), Err(ReadError::NotWhole)));
    assert!(matches!(
        overview(b"no recording"),
        Err(ReadError::NotWhole)
    ));
    assert!(matches!(overview(b""), Err(ReadError::NotWhole)));
    let faults = check(b"no recording at all").faults;
    assert!(matches!(faults[..], [Fault::Damage(Damage::NotMcap)]));
    let (bytes, recovered) = recover(b"no recording at all");
    assert!(bytes.is_empty() && recovered.messages == 0);
}

#[test]
fn what_another_program_wrote_is_neither_judged_nor_recovered() {
    let mut writer = mcap::Writer::new(std::io::Cursor::new(Vec::new())).unwrap();
    let channel = writer
        .add_channel(0, "imu", "cdr", &BTreeMap::new())
        .unwrap();
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 1,
        publish_time: 1,
    };
    writer.write_to_known_channel(&header, &[1, 2, 3]).unwrap();
    writer.finish().unwrap();
    let bytes = writer.into_inner().into_inner();
    let report = check(&bytes);
    assert!(report.faults.is_empty() && !report.is_ours);
    assert_eq!(report.topics["imu"].messages, 1);
    assert!(recover(&bytes).0.is_empty());
    let overview = overview(&bytes).unwrap();
    assert_eq!((overview.start, overview.messages), (None, 1));
}

/// Remembers what a file has.
#[derive(Default)]
struct Seen(Vec<Vec<u8>>);

impl Visit for Seen {
    fn message(&mut self, message: &Message<'_>) {
        self.0.push(message.data.to_vec());
    }

    fn note(&mut self, _name: &str, _texts: &BTreeMap<String, String>) {}

    fn damage(&mut self, damage: Damage) {
        panic!("{damage}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_file_ends_within_the_room_that_was_asked_for(
        steps in proptest::collection::vec(
            (proptest::collection::vec(any::<u8>(), 120..4_000), any::<bool>()), 1..60),
    ) {
        let (mut journal, channels) = begin();
        let mut written = Vec::new();
        let mut room = (journal.length(), journal.room(0));
        for (number, (message, is_last)) in steps.iter().enumerate() {
            let room_before = journal.room(message.len() as u64 + 31);
            let times = Times { log: number as u64, publish: 0 };
            journal.write(channels[number % 2], times, 0, message).unwrap();
            prop_assert!(journal.room(0) <= room_before);
            room = (journal.length(), journal.room(0));
            if *is_last {
                journal.flush().unwrap();
                prop_assert!(journal.length() <= room.0 + room.1);
            }
        }
        journal.take(&mut written);
        let mut counts = counts(2);
        for count in counts.values_mut() {
            *count = Count { received: u64::MAX, lost: u64::MAX, dropped: u64::MAX };
        }
        let last = journal.end(&counts).unwrap();
        written.extend_from_slice(&last);
        prop_assert!(written.len() as u64 <= room.0 + room.1);
        let mut seen = Seen::default();
        walk(&written, 1_000, &mut seen);
        let expected: Vec<_> = steps.into_iter().map(|(message, _)| message).collect();
        prop_assert_eq!(seen.0, expected);
    }
}
