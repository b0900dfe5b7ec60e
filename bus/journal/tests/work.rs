//! What looking at a damaged file costs, counted in bytes of memory asked for and not in time: it
//! grows with the file and with nothing that the file says of itself.

#![allow(unsafe_code, reason = "an allocator of our own counts")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::Cursor;

use lager_journal::{Check, Fault, Learnt, OverviewReader, Part, Recovery, Scan, Visit, Walk};
use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata, op};

struct Counting;

thread_local! {
    static BYTES: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        BYTES.with(|bytes| bytes.set(bytes.get() + layout.size() as u64));
        // SAFETY: the caller keeps the promises of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the promises of `dealloc`.
        unsafe { System.dealloc(place, layout) }
    }

    // `alloc_zeroed` and `realloc` come here as well: they are written with `alloc`.
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn work(what: impl FnOnce()) -> u64 {
    let before = BYTES.get();
    what();
    BYTES.get() - before
}

fn walk(known: Learnt, bytes: &[u8], visit: &mut impl Visit) -> Learnt {
    let mut walk = Walk::knowing(known);
    for piece in bytes.chunks(1 << 16) {
        walk.feed(piece, visit);
    }
    walk.finish(visit)
}

/// Everything that is done with a file: check, the copy of what is whole, and a look at it.
fn all(bytes: &[u8]) -> u64 {
    work(|| {
        let mut check = Check::default();
        let learnt = walk(Learnt::default(), bytes, &mut check);
        let report = check.finish();
        assert!(report.faults.len() <= 100);
        let mut recovery = Recovery::default();
        walk(learnt, bytes, &mut recovery);
        let _ = recovery.finish();
        let mut scan = Scan::default();
        let learnt = walk(Learnt::default(), bytes, &mut scan);
        let _ = scan.finish(&learnt);
        let mut reader = OverviewReader::new(bytes.len() as u64);
        while let Ok(Some(Part { at, length })) = reader.wants() {
            let at = usize::try_from(at).unwrap().min(bytes.len());
            reader.supply(&bytes[at..(at + length).min(bytes.len())]);
        }
        let _ = reader.finish();
    })
}

/// How many times as much memory as the file has bytes may be asked for, all in all.
const MOST: u64 = 400;

fn must_be_linear(name: &str, few: &[u8], many: &[u8]) {
    let (small, large) = (all(few), all(many));
    let times = many.len() as u64 / few.len() as u64;
    println!(
        "{name}: {} bytes cost {small}, {} cost {large}",
        few.len(),
        many.len()
    );
    assert!(
        large <= MOST * many.len() as u64,
        "{name}: {large} for {}",
        many.len()
    );
    assert!(
        large <= 3 * times.max(1) * small,
        "{name}: {small} became {large} for {times} times"
    );
}

/// The beginning of a recording of ours.
fn begun() -> Vec<u8> {
    let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    let name = "lager.recording".to_owned();
    let metadata = std::iter::once(("robot".to_owned(), "r1".to_owned())).collect();
    writer.write_metadata(&Metadata { name, metadata }).unwrap();
    writer.flush().unwrap();
    let bytes = writer.into_inner().into_inner();
    // Its own end is not written yet; what `into_inner` adds is cut off.
    let end = record(&bytes, op::DATA_END);
    bytes[..end].to_vec()
}

/// Where the first record of that kind begins, or the end.
fn record(bytes: &[u8], kind: u8) -> usize {
    let mut at = 8;
    while at < bytes.len() && bytes[at] != kind {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    at
}

/// A chunk that says that it holds so many bytes, and has few.
fn chunk(packing: &str, says: u64, crc: u32, packed: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    body.extend([0; 16]);
    body.extend(says.to_le_bytes());
    body.extend(crc.to_le_bytes());
    body.extend((packing.len() as u32).to_le_bytes());
    body.extend(packing.as_bytes());
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(packed);
    let mut record = vec![op::CHUNK];
    record.extend((body.len() as u64).to_le_bytes());
    record.extend(body);
    record
}

#[test]
fn a_chunk_that_says_that_it_is_large_costs_no_more_than_it_has() {
    // The beginnings of frames, as they are left where a disk lost what follows.
    let lz4 = [0x04, 0x22, 0x4D, 0x18, 0x64, 0x40, 0xA7, 0, 0, 0, 0, 0];
    let zstd = [
        0x28, 0xB5, 0x2F, 0xFD, 0x60, 0x60, 0x0E, 0x95, 0x0A, 0, 0, 0,
    ];
    for (packing, packed) in [("lz4", lz4), ("zstd", zstd), ("", [0; 12])] {
        for crc in [0, 0xDEAD_BEEF] {
            let file = |chunks: usize| {
                let mut bytes = begun();
                for _ in 0..chunks {
                    bytes.extend(chunk(packing, 200 << 20, crc, &packed));
                }
                bytes
            };
            must_be_linear(packing, &file(200), &file(2_000));
        }
    }
}

#[test]
fn topics_that_share_a_large_schema_cost_it_once() {
    let file = |topics: usize| {
        let mut writer = WriteOptions::new()
            .compression(None)
            .create(Cursor::new(begun()))
            .unwrap();
        let schema = vec![b' '; 40 * topics];
        let schema = writer.add_schema("large", "jsonschema", &schema).unwrap();
        for topic in 0..topics {
            let name = format!("topic/{topic}");
            let channel = writer
                .add_channel(schema, &name, "json", &std::collections::BTreeMap::new())
                .unwrap();
            let header = MessageHeader {
                channel_id: channel,
                sequence: 0,
                log_time: 1,
                publish_time: 1,
            };
            writer.write_to_known_channel(&header, b"{}").unwrap();
        }
        writer.finish().unwrap();
        writer.into_inner().into_inner()
    };
    must_be_linear("a schema of many topics", &file(300), &file(3_000));
}

#[test]
fn a_hole_of_zeros_and_many_faults_cost_no_more_than_the_file() {
    let hole = |bytes: usize| [begun(), vec![0; bytes]].concat();
    must_be_linear("zeros", &hole(20_000), &hole(200_000));
    // Records of known kinds that cannot be read, each of which is a fault.
    let faults = |count: usize| {
        let mut bytes = begun();
        for _ in 0..count {
            bytes.push(op::STATISTICS);
            bytes.extend(3_u64.to_le_bytes());
            bytes.extend([1, 2, 3]);
        }
        bytes
    };
    must_be_linear("faults", &faults(2_000), &faults(20_000));
    let mut check = Check::default();
    walk(Learnt::default(), &faults(20_000), &mut check);
    let report = check.finish();
    assert!(report.faults_found >= 20_000);
    assert!(matches!(report.faults[0], Fault::Damage(_)));
}
