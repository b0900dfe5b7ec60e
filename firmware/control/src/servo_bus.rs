//! The master of the servos' wire: it asks one question at a time and limits every wait.
//!
//! ```text
//!            send                     answer of the right servo
//!   idle ------------> waiting ------------------------------------> ServoAnswer::Status
//!    ^                  |   ^
//!    |         time out |   | once more
//!    |                  v   |
//!    '-- ServoAnswer::None <-- second time out
//! ```
//!
//! One wire carries both directions (A1), so the board sends nothing while an answer may come. It
//! ignores unasked bytes, answers of other servos and answers with a wrong checksum.

use heapless::Vec;
use lager_ax12::{ErrorBits, Frame, StatusDecoder, table};

use crate::SteeringBoard;
use crate::time::reached;

/// How often the board asks before the servo counts as not answering.
const ATTEMPTS: u8 = 2;

/// The most bytes of an answer that one poll takes in; the wheels would wait too long for a whole
/// answer.
const MOST_BYTES: u8 = 4;

/// Registers that one look reads: from the present position to the moving flag.
pub(crate) const LOOK_LENGTH: u8 = table::MOVING - table::PRESENT_POSITION_L + 1;

/// A servo's state, as it reports it.
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

/// How a question ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ServoAnswer {
    /// The servo answered; `look` if the question read registers and all came.
    Status {
        errors: ErrorBits,
        look: Option<Look>,
    },
    /// The servo did not answer twice.
    None,
}

/// The longest question: it writes six registers. To move a whole [`Frame`] takes the chip five
/// times as long.
const LONGEST: usize = 13;

#[derive(Debug, Clone)]
struct Question {
    bytes: Vec<u8, LONGEST>,
    id: u8,
    /// When this attempt times out.
    due_us: u32,
    attempt: u8,
    /// Whether the board took the bytes of this attempt.
    sent: bool,
}

/// The wire, and the question under way.
#[derive(Debug, Clone)]
pub(crate) struct ServoBus {
    decoder: StatusDecoder,
    question: Option<Question>,
    reply_timeout_us: u32,
    timeouts: u8,
    /// Whether the last poll left bytes unread.
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

    /// Questions without an answer after both attempts; stays at 255.
    pub(crate) fn timeouts(&self) -> u8 {
        self.timeouts
    }

    /// When [`ServoBus::poll`] must be called: at once, or when the question times out.
    pub(crate) fn next_due_us(&self, now_us: u32) -> Option<u32> {
        let question = self.question.as_ref()?;
        Some(if self.more { now_us } else { question.due_us })
    }

    /// Asks a servo for its present state.
    pub(crate) fn look(&mut self, id: u8, board: &mut impl SteeringBoard, now_us: u32) {
        let frame = Frame::read(id, table::PRESENT_POSITION_L, LOOK_LENGTH);
        self.ask(&frame, id, board, now_us);
    }

    /// Sets goal position, speed and torque limit in one write. A servo that has switched itself
    /// off has a torque limit of 0, so the limit is always written too.
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

    /// Switches a servo's torque on or off.
    pub(crate) fn switch(
        &mut self,
        id: u8,
        is_on: bool,
        board: &mut impl SteeringBoard,
        now_us: u32,
    ) {
        self.write(id, table::TORQUE_ENABLE, &[is_on.into()], board, now_us);
    }

    /// Takes in some of the servos' bytes. Returns the answer when the question has ended.
    pub(crate) fn poll(
        &mut self,
        board: &mut impl SteeringBoard,
        now_us: u32,
    ) -> Option<ServoAnswer> {
        self.more = false;
        for _ in 0..MOST_BYTES {
            let Some(byte) = board.servo_read() else {
                return self.wait(board, now_us);
            };
            let asked = self.question.as_ref().map(|question| question.id);
            let mut packet = self.decoder.push(byte);
            while let Some(status) = packet {
                if asked == Some(status.id) {
                    let answer = ServoAnswer::Status {
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

    fn wait(&mut self, board: &mut impl SteeringBoard, now_us: u32) -> Option<ServoAnswer> {
        let question = self.question.as_mut()?;
        if !question.sent {
            question.sent = board.servo_write(&question.bytes);
            if question.sent {
                // The servo's time counts from when the board took the question.
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
        Some(ServoAnswer::None)
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
