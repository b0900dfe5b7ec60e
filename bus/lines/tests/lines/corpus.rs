//! The corpus of the fuzzer as it is, and with a few thousand deterministic mutations of it.
//! `LAGER_SOAK_LINES` says how many.

use std::path::Path;

use crate::laws;

/// Pieces that a mutation puts in.
const PIECES: &[&[u8]] = &[
    b"\n",
    b"\r\n",
    b"\r",
    b" ",
    b"\t",
    b"-",
    b"=",
    b",",
    b";",
    b"\0",
    b"\xFF",
    b"\xC3",
    "å".as_bytes(),
    b"0",
    b"255",
    b"256",
    b"99999999999999999999",
    b"F1",
    b"0x",
    b"prodlis",
    b"prodlist 0",
    b"stop ",
    b"do 1 ",
    b"state ",
    b"thought ",
    b"lager 1 r1",
    b"left",
    b"-1",
    b"11111010",
];

/// Numbers without a pattern, the same ones in every run.
struct Numbers(u64);

impl Numbers {
    /// A number below `limit`, which is not 0.
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit as u64) as usize
    }

    /// A range of places of something that has `length`.
    fn range(&mut self, length: usize) -> std::ops::Range<usize> {
        let (one, other) = (self.below(length + 1), self.below(length + 1));
        one.min(other)..one.max(other)
    }
}

fn corpus() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let entries = std::fs::read_dir(&folder).expect("the corpus");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    assert!(files.len() >= 10, "the corpus is not here: {files:?}");
    let read = |file| std::fs::read(file).expect("a readable file");
    files.iter().map(read).collect()
}

fn mutated(numbers: &mut Numbers, corpus: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = corpus[numbers.below(corpus.len())].clone();
    for _ in 0..=numbers.below(4) {
        let range = numbers.range(bytes.len());
        match numbers.below(6) {
            0 if !bytes.is_empty() => {
                let place = numbers.below(bytes.len());
                bytes[place] ^= 1 << numbers.below(8);
            }
            1 => drop(bytes.drain(range)),
            2 => bytes.truncate(range.start),
            3 => {
                let again = bytes[range.clone()].to_vec();
                bytes.splice(range.end..range.end, again);
            }
            4 => {
                let other = &corpus[numbers.below(corpus.len())];
                let piece = other[numbers.range(other.len())].to_vec();
                bytes.splice(range, piece);
            }
            _ => {
                let piece = PIECES[numbers.below(PIECES.len())];
                bytes.splice(range.start..range.start, piece.iter().copied());
            }
        }
    }
    bytes
}

#[test]
fn the_corpus_has_good_lines_and_bad_ones() {
    let (mut read, mut refused) = (0, 0);
    for bytes in corpus() {
        let (good, bad) = laws::hold(&bytes);
        read += good;
        refused += bad;
    }
    assert!(
        read >= 80 && refused >= 40,
        "{read} read, {refused} refused"
    );
}

#[test]
fn the_laws_hold_for_mutations_of_the_corpus() {
    let runs = std::env::var("LAGER_SOAK_LINES").map_or(10_000, |runs| {
        runs.replace('_', "")
            .parse()
            .expect("a number of mutations")
    });
    let corpus = corpus();
    let mut numbers = Numbers(0x9E37_79B9_7F4A_7C15);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..runs {
        let bytes = mutated(&mut numbers, &corpus);
        let (good, bad) = laws::hold(&bytes);
        read += good;
        refused += bad;
    }
    println!("{runs} mutations: {read} lines read as something, {refused} as nothing");
    assert!(
        read > runs && refused > runs,
        "{read} read, {refused} refused"
    );
}
