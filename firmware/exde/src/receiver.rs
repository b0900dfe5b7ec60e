//! The receiver's end: sampled bits in, words out.
//!
//! ```text
//!              a pulse: answer it             silence
//!   unanswered -----------------> unaligned ----------> aligned, 0 bits <-- silence --.
//!                                                          | pulse    ^               |
//!                                                          v          |               |
//!                                                       aligned, n bits               |
//!                                                          |      |                   |
//!                                 silence; n = 1: a        |      '-- word full --> complete
//!                                 handshake, answer; else <'                          | pulse:
//!                                 an error, counted                                   '- counted
//! ```
//!
//! Return sync is the only thing the receiver ever sends (X7): for the first pulse it meets and for a pulse
//! that stands alone, which is how a restarted sender asks again.

use crate::timing::reached;
use crate::{Timing, WORD_BITS};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Alignment {
    Unanswered,
    /// Somewhere in a sender's stream, waiting for a silence.
    Unaligned,
    Aligned,
    /// A word was released; before the next silence no pulse belongs to a word.
    Complete,
}

/// Collects sampled bits into words.
#[derive(Debug, Clone)]
pub struct Receiver {
    timing: Timing,
    bits: u8,
    alignment: Alignment,
    /// The shift register of the original (X8), first bit highest.
    register: u16,
    count: u8,
    last_us: u32,
    answer: bool,
    errors: u16,
}

impl Receiver {
    /// A receiver of words of [`WORD_BITS`] bits that has met no sender yet.
    #[must_use]
    pub fn new(timing: Timing) -> Self {
        Self::with_bits(timing, WORD_BITS)
    }

    /// The same for words of `bits` bits, 1..=16.
    #[must_use]
    pub fn with_bits(timing: Timing, bits: u8) -> Self {
        Self {
            timing,
            bits: bits.clamp(1, 16),
            alignment: Alignment::Unanswered,
            register: 0,
            count: 0,
            last_us: 0,
            answer: false,
            errors: 0,
        }
    }

    /// Sync rose at `now_us` with this level on data. The last bit of a word brings the word.
    pub fn on_sync(&mut self, data: bool, now_us: u32) -> Option<u16> {
        self.poll(now_us);
        let since = now_us.wrapping_sub(self.last_us);
        match self.alignment {
            Alignment::Unanswered => {
                self.answer = true;
                self.alignment = Alignment::Unaligned;
                self.last_us = now_us;
                return None;
            }
            Alignment::Unaligned => {
                self.last_us = now_us;
                return None;
            }
            Alignment::Complete => {
                self.last_us = now_us;
                self.count_error();
                return None;
            }
            Alignment::Aligned => {}
        }
        if self.count > 0 && since < self.timing.shortest_us {
            self.count_error();
            return None;
        }
        self.last_us = now_us;
        self.register = self.register << 1 | u16::from(data);
        self.count += 1;
        if self.count < self.bits {
            return None;
        }
        self.count = 0;
        self.alignment = Alignment::Complete;
        Some(self.register & (u16::MAX >> (16 - self.bits)))
    }

    /// Whether a return sync is to be sent now; asking clears it.
    pub fn return_sync(&mut self, now_us: u32) -> bool {
        self.poll(now_us);
        core::mem::take(&mut self.answer)
    }

    /// When [`Receiver::return_sync`] should be asked at the latest; `None` while nothing is begun.
    #[must_use]
    pub fn next_due_us(&self) -> Option<u32> {
        let waiting = match self.alignment {
            Alignment::Unanswered => false,
            Alignment::Unaligned | Alignment::Complete => true,
            Alignment::Aligned => self.count > 0,
        };
        waiting.then(|| self.last_us.wrapping_add(self.timing.idle_us))
    }

    /// Whether a sender has been met.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.alignment != Alignment::Unanswered
    }

    /// Words lost to missing pulses, and disturbing pulses; wraps.
    #[must_use]
    pub fn errors(&self) -> u16 {
        self.errors
    }

    fn poll(&mut self, now_us: u32) {
        let silent = reached(now_us, self.last_us.wrapping_add(self.timing.idle_us));
        match self.alignment {
            Alignment::Unaligned | Alignment::Complete if silent => {
                self.alignment = Alignment::Aligned;
            }
            Alignment::Aligned if silent && self.count > 0 => {
                if self.count == 1 {
                    self.answer = true;
                } else {
                    self.count_error();
                }
                self.count = 0;
            }
            _ => {}
        }
    }

    fn count_error(&mut self) {
        self.errors = self.errors.wrapping_add(1);
    }
}
