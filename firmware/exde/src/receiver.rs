//! The receiver: turns sampled bits into words.
//!
//! ```text
//!              a pulse               silence: answer
//!   unanswered ---------> unaligned -----------------> aligned, 0 bits <-- silence --.
//!                                                         | pulse    ^               |
//!                                                         v          |               |
//!                                                      aligned, n bits               |
//!                                                         |      |                   |
//!                                silence; n = 1: a        |      '-- word full --> complete
//!                                handshake, answer; else <'                          | pulse:
//!                                an error, counted                                   '- counted
//! ```
//!
//! The receiver sends nothing but return sync (X7): after the first pulse of all, and after a
//! single pulse, by which a restarted sender asks again. It reads no clock: a timer, which every
//! pulse restarts, reports the silence.

use crate::{Timing, WORD_BITS};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Alignment {
    Unanswered,
    /// In the middle of a sender's pulses, waiting for a silence.
    Unaligned,
    Aligned,
    /// A word is complete; until the next silence any pulse is an error.
    Complete,
}

/// The register before the first bit of a word.
const NO_BITS: u16 = 1;

/// Collects sampled bits into words.
#[derive(Debug, Clone)]
pub struct Receiver {
    bits: u8,
    alignment: Alignment,
    /// The original's shift register (X8), first bit highest. Above the bits stands a mark: a set
    /// bit whose position tells how many bits have come.
    register: u16,
    answer: bool,
    errors: u8,
}

impl Receiver {
    /// A receiver of words of [`WORD_BITS`] bits that has heard no sender yet.
    #[must_use]
    pub const fn new() -> Self {
        Self::with_bits(WORD_BITS)
    }

    /// A receiver of words of `bits` bits, 1..=15.
    #[must_use]
    pub const fn with_bits(bits: u8) -> Self {
        assert!(1 <= bits && bits <= 15);
        Self {
            bits,
            alignment: Alignment::Unanswered,
            register: NO_BITS,
            answer: false,
            errors: 0,
        }
    }

    /// Sync rose while data had this level, `since_us` after the rise before; after a silence
    /// `since_us` may be anything. Returns a word with its last bit.
    #[inline(always)]
    pub fn on_sync(&mut self, data: bool, since_us: u16) -> Option<u16> {
        match self.alignment {
            Alignment::Aligned
                if since_us < Timing::STANDARD.shortest_us && self.register != NO_BITS =>
            {
                self.count_error();
                None
            }
            Alignment::Aligned => self.shift_in(data),
            Alignment::Complete => {
                self.count_error();
                None
            }
            Alignment::Unaligned => None,
            Alignment::Unanswered => {
                self.answer = true;
                self.alignment = Alignment::Unaligned;
                None
            }
        }
    }

    /// No pulse has come for [`Timing::idle_us`]; to be called once after the last pulse. Returns
    /// whether to send one pulse on return sync now.
    #[must_use = "the sender waits for its answer"]
    pub fn on_silence(&mut self) -> bool {
        match self.alignment {
            Alignment::Unanswered => {}
            Alignment::Unaligned | Alignment::Complete => self.alignment = Alignment::Aligned,
            Alignment::Aligned => match self.register >> 1 {
                0 => {}
                NO_BITS => self.answer = true,
                _ => self.count_error(),
            },
        }
        self.register = NO_BITS;
        core::mem::take(&mut self.answer)
    }

    /// Whether a sender was heard.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.alignment != Alignment::Unanswered
    }

    /// Whether a word is half received.
    #[must_use]
    pub fn is_midway(&self) -> bool {
        self.register != NO_BITS
    }

    /// Words lost to missing pulses plus disturbing pulses; stays at 255.
    #[must_use]
    pub fn errors(&self) -> u8 {
        self.errors
    }

    #[inline(always)]
    fn shift_in(&mut self, data: bool) -> Option<u16> {
        self.register = self.register << 1 | u16::from(data);
        let mark = 1 << self.bits;
        if self.register & mark == 0 {
            return None;
        }
        let word = self.register ^ mark;
        self.register = NO_BITS;
        self.alignment = Alignment::Complete;
        Some(word)
    }

    #[inline(always)]
    fn count_error(&mut self) {
        // This runs in the interrupt, so it calculates nothing that it does not store.
        if let Some(errors) = self.errors.checked_add(1) {
            self.errors = errors;
        }
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}
