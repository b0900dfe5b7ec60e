//! The master of the servos' wire: one question at a time, every wait bounded.
//!
//! ```text
//!            send                     answer of the right servo
//!   idle ------------> waiting ------------------------------------> Answer::Status
//!    ^                  |   ^
//!    |         time out |   | once more
//!    |                  v   |
//!    '-- Answer::None <-- second time out
//! ```
//!
//! One wire carries both directions (A1), so nothing is sent while an answer may come. Bytes that
//! arrive unasked, answers of other servos and answers with a wrong checksum are no answers.

use heapless::Vec;
use lager_ax12::{ErrorBits, Frame, StatusDecoder, table};

use crate::SteeringBoard;
use crate::time::reached;

/// How often a question is put before the servo counts as not answering.
const ATTEMPTS: u8 = 2;

/// The most bytes of an answer that one poll takes in, so that the wheels do not wait for a whole
/// one.
const MOST_BYTES: u8 = 4;

/// Registers read at once: present position to moving.
pub(crate) const LOOK_LENGTH: u8 = table::MOVING - table::PRESENT_POSITION_L + 1;

/// What a servo says about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Look {
    pub(crate) position: u16,
    pub(crate) load: i16,
    pub(crate) decivolts: u8,
    pub(crate) celsius: u8,
    pub(crate) moving: bool,
}

impl Look {
    fn from_registers(registers: &[u8]) -> Option<Self> {
        let registers: &[u8; LOOK_LENGTH as usize] = registers.try_into().ok()?;
        Some(Self {
            position: u16::from_le_bytes([registers[0], registers[1]]).min(table::MAX_POSITION),
            load: table::signed(u16::from_le_bytes([registers[4], registers[5]])),
            decivolts: registers[6],
            celsius: registers[7],
            moving: registers[10] != 0,
        })
    }
}

/// What became of a question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The servo answered; `look` when registers were asked for and came whole.
    Status {
        errors: ErrorBits,
        look: Option<Look>,
    },
    /// It did not, twice.
    None,
}

/// The longest question: a write of six registers. A whole [`Frame`] takes the chip five times as
/// long to move.
const LONGEST: usize = 13;

#[derive(Debug, Clone)]
struct Question {
    bytes: Vec<u8, LONGEST>,
    id: u8,
    /// Time out of this attempt.
    due_us: u32,
    attempt: u8,
    /// Whether the board took the bytes of this attempt.
    sent: bool,
}

/// The wire and the question under way.
#[derive(Debug, Clone)]
pub(crate) struct ServoBus {
    decoder: StatusDecoder,
    question: Option<Question>,
    reply_timeout_us: u32,
    timeouts: u8,
    /// Whether the last poll left bytes behind.
    more: bool,
}

impl ServoBus {
    pub(crate) const fn new(reply_timeout_us: u32) -> Self {
        Self {
            decoder: StatusDecoder::new(),
            question: None,
            reply_timeout_us,
            timeouts: 0,
            more: false,
        }
    }

    pub(crate) fn is_idle(&self) -> bool {
        self.question.is_none()
    }

    /// Questions that stayed without an answer after both attempts, saturating.
    pub(crate) fn timeouts(&self) -> u8 {
        self.timeouts
    }

    /// When [`ServoBus::poll`] is wanted: at once, or when a waiting question times out.
    pub(crate) fn next_due_us(&self, now_us: u32) -> Option<u32> {
        let question = self.question.as_ref()?;
        Some(if self.more { now_us } else { question.due_us })
    }

    /// Asks a servo for its present state.
    pub(crate) fn look(&mut self, id: u8, board: &mut impl SteeringBoard, now_us: u32) {
        let frame = Frame::read(id, table::PRESENT_POSITION_L, LOOK_LENGTH);
        self.ask(&frame, id, board, now_us);
    }

    /// Sets goal position, speed and torque limit in one write. The torque limit goes along because
    /// a servo that switched itself off has it at 0.
    pub(crate) fn set_goal(
        &mut self,
        id: u8,
        (goal, speed, torque_limit): (u16, u16, u16),
        board: &mut impl SteeringBoard,
        now_us: u32,
    ) {
        let mut values = [0; 6];
        for (place, value) in values.chunks_exact_mut(2).zip([goal, speed, torque_limit]) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        self.write(id, table::GOAL_POSITION_L, &values, board, now_us);
    }

    /// Switches a servo's torque on.
    pub(crate) fn switch_on(&mut self, id: u8, board: &mut impl SteeringBoard, now_us: u32) {
        self.write(id, table::TORQUE_ENABLE, &[1], board, now_us);
    }

    /// Takes in some of what the servos sent; the answer, when the question is settled.
    pub(crate) fn poll(&mut self, board: &mut impl SteeringBoard, now_us: u32) -> Option<Answer> {
        self.more = false;
        for _ in 0..MOST_BYTES {
            let Some(byte) = board.servo_read() else {
                return self.wait(board, now_us);
            };
            let asked = self.question.as_ref().map(|question| question.id);
            let mut packet = self.decoder.push(byte);
            while let Some(status) = packet {
                if asked == Some(status.id) {
                    let answer = Answer::Status {
                        errors: status.errors(),
                        look: Look::from_registers(status.parameters),
                    };
                    self.question = None;
                    self.decoder.reset();
                    return Some(answer);
                }
                packet = self.decoder.pending();
            }
        }
        self.more = true;
        None
    }

    fn wait(&mut self, board: &mut impl SteeringBoard, now_us: u32) -> Option<Answer> {
        let question = self.question.as_mut()?;
        if !question.sent {
            question.sent = board.servo_write(&question.bytes);
            if question.sent {
                // The servo has its whole time, counted from when it was asked.
                question.due_us = now_us.wrapping_add(self.reply_timeout_us);
            }
        }
        if !reached(now_us, question.due_us) {
            return None;
        }
        self.decoder.reset();
        question.attempt += 1;
        if question.attempt < ATTEMPTS {
            question.due_us = now_us.wrapping_add(self.reply_timeout_us);
            question.sent = board.servo_write(&question.bytes);
            return None;
        }
        self.question = None;
        self.timeouts = self.timeouts.saturating_add(1);
        Some(Answer::None)
    }

    fn write(
        &mut self,
        id: u8,
        address: u8,
        values: &[u8],
        board: &mut impl SteeringBoard,
        now_us: u32,
    ) {
        let frame = Frame::write(id, address, values);
        debug_assert!(frame.is_ok(), "at most six registers are written");
        if let Ok(frame) = frame {
            self.ask(&frame, id, board, now_us);
        }
    }

    fn ask(&mut self, frame: &Frame, id: u8, board: &mut impl SteeringBoard, now_us: u32) {
        let bytes = Vec::from_slice(frame.as_bytes());
        debug_assert!(
            bytes.is_ok(),
            "a question is no longer than a write of six registers"
        );
        let Ok(bytes) = bytes else {
            return;
        };
        self.decoder.reset();
        let sent = board.servo_write(&bytes);
        let due_us = now_us.wrapping_add(self.reply_timeout_us);
        self.question = Some(Question {
            bytes,
            id,
            due_us,
            attempt: 0,
            sent,
        });
    }
}
