//! Bytes in any pieces become lines; a bad line does not damage its neighbours.

use lager_lines::MAX_LINE;
use lager_lines::splitter::{LineError, LineSplitter};
use proptest::prelude::*;

use crate::laws::split;

fn all(bytes: &[u8]) -> Vec<Result<String, LineError>> {
    split(bytes, bytes.len())
}

fn good(lines: &[&str]) -> Vec<Result<String, LineError>> {
    lines.iter().map(|line| Ok((*line).to_owned())).collect()
}

#[test]
fn both_line_ends_end_a_line_and_an_empty_line_is_one() {
    assert_eq!(
        all(b"karta\nprodlis\r\n\n\r\nx"),
        good(&["karta", "prodlis", "", ""])
    );
}

#[test]
fn only_the_cr_right_before_the_lf_belongs_to_the_end() {
    assert_eq!(all(b"a\rb\r\r\n"), good(&["a\rb\r"]));
}

#[test]
fn the_longest_line_passes_with_either_end() {
    let longest = "x".repeat(MAX_LINE);
    for end in ["\n", "\r\n"] {
        let bytes = format!("{longest}{end}karta\n");
        assert_eq!(all(bytes.as_bytes()), good(&[&longest, "karta"]));
    }
}

#[test]
fn a_line_too_long_is_refused_once_and_the_next_one_is_whole() {
    for (length, end) in [
        (MAX_LINE + 1, "\n"),
        (MAX_LINE + 1, "\r\n"),
        (MAX_LINE + 2, "\n"),
        (1 << 20, "\r\n"),
    ] {
        let bytes = format!("{}{end}karta\n", "x".repeat(length));
        let expected = vec![Err(LineError::TooLong), Ok("karta".to_owned())];
        assert_eq!(all(bytes.as_bytes()), expected, "{length} bytes");
    }
}

#[test]
fn a_cr_beyond_the_limit_without_its_lf_makes_the_line_too_long() {
    let bytes = format!("{}\rx\nkarta\n", "x".repeat(MAX_LINE));
    assert_eq!(
        all(bytes.as_bytes()),
        [Err(LineError::TooLong), Ok("karta".to_owned())]
    );
}

#[test]
fn a_line_too_long_is_refused_before_it_ends() {
    let mut splitter = LineSplitter::new();
    let bytes = vec![b'x'; MAX_LINE + 1];
    assert_eq!(
        splitter.next(&mut &bytes[..]),
        Some(Err(LineError::TooLong))
    );
    assert_eq!(
        splitter.pending(),
        0,
        "of a refused line nothing is awaited"
    );
}

#[test]
fn what_is_not_utf_8_is_refused_with_its_place() {
    let lines = all(b"th\xC3\xA5ught \xC3(\nkarta\n\xE2\x82\nprodlis\n");
    let at = |column| Err(LineError::NotUtf8 { column });
    let text = |text: &str| Ok(text.to_owned());
    assert_eq!(lines, [at(9), text("karta"), at(1), text("prodlis")]);
}

#[test]
fn a_half_line_is_no_line() {
    let mut splitter = LineSplitter::new();
    assert_eq!(
        splitter.next(&mut &b"karta\nstyrcomm 2"[..]),
        Some(Ok("karta"))
    );
    assert_eq!(splitter.pending(), 0);
    assert_eq!(splitter.next(&mut &b"styrcomm 2"[..]), None);
    assert_eq!(splitter.pending(), 10);
}

#[test]
fn the_refusals_say_what_to_do() {
    assert_eq!(
        LineError::TooLong.to_string(),
        "the line has more than 1024 bytes; send shorter ones"
    );
    assert_eq!(
        LineError::NotUtf8 { column: 4 }.to_string(),
        "column 4: here the line is not UTF-8; send it in that encoding"
    );
}

proptest! {
    #[test]
    fn pieces_do_not_matter(
        bytes in prop::collection::vec(prop_oneof![
            Just(b'\n'), Just(b'\r'), Just(b'a'), Just(0xC3), Just(0xA5), any::<u8>()
        ], 0..4000),
        size in 1_usize..1500,
    ) {
        prop_assert_eq!(split(&bytes, size), split(&bytes, bytes.len()));
    }

    #[test]
    fn what_was_sent_as_lines_comes_as_lines(
        lines in prop::collection::vec("[^\r\n]{0,200}", 0..20),
    ) {
        let bytes: String = lines.iter().map(|line| format!("{line}\r\n")).collect();
        let got: Result<Vec<_>, _> = split(bytes.as_bytes(), 5).into_iter().collect();
        prop_assert_eq!(got.expect("good lines"), lines);
    }
}
