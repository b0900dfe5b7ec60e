//! Everything that comes over the network, as it is and with a few thousand deterministic mutations
//! of it. `tests/fuzz/remote.rs` asks for the same with any bytes, and begins with these.

mod laws;

use std::fs;
use std::path::Path;

/// What both ends say to each other.
fn said() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut files: Vec<_> = fs::read_dir(folder)
        .expect("the corpus")
        .map(|entry| entry.expect("a file").path())
        .collect();
    files.sort();
    assert!(files.len() >= 6, "{files:?}");
    let read = |file| fs::read(file).expect("a file");
    files.iter().map(read).collect()
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
