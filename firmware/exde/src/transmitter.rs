//! The sender's end: a machine that sets one edge per call.
//!
//! ```text
//!               return sync seen              start(word)
//!   handshake ------------------> ready ------------------> lead --> pulse --> tail
//!     |   ^                         ^                        ^                  |
//!     '---' a pulse on sync         |  gap over              '---- next bit ----|
//!           every handshake_us      '------- gap <------------- last bit -------'
//! ```
//!
//! Two edges never share a call and their distance is counted from when the earlier one was really set, so a
//! sender that is stepped late sends slowly and still correctly.

use crate::timing::reached;
use crate::{Timing, WORD_BITS};

/// Levels of the sender's two wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pins {
    /// The data wire.
    pub data: bool,
    /// The sync wire.
    pub sync: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    HandshakePause,
    HandshakePulse,
    Ready,
    Lead,
    Pulse,
    Tail,
    Gap,
}

/// Sends words bit by bit once the receiver has answered.
#[derive(Debug, Clone)]
pub struct Transmitter {
    timing: Timing,
    bits: u8,
    phase: Phase,
    due_us: u32,
    word: u16,
    left: u8,
    answered: bool,
}

impl Transmitter {
    /// A sender of words of [`WORD_BITS`] bits that has not yet been answered.
    #[must_use]
    pub fn new(timing: Timing, now_us: u32) -> Self {
        Self::with_bits(timing, WORD_BITS, now_us)
    }

    /// The same for words of `bits` bits, 1..=16.
    #[must_use]
    pub fn with_bits(timing: Timing, bits: u8, now_us: u32) -> Self {
        Self {
            timing,
            bits: bits.clamp(1, 16),
            phase: Phase::HandshakePause,
            due_us: now_us,
            word: 0,
            left: 0,
            answered: false,
        }
    }

    /// The receiver's return sync was seen (X6). Later ones mean nothing.
    pub fn on_return(&mut self) {
        self.answered = true;
    }

    /// Whether the handshake is complete.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.answered
    }

    /// Whether [`Transmitter::start`] would take a word.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.phase == Phase::Ready
    }

    /// Begins to send `word`; `false`, and nothing happens, unless [`Transmitter::is_ready`].
    pub fn start(&mut self, word: u16, now_us: u32) -> bool {
        if !self.is_ready() {
            return false;
        }
        self.word = word;
        self.left = self.bits;
        self.enter(Phase::Lead, self.timing.lead_us, now_us);
        true
    }

    /// Takes the next edge if it is due and tells the levels that hold from now on.
    pub fn poll(&mut self, now_us: u32) -> Pins {
        if self.phase != Phase::Ready && reached(now_us, self.due_us) {
            self.advance(now_us);
        }
        self.pins()
    }

    /// When the next edge is due; `None` while ready for a word.
    #[must_use]
    pub fn next_due_us(&self) -> Option<u32> {
        (self.phase != Phase::Ready).then_some(self.due_us)
    }

    /// The levels as they are.
    #[must_use]
    pub fn pins(&self) -> Pins {
        let bit = self.left > 0 && self.word >> (self.left - 1) & 1 == 1;
        Pins {
            data: bit && matches!(self.phase, Phase::Lead | Phase::Pulse | Phase::Tail),
            sync: matches!(self.phase, Phase::Pulse | Phase::HandshakePulse),
        }
    }

    fn advance(&mut self, now_us: u32) {
        let timing = self.timing;
        match self.phase {
            Phase::HandshakePause if self.answered => self.phase = Phase::Ready,
            Phase::HandshakePause => self.enter(Phase::HandshakePulse, timing.pulse_us, now_us),
            // An answer is acted on only after a silence, so that the first word does not stick to the pulse.
            Phase::HandshakePulse => {
                let pause = if self.answered {
                    timing.gap_us
                } else {
                    timing.handshake_us
                };
                self.enter(Phase::HandshakePause, pause, now_us);
            }
            Phase::Lead => self.enter(Phase::Pulse, timing.pulse_us, now_us),
            Phase::Pulse => self.enter(Phase::Tail, timing.tail_us, now_us),
            Phase::Tail => {
                self.left -= 1;
                if self.left > 0 {
                    self.enter(Phase::Lead, timing.lead_us, now_us);
                } else {
                    self.enter(Phase::Gap, timing.gap_us, now_us);
                }
            }
            Phase::Gap => self.phase = Phase::Ready,
            Phase::Ready => {}
        }
    }

    fn enter(&mut self, phase: Phase, lasting_us: u32, now_us: u32) {
        self.phase = phase;
        self.due_us = now_us.wrapping_add(lasting_us);
    }
}
