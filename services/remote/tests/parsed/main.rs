//! Everything that comes over the network, as it is and with a few thousand deterministic mutations
//! of it. `tests/fuzz/remote.rs` asks for the same with any bytes.

mod laws;

use lager_remote::{Counts, Note};
use lager_sample::Stamp;

/// What both ends say to each other.
fn said() -> Vec<Vec<u8>> {
    let note = |next: u64, is_answer: bool| {
        let stamp = Stamp {
            sequence: next,
            writer: 7,
            epoch: 1_000,
            publish_time_ns: 2_000 + next,
            source_time_ns: 2_000,
            ..Stamp::default()
        };
        let counts = Counts {
            run: 5,
            next,
            left_out: 1,
            lost: 2,
        };
        let note = Note {
            stamp,
            is_answer,
            is_limited: true,
            counts,
            layout: 9,
        };
        note.to_bytes().to_vec()
    };
    let texts = [
        r#"{"robot":"r1","run":5,"number":7,"now_ns":11,"about":2,"topics":{"a/b":{"next":3,"left_out":2,"lost":1}}}"#,
        r#"{"layout":"A{a:[B{c:u16,d:T<X,7=Y>};2]}","state":true,"rate":0.5,"ends":{"publishers":1,"subscribers":2,"observers":1,"writers":{"7":"bridge"},"readers":{},"woken":{}}}"#,
        r#"{"now_ns":11,"unix_offset_ns":-13,"boot":"b","robot":{"ns":5,"at_ns":6}}"#,
        "tls/[::1]:7447",
        "unixsock-stream//run/lager/zenoh",
    ];
    let mut said: Vec<Vec<u8>> = texts.iter().map(|text| text.as_bytes().to_vec()).collect();
    said.push([note(1, false), note(3, true), note(2, false)].concat());
    said
}

#[test]
fn what_was_said_holds_as_it_is_and_however_it_is_spoilt() {
    // A generator of Marsaglia's; the same numbers each time.
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut random = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    for bytes in said() {
        laws::hold(&bytes);
        for _ in 0..4_000 {
            let mut spoilt = bytes.clone();
            for _ in 0..=random(4) {
                let place = random(spoilt.len());
                match random(4) {
                    0 => spoilt[place] = random(256) as u8,
                    1 => spoilt[place] ^= 1 << random(8),
                    2 => spoilt.truncate(place.max(1)),
                    _ => spoilt.insert(place, b"0123456789{}[]\",:-e/"[random(20)]),
                }
            }
            laws::hold(&spoilt);
        }
    }
}
