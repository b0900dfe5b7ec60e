//! Files that other programs may write: without an index, with half of one, packed with zstd, not
//! packed, or without chunks. Each record of an index is optional.

use std::collections::BTreeMap;
use std::io::Cursor;

use lager_journal::{
    Check, Damage, Learnt, Message, Ordered, Overview, OverviewReader, Part, ReadError, Recovery,
    Report, Scan, Selection, Step, Visit, Walk,
};
use mcap::records::{MessageHeader, Metadata, op};
use mcap::{Compression, WriteOptions};

/// 100 messages packed with zstd by the package `mcap` for Python.
const ZSTD: &[u8] = include_bytes!("data/zstd.mcap");

const MESSAGES: u64 = 40;

/// A file of two topics with one schema, 10 messages in a chunk.
fn file(options: WriteOptions, notes: &[(&str, &str)]) -> Vec<u8> {
    let mut writer = options
        .chunk_size(None)
        .create(Cursor::new(Vec::new()))
        .unwrap();
    for (name, robot) in notes {
        let metadata = BTreeMap::from([("robot".to_owned(), (*robot).to_owned())]);
        let name = (*name).to_owned();
        writer.write_metadata(&Metadata { name, metadata }).unwrap();
    }
    let schema = writer.add_schema("thing", "jsonschema", b"{}").unwrap();
    let channels = ["one", "other"].map(|topic| {
        writer
            .add_channel(schema, topic, "json", &BTreeMap::new())
            .unwrap()
    });
    for number in 0..MESSAGES {
        let header = MessageHeader {
            channel_id: channels[(number % 2) as usize],
            sequence: number as u32,
            log_time: 1_000 + number,
            publish_time: 1_000 + number,
        };
        writer
            .write_to_known_channel(&header, b"{\"i\":1}")
            .unwrap();
        if number % 10 == 9 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn walk(bytes: &[u8], visit: &mut impl Visit) -> Learnt {
    let mut walk = Walk::default();
    walk.feed(bytes, visit);
    walk.finish(visit)
}

fn check(bytes: &[u8]) -> Report {
    let mut check = Check::default();
    walk(bytes, &mut check);
    check.finish()
}

fn part(bytes: &[u8], part: Part) -> &[u8] {
    let at = usize::try_from(part.at).unwrap().min(bytes.len());
    &bytes[at..(at + part.length).min(bytes.len())]
}

/// From the end alone, or from all of it.
fn overview(bytes: &[u8]) -> (Result<Overview, ReadError>, bool) {
    let mut reader = OverviewReader::new(bytes.len() as u64);
    let told = loop {
        match reader.wants() {
            Ok(Some(wanted)) => reader.supply(part(bytes, wanted)),
            Ok(None) => break reader.finish(),
            Err(error) => break Err(error),
        }
    };
    match told {
        Err(ReadError::NoIndex) => {
            let mut scan = Scan::default();
            let learnt = walk(bytes, &mut scan);
            (scan.finish(&learnt), false)
        }
        told => (told, true),
    }
}

/// How many messages of a topic the index, or what stands for it, leads to.
fn ordered(bytes: &[u8], overview: &Overview, topic: &str) -> Result<u64, ReadError> {
    let selection = Selection {
        topics: Some(vec![topic.to_owned()]),
        ..Selection::default()
    };
    let mut ordered = Ordered::new(overview, &selection)?;
    let mut found = 0;
    let mut last = 0;
    while let Some(step) = ordered.step() {
        let wanted = match step? {
            Step::Message(placed) => {
                assert!(placed.times.log >= last);
                (found, last) = (found + 1, placed.times.log);
                continue;
            }
            Step::Wants(wanted) => wanted,
        };
        ordered.supply(part(bytes, wanted))?;
    }
    Ok(found)
}

/// Nothing is wrong with the file, and all of it is found.
fn must_be_read(name: &str, bytes: &[u8], by_its_end: bool) {
    let report = check(bytes);
    assert!(report.faults.is_empty(), "{name}: {:?}", report.faults);
    let (overview, is_by_its_end) = overview(bytes);
    let overview = overview.unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(is_by_its_end, by_its_end, "{name}");
    assert_eq!(overview.messages, MESSAGES, "{name}");
    assert_eq!(
        (overview.begin_ns, overview.end_ns),
        (1_000, 1_039),
        "{name}"
    );
    let topics: Vec<_> = overview
        .topics
        .iter()
        .map(|topic| (topic.name.as_str(), topic.schema.as_str(), topic.messages))
        .collect();
    let expected = [
        ("one", "thing", MESSAGES / 2),
        ("other", "thing", MESSAGES / 2),
    ];
    assert_eq!(topics, expected, "{name}");
    let found = ordered(bytes, &overview, "other");
    match found {
        Ok(found) => assert_eq!(found, MESSAGES / 2, "{name}"),
        Err(error) => assert!(matches!(error, ReadError::Loose), "{name}: {error}"),
    }
}

#[test]
fn every_record_of_an_index_may_be_left_out() {
    let all = || WriteOptions::new().compression(None);
    for (name, options, by_its_end) in [
        ("all", all(), true),
        (
            "no summary",
            all()
                .emit_summary_records(false)
                .emit_summary_offsets(false),
            false,
        ),
        ("no statistics", all().emit_statistics(false), false),
        ("no chunk index", all().emit_chunk_indexes(false), false),
        (
            "no message indexes",
            all().emit_message_indexes(false),
            true,
        ),
        ("no repeated schemas", all().repeat_schemas(false), false),
        (
            "no repeated channels",
            all().repeat_channels(false).repeat_schemas(false),
            false,
        ),
        (
            "lz4",
            WriteOptions::new().compression(Some(Compression::Lz4)),
            true,
        ),
        ("no chunks", all().use_chunks(false), true),
        (
            "no chunks, no index",
            all().use_chunks(false).emit_summary_records(false),
            false,
        ),
    ] {
        must_be_read(name, &file(options, &[]), by_its_end);
    }
}

#[test]
fn a_file_whose_end_does_not_say_whose_it_is_is_known_all_the_same() {
    let options = || WriteOptions::new().compression(None);
    let notes = [("lager.recording", "r7")];
    for options in [options(), options().emit_metadata_indexes(false)] {
        let (overview, _) = overview(&file(options, &notes));
        assert_eq!(overview.unwrap().start.unwrap().robot, "r7");
    }
}

#[test]
fn counts_of_channels_may_be_left_out() {
    let mut bytes = file(WriteOptions::new().compression(None), &[]);
    // The statistics end with a map of 2 channels, each with 2 and 8 bytes.
    let at = record(&bytes, op::STATISTICS);
    let map = at + 9 + 8 + 2 + 4 * 4 + 8 + 8;
    assert_eq!(bytes[map..map + 4], 20_u32.to_le_bytes());
    bytes.drain(map + 4..map + 24);
    bytes[map..map + 4].copy_from_slice(&0_u32.to_le_bytes());
    let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) - 20;
    bytes[at + 1..at + 9].copy_from_slice(&length.to_le_bytes());
    // Whoever leaves something out writes no CRC either.
    let end = bytes.len();
    bytes[end - 12..end - 8].fill(0);
    must_be_read("no counts of channels", &bytes, false);
}

/// Where the record of that kind begins.
fn record(bytes: &[u8], kind: u8) -> usize {
    let mut at = 8;
    while bytes[at] != kind {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    at
}

#[test]
fn zstd_is_read_from_the_index_and_without_it() {
    let report = check(ZSTD);
    assert!(report.faults.is_empty(), "{:?}", report.faults);
    assert_eq!(report.topics["thing"].messages, 100);
    let (overview, _) = overview(ZSTD);
    let overview = overview.unwrap();
    assert_eq!((overview.messages, overview.chunks), (100, 1));
    assert_eq!(ordered(ZSTD, &overview, "thing").unwrap(), 100);
}

#[test]
fn damaged_zstd_is_told_whatever_is_wrong_with_it() {
    // The chunk's packed bytes are those between its header and its indexes.
    let chunk = record(ZSTD, op::CHUNK);
    let length = u64::from_le_bytes(ZSTD[chunk + 1..chunk + 9].try_into().unwrap());
    let packed = chunk + 9 + 44..chunk + 9 + usize::try_from(length).unwrap();
    let mut untold = 0;
    for at in packed {
        for bit in [0, 3, 7] {
            let mut bytes = ZSTD.to_vec();
            bytes[at] ^= 1 << bit;
            let report = check(&bytes);
            let is_told = |kind: fn(&Damage) -> bool| {
                report.faults.iter().any(|fault| match fault {
                    lager_journal::Fault::Damage(damage) => kind(damage),
                    _ => false,
                })
            };
            let told =
                is_told(|damage| matches!(damage, Damage::Chunk { .. } | Damage::Record { .. }));
            // A bit of the frame's head may change nothing that the CRC is of.
            let is_same = report
                .topics
                .get("thing")
                .is_some_and(|topic| topic.messages == 100);
            assert!(
                told || is_same,
                "bit {bit} of byte {at}: {:?}",
                report.faults
            );
            untold += u32::from(!told);
            // What the index leads to is an error as well, or other messages, and never a panic.
            if let (Ok(overview), _) = overview(&bytes) {
                let _ = ordered(&bytes, &overview, "thing");
            }
        }
    }
    assert!(untold < 20, "{untold}");
}

#[test]
fn a_packing_that_is_not_known_is_no_damage() {
    let mut bytes = ZSTD.to_vec();
    let places: Vec<_> = (0..bytes.len() - 4)
        .filter(|at| &bytes[*at..at + 4] == b"zstd")
        .collect();
    assert_eq!(places.len(), 2);
    for at in places {
        bytes[at..at + 4].copy_from_slice(b"brtl");
    }
    // Whoever changes something writes no CRC.
    let (data_end, end) = (record(&bytes, op::DATA_END), bytes.len());
    bytes[data_end + 9..data_end + 13].fill(0);
    bytes[end - 12..end - 8].fill(0);
    let said: Vec<_> = check(&bytes)
        .faults
        .iter()
        .map(ToString::to_string)
        .collect();
    let what = "packed with `brtl`, which this program does not read";
    assert!(said.iter().any(|fault| fault.contains(what)), "{said:?}");
    assert!(
        said.iter().all(|fault| !fault.contains("damaged")),
        "{said:?}"
    );
    let (overview, _) = overview(&bytes);
    let read = ordered(&bytes, &overview.unwrap(), "thing");
    assert!(read.unwrap_err().to_string().contains(what));
}

#[test]
fn our_own_messages_outside_of_chunks_are_recovered_into_chunks() {
    let options = WriteOptions::new().compression(None).use_chunks(false);
    let bytes = file(options, &[("lager.recording", "r7")]);
    let mut recovery = Recovery::default();
    let learnt = walk(&bytes, &mut Check::default());
    let mut again = Walk::knowing(learnt);
    again.feed(&bytes, &mut recovery);
    again.finish(&mut recovery);
    let mut copy = Vec::new();
    recovery.take(&mut copy);
    let (mut last, recovered) = recovery.finish().unwrap();
    copy.append(&mut last);
    assert_eq!(recovered.messages, MESSAGES);
    let (overview, _) = overview(&copy);
    let overview = overview.unwrap();
    assert_eq!(overview.start.as_ref().unwrap().robot, "r7");
    assert_eq!(ordered(&copy, &overview, "other").unwrap(), MESSAGES / 2);
}

/// Counts what a walk tells.
#[derive(Default)]
struct Nothing;

impl Visit for Nothing {
    fn message(&mut self, _message: &Message<'_>) {}

    fn note(&mut self, _name: &str, _texts: &BTreeMap<String, String>) {}

    fn damage(&mut self, _damage: Damage) {}
}

#[test]
fn what_is_fed_in_pieces_is_read_as_one() {
    for piece in [1, 13, 1 << 20] {
        let mut walk = Walk::default();
        for piece in ZSTD.chunks(piece) {
            walk.feed(piece, &mut Nothing);
        }
        let learnt = walk.finish(&mut Nothing);
        assert_eq!(learnt.topics().count(), 1);
    }
}
