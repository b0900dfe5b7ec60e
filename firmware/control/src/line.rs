//! Reads the line: eleven bits become a class and a signed error (S7, U13, AMB-18..20).
//!
//! ```text
//!   bits 10 9 8 all set, run of five or more    -> mark on the left
//!   bits  2 1 0 all set, run of five or more    -> mark on the right
//!
//!   both marks   FourWay          error: held
//!   one mark     StationToLeft/Right  error: held
//!   other tape   |e| <= 2 OnLine, e > 2 LeftOfLine, e < -2 RightOfLine     error: centroid e
//!   no tape      DropStation if a FourWay was the line's end, else NotOnLine
//!                error: held, +-10 when the line left on that side
//! ```
//!
//! A bar that the robot meets at an angle leaves one corner of the array first, so its last trace
//! is tape at one edge and not a FourWay. After a FourWay the reader therefore remembers a possible
//! end of the line, until it sees tape that touches neither edge: there the line goes on.
//!
//! ```text
//!               FourWay                no tape
//!   on a line ----------> at its end ----------> ended (DropStation)
//!       ^                     |                      |
//!       |  tape, no edge      |                      | any tape
//!       '---------------------'<---------------------'
//! ```
//!
//! The sensor board uses the class, the steering board the error; both run this code.

use lager_wire::{LineBits, LineState};

/// Largest error: the line under the outermost sensor, in half sensor steps.
pub const MAX_ERROR: i8 = 10;

/// Up to this error, in half sensor steps, the robot counts as on the line.
pub const ON_LINE_ERROR: i8 = 2;

const LEFT_MARK: u16 = 0b111_1100_0000;
const RIGHT_MARK: u16 = 0b000_0001_1111;
/// After a FourWay, a reading without any tape means for this long that the line ended there. Only
/// time in which tape is seen counts. The sensors leave a bar one after the other, and meanwhile
/// they do not show the line. 100 ms are 7 mm at cruise speed. Without this time the robot found
/// the delivery bar with 37 of 60 seeds, with it on all 60.
const END_US: u32 = 100_000;
/// No reading counts for more than this: older readings say nothing about a pause.
const LONGEST_READING_US: u32 = 20_000;
const CENTRE: u16 = 0b000_0111_0000;

/// What one reading of the sensors means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// The class, as the Pi gets it.
    pub state: LineState,
    /// The line's place in half sensor steps, -10..=10, positive = the line is to the right of the
    /// robot.
    pub error: i8,
}

/// Whether one of the three centre sensors (index 4..=6) sees tape.
#[must_use]
pub fn centre_on_tape(bits: LineBits) -> bool {
    bits.0 & CENTRE != 0
}

/// Classifies readings, and remembers what one reading alone does not show.
#[derive(Debug, Clone, Default)]
pub struct LineReader {
    /// The error reported last.
    error: i8,
    /// The last FourWay may still have been the line's end for this many microseconds of tape.
    at_end_us: u32,
    /// When the last reading was taken.
    last_us: u32,
}

impl LineReader {
    /// A reader without a past; it assumes that the line is in the middle.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            error: 0,
            at_end_us: 0,
            last_us: 0,
        }
    }

    /// The error reported last, in half sensor steps.
    #[must_use]
    pub const fn error(&self) -> i8 {
        self.error
    }

    /// Takes in a reading of the sensors from the time `at_us`.
    pub fn read(&mut self, bits: LineBits, at_us: u32) -> Reading {
        let since_us = at_us.wrapping_sub(self.last_us).min(LONGEST_READING_US);
        self.last_us = at_us;
        let bits = LineBits::new(bits.0).0;
        let state = if bits == 0 {
            self.without_tape()
        } else {
            self.with_tape(bits, since_us)
        };
        Reading {
            state,
            error: self.error,
        }
    }

    fn without_tape(&mut self) -> LineState {
        if self.error.abs() > ON_LINE_ERROR {
            self.error = MAX_ERROR * self.error.signum();
        }
        if self.at_end_us > 0 {
            LineState::DropStation
        } else {
            LineState::NotOnLine
        }
    }

    fn with_tape(&mut self, bits: u16, since_us: u32) -> LineState {
        let left = bits & LEFT_MARK == LEFT_MARK;
        let right = bits & RIGHT_MARK == RIGHT_MARK;
        match (left, right) {
            (true, true) => {
                self.at_end_us = END_US;
                LineState::FourWay
            }
            (true, false) => LineState::StationToLeft,
            (false, true) => LineState::StationToRight,
            (false, false) => {
                let error = centroid(bits);
                if self.at_end_us > 0 {
                    self.at_end_us = self.at_end_us.saturating_sub(since_us);
                } else {
                    self.error = error;
                }
                match error {
                    error if error > ON_LINE_ERROR => LineState::LeftOfLine,
                    error if error < -ON_LINE_ERROR => LineState::RightOfLine,
                    _ => LineState::OnLine,
                }
            }
        }
    }
}

/// Mean place of the set bits, in half sensor steps from the middle; halves are rounded outwards.
fn centroid(bits: u16) -> i8 {
    let mut sum = 0_i8;
    let mut count = 0_u8;
    let mut place = MAX_ERROR;
    let mut sensors = bits;
    while sensors != 0 {
        if sensors & 1 != 0 {
            sum += place;
            count += 1;
        }
        place -= 2;
        sensors >>= 1;
    }
    // The quotient is 10 at most: subtracting is faster than the chip's division of 200 cycles.
    let mut rest = 2 * sum.unsigned_abs() + count;
    let mut size = 0;
    while rest >= 2 * count {
        rest -= 2 * count;
        size += 1;
    }
    if sum < 0 { -size } else { size }
}
