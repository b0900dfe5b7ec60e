//! Reading the line: eleven bits in, a class and a signed error out (S7, U13, AMB-18..20).
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
//! A bar that is met at an angle leaves one corner of the array first, so its last trace is not a
//! FourWay but tape at one edge. So the reader remembers a possible end of the line from a FourWay
//! until it sees tape that touches neither edge, which is what a line that goes on looks like:
//!
//! ```text
//!               FourWay                no tape
//!   on a line ----------> at its end ----------> ended (DropStation)
//!       ^                     |                      |
//!       |  tape, no edge      |                      | any tape
//!       '---------------------'<---------------------'
//! ```
//!
//! The sensor board takes the class, the steering board the error; both read with the same code.

use lager_wire::{LineBits, LineState};

/// Largest error: the line under the outermost sensor, in half sensor steps.
pub const MAX_ERROR: i8 = 10;

/// Up to this error, in half sensor steps, the robot counts as on the line.
pub const ON_LINE_ERROR: i8 = 2;

const LEFT_MARK: u16 = 0b111_1100_0000;
const RIGHT_MARK: u16 = 0b000_0001_1111;
/// Time after a FourWay, counted while tape is seen, in which no tape at all still means that the
/// line ended there. The sensors leave a bar one after the other, and what they show meanwhile is
/// no line. 100 ms are 7 mm at cruise speed. Without this time 37 of 60 seeds found the delivery
/// bar, with it all.
const END_US: u32 = 100_000;
/// No reading counts for more than this: after a pause the readings before tell nothing about it.
const LONGEST_READING_US: u32 = 20_000;
const CENTRE: u16 = 0b000_0111_0000;

/// What one reading of the sensors means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// The class the Pi is told.
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

/// Classifies readings; holds what a reading alone does not tell.
#[derive(Debug, Clone, Default)]
pub struct LineReader {
    /// The error reported last.
    error: i8,
    /// For this many more microseconds of the line itself the FourWay before may have been its end.
    at_end_us: u32,
    /// When the last reading was taken.
    last_us: u32,
}

impl LineReader {
    /// A reader that has seen nothing and supposes the line in the middle.
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

    /// Takes in one reading of the sensors, taken at `at_us`.
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

/// Mean place of the set bits in half sensor steps from the middle, halves rounded away from it.
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
    // The quotient is 10 at most, so taking away is faster than the chip's division of 200 cycles.
    let mut rest = 2 * sum.unsigned_abs() + count;
    let mut size = 0;
    while rest >= 2 * count {
        rest -= 2 * count;
        size += 1;
    }
    if sum < 0 { -size } else { size }
}
