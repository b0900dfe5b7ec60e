//! Checks the line's classes and error, for single patterns and on realistic tracks.

use lager_control::line::{LineReader, MAX_ERROR, Reading, centre_on_tape};
use lager_wire::{LineBits, LineState};

fn mirrored(bits: u16) -> u16 {
    (0..11).fold(0, |mirror, bit| mirror << 1 | (bits >> bit & 1))
}

fn mirrored_state(state: LineState) -> LineState {
    match state {
        LineState::LeftOfLine => LineState::RightOfLine,
        LineState::RightOfLine => LineState::LeftOfLine,
        LineState::StationToLeft => LineState::StationToRight,
        LineState::StationToRight => LineState::StationToLeft,
        other => other,
    }
}

fn read(bits: u16) -> Reading {
    LineReader::new().read(LineBits(bits), 0)
}

/// A reader that gets a reading every `period_us`.
struct Paced {
    reader: LineReader,
    period_us: u32,
    now_us: u32,
}

impl Paced {
    fn every(period_us: u32) -> Self {
        Self {
            reader: LineReader::new(),
            period_us,
            now_us: u32::MAX - 20_000,
        }
    }

    fn read(&mut self, bits: u16) -> Reading {
        self.now_us = self.now_us.wrapping_add(self.period_us);
        self.reader.read(LineBits(bits), self.now_us)
    }
}

#[test]
fn every_pattern_has_a_class_and_an_error_in_range() {
    let mut seen = std::collections::HashSet::new();
    for bits in 0..2048 {
        let reading = read(bits);
        assert!(reading.error.abs() <= MAX_ERROR, "{bits:011b}");
        assert_eq!(
            reading.state == LineState::NotOnLine,
            bits == 0,
            "{bits:011b}"
        );
        seen.insert(reading.state.code());
    }
    assert_eq!(seen.len(), 7, "all but DropStation, which needs a past");
}

#[test]
fn mirrored_patterns_mirror() {
    for bits in 0..2048 {
        let (one, other) = (read(bits), read(mirrored(bits)));
        assert_eq!(one.error, -other.error, "{bits:011b}");
        assert_eq!(one.state, mirrored_state(other.state), "{bits:011b}");
    }
}

#[test]
fn mirrored_pasts_mirror() {
    // A generator of fixed patterns feeds two readers; one of them sees the mirror image.
    let (mut one, mut other) = (LineReader::new(), LineReader::new());
    let mut state = 0x2545_u32;
    for _ in 0..50_000 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let bits = match state >> 29 {
            0 => 0,
            1 => 0x7FF,
            _ => (state >> 12) as u16 & 0x7FF,
        };
        let (a, b) = (
            one.read(LineBits(bits), 0),
            other.read(LineBits(mirrored(bits)), 0),
        );
        assert_eq!(a.error, -b.error);
        assert_eq!(a.state, mirrored_state(b.state));
    }
}

#[test]
fn patterns_have_the_errors_worked_out_by_hand() {
    for (bits, error, state) in [
        (0b00000100000, 0, LineState::OnLine),
        (0b00000110000, 1, LineState::OnLine),
        (0b00000010000, 2, LineState::OnLine),
        (0b00000011000, 3, LineState::LeftOfLine),
        (0b00001110000, 0, LineState::OnLine),
        (0b01110000000, -6, LineState::RightOfLine),
        (0b10000000000, -10, LineState::RightOfLine),
        (0b00000000001, 10, LineState::LeftOfLine),
        // (0 + 2 + 10) / 3 = 4
        (0b00000110001, 4, LineState::LeftOfLine),
        // (-10 + 2) / 2
        (0b10000010000, -4, LineState::RightOfLine),
        // (0 + 2 + 4 + 6) / 4 = 3; four sensors are no mark
        (0b00000111100, 3, LineState::LeftOfLine),
        // (4 + 6 + 8 + 10) / 4 = 7; four sensors at the edge are no mark either
        (0b00000001111, 7, LineState::LeftOfLine),
        (0b00000011111, 0, LineState::StationToRight),
        (0b11111000000, 0, LineState::StationToLeft),
        (0b11111111110, 0, LineState::StationToLeft),
        (0b01111111111, 0, LineState::StationToRight),
        (0b01111111110, 0, LineState::OnLine),
        (0b11111011111, 0, LineState::FourWay),
        (0b11111111111, 0, LineState::FourWay),
    ] {
        assert_eq!(read(bits), Reading { state, error }, "{bits:011b}");
    }
}

#[test]
fn bits_above_the_sensors_mean_nothing() {
    assert_eq!(read(0xF800), read(0));
    assert_eq!(read(0xF800 | 0b00000011000), read(0b00000011000));
}

#[test]
fn a_mark_holds_the_error() {
    for mark in [0b11111110000, 0b00000011111, 0b11111111111] {
        let mut reader = LineReader::new();
        reader.read(LineBits(0b00000011000), 0);
        assert_eq!(reader.read(LineBits(mark), 5_000).error, 3);
        assert_eq!(reader.error(), 3);
    }
}

#[test]
fn a_line_that_left_on_a_side_is_remembered_there() {
    for (last, held) in [
        (0b00000000011, 10),
        (0b00000011000, 10),
        (0b11000000000, -10),
        (0b00000100000, 0),
        (0b00000110000, 1),
        (0b00001000000, -2),
    ] {
        let mut reader = LineReader::new();
        reader.read(LineBits(last), 0);
        for _ in 0..3 {
            let reading = reader.read(LineBits(0), 5_000);
            assert_eq!(
                reading,
                Reading {
                    state: LineState::NotOnLine,
                    error: held
                },
                "{last:011b}"
            );
        }
    }
}

#[test]
fn the_end_is_latched_until_tape_is_seen() {
    let mut reader = Paced::every(5_000);
    let mut state = |bits| reader.read(bits).state;
    assert_eq!(state(0b00000100000), LineState::OnLine);
    assert_eq!(state(0), LineState::NotOnLine);
    assert_eq!(state(0x7FF), LineState::FourWay);
    assert_eq!(state(0), LineState::DropStation);
    assert_eq!(state(0), LineState::DropStation);
    assert_eq!(
        state(0b00000000001),
        LineState::LeftOfLine,
        "a last sensor leaves the bar"
    );
    assert_eq!(state(0), LineState::DropStation);
    for _ in 0..20 {
        assert_eq!(state(0b00000100000), LineState::OnLine);
    }
    assert_eq!(
        state(0),
        LineState::NotOnLine,
        "a crossing, and a line that ended later"
    );
}

#[test]
fn how_long_the_end_is_latched_does_not_hang_on_the_pace() {
    for period_us in [450, 5_000, 12_000] {
        let mut reader = Paced::every(period_us);
        reader.read(0b00000100000);
        reader.read(0x7FF);
        for _ in 0..100_000 / period_us - 1 {
            reader.read(0b00000000001);
        }
        assert_eq!(reader.read(0).state, LineState::DropStation, "{period_us}");
        for _ in 0..3 {
            reader.read(0b00000100000);
        }
        assert_eq!(reader.read(0).state, LineState::NotOnLine, "{period_us}");
    }
}

#[test]
fn the_centre_is_the_three_middle_sensors() {
    for bit in 0..11 {
        assert_eq!(centre_on_tape(LineBits(1 << bit)), (4..=6).contains(&bit));
    }
}

/// A strip of tape: its middle, half its length (mm), and its angle to the driving direction (rad).
struct Tape {
    x: f64,
    y: f64,
    half_length: f64,
    angle: f64,
}

const HALF_WIDTH: f64 = 7.5;
const PITCH: f64 = 7.0;

impl Tape {
    fn covers(&self, x: f64, y: f64) -> bool {
        let (sin, cos) = self.angle.sin_cos();
        let (dx, dy) = (x - self.x, y - self.y);
        let along = dx * cos + dy * sin;
        let across = -dx * sin + dy * cos;
        along.abs() <= self.half_length && across.abs() <= HALF_WIDTH
    }
}

/// The line straight ahead (x forwards, y to the left), from `from` to `to` in mm.
fn line(from: f64, to: f64) -> Tape {
    Tape {
        x: f64::midpoint(from, to),
        y: 0.0,
        half_length: (to - from) / 2.0,
        angle: 0.0,
    }
}

/// A strip across the line at x = 0, from `right` to `left`, both in mm from the line.
fn across(right: f64, left: f64) -> Tape {
    Tape {
        x: 0.0,
        y: f64::midpoint(left, right),
        half_length: (left - right) / 2.0,
        angle: std::f64::consts::FRAC_PI_2,
    }
}

/// Drives the array over the track at an angle in degrees (positive = turned left) and an offset to
/// the left in mm. Returns the states in order, without repetitions.
fn sweep(track: &[Tape], degrees: f64, offset: f64) -> Vec<LineState> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let mut reader = Paced::every(5_000);
    let mut states = Vec::new();
    // The array passes x = 0 at the offset. At 73 mm/s and 5 ms a reading, a step is 0.37 mm.
    let mut s = -70.0;
    while s < 120.0 {
        let (x, y) = (s * cos, offset + s * sin);
        let mut bits = 0;
        for index in 0..11 {
            let left = (5.0 - f64::from(index)) * PITCH;
            let (px, py) = (x - left * sin, y + left * cos);
            let tape = track.iter().any(|tape| tape.covers(px, py));
            bits = bits << 1 | u16::from(tape);
        }
        let state = reader.read(bits).state;
        if states.last() != Some(&state) {
            states.push(state);
        }
        s += 0.37;
    }
    states
}

fn angles() -> impl Iterator<Item = f64> {
    (-10..=10).map(f64::from)
}

fn offsets() -> impl Iterator<Item = f64> {
    (-6..=6).map(f64::from)
}

fn each(track: &[Tape], check: impl Fn(f64, f64, &[LineState])) {
    for degrees in angles() {
        for offset in offsets() {
            check(degrees, offset, &sweep(track, degrees, offset));
        }
    }
}

#[test]
fn a_crossing_is_a_four_way_and_never_the_end() {
    let track = [line(-300.0, 300.0), across(-300.0, 300.0)];
    each(&track, |degrees, offset, states| {
        assert!(
            states.contains(&LineState::FourWay),
            "{degrees} {offset} {states:?}"
        );
        assert!(
            !states.contains(&LineState::DropStation),
            "{degrees} {offset} {states:?}"
        );
        assert!(
            !states.contains(&LineState::NotOnLine),
            "{degrees} {offset} {states:?}"
        );
    });
    assert_eq!(
        sweep(&track, 0.0, 0.0),
        [LineState::OnLine, LineState::FourWay, LineState::OnLine]
    );
}

#[test]
fn a_bar_at_the_lines_end_is_a_four_way_and_then_the_end() {
    let track = [line(-300.0, 0.0), across(-150.0, 150.0)];
    each(&track, |degrees, offset, states| {
        assert!(
            states.contains(&LineState::FourWay),
            "{degrees} {offset} {states:?}"
        );
        assert_eq!(
            states.last(),
            Some(&LineState::DropStation),
            "{degrees} {offset} {states:?}"
        );
    });
    assert_eq!(
        sweep(&track, 0.0, 0.0),
        [
            LineState::OnLine,
            LineState::FourWay,
            LineState::DropStation
        ]
    );
}

#[test]
fn a_mark_is_a_station_on_its_side_only() {
    for (right, left, wanted, other) in [
        (
            0.0,
            170.0,
            LineState::StationToLeft,
            LineState::StationToRight,
        ),
        (
            -170.0,
            0.0,
            LineState::StationToRight,
            LineState::StationToLeft,
        ),
        (
            0.0,
            100.0,
            LineState::StationToLeft,
            LineState::StationToRight,
        ),
    ] {
        let track = [line(-300.0, 300.0), across(right, left)];
        each(&track, |degrees, offset, states| {
            assert!(states.contains(&wanted), "{degrees} {offset} {states:?}");
            assert!(!states.contains(&other), "{degrees} {offset} {states:?}");
            assert!(
                !states.contains(&LineState::FourWay),
                "{degrees} {offset} {states:?}"
            );
            assert!(
                !states.contains(&LineState::NotOnLine),
                "{degrees} {offset} {states:?}"
            );
            assert!(
                !states.contains(&LineState::DropStation),
                "{degrees} {offset} {states:?}"
            );
        });
    }
}

#[test]
fn a_corner_is_a_one_sided_mark_and_then_no_line() {
    let track = [line(-300.0, 0.0), across(0.0, 300.0)];
    each(&track, |degrees, offset, states| {
        assert!(
            states.contains(&LineState::StationToLeft),
            "{degrees} {offset} {states:?}"
        );
        assert_eq!(
            states.last(),
            Some(&LineState::NotOnLine),
            "{degrees} {offset} {states:?}"
        );
    });
}

#[test]
fn a_line_crossed_at_a_slant_goes_from_side_to_side() {
    // A turn on the spot sweeps the array off the line like this.
    let track = [line(-300.0, 300.0)];
    for (degrees, side) in [
        (20.0, LineState::LeftOfLine),
        (35.0, LineState::LeftOfLine),
        (50.0, LineState::LeftOfLine),
        (-35.0, LineState::RightOfLine),
    ] {
        let states = sweep(&track, degrees, 0.0);
        let end = [LineState::OnLine, side, LineState::NotOnLine];
        assert!(states.ends_with(&end), "{degrees} {states:?}");
        assert!(
            states.iter().all(|state| state.code() < 4),
            "{degrees} {states:?}"
        );
    }
}

#[test]
fn all_eight_states_come_from_tracks() {
    let mut seen = std::collections::HashSet::new();
    for track in [
        vec![line(-300.0, 300.0), across(-300.0, 300.0)],
        vec![line(-300.0, 0.0), across(-150.0, 150.0)],
        vec![line(-300.0, 300.0), across(0.0, 170.0)],
        vec![line(-300.0, 300.0), across(-170.0, 0.0)],
        vec![line(-300.0, 0.0)],
    ] {
        for offset in [-20.0, 0.0, 20.0] {
            seen.extend(sweep(&track, 0.0, offset).iter().map(|state| state.code()));
        }
    }
    let mut seen: Vec<u8> = seen.into_iter().collect();
    seen.sort_unstable();
    assert_eq!(seen, [0, 1, 2, 3, 4, 5, 6, 7]);
}
