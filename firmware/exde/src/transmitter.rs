//! The sender's end: a machine that is advanced by a timer and sets one edge each time.
//!
//! ```text
//!              answered                  start(word)         half          half
//!   asking ---------------> ready -----------------> placed -----> pulsed -----.
//!    |  ^                     ^                        ^                       |
//!    '--' a pulse on sync     | gap over               '------- next bit ------|
//!         every handshake_us  '----------- gap <------------ last bit ---------'
//! ```
//!
//! It knows no clock: every step says how long to wait before the next one.

use crate::{Timing, WORD_BITS};

/// A constant, because the sender's interrupt comes twice a bit and has no time to look it up.
const TIMING: Timing = Timing::STANDARD;

/// What to do with the wires now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Nothing.
    Nothing,
    /// Set data to this level.
    Place(bool),
    /// Make one pulse on sync, a microsecond or a little more (X3).
    Pulse,
    /// Set data low: all bits of the word have been sent.
    Release,
}

/// One step of the sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// What to do now.
    pub action: Action,
    /// After how many microseconds to call [`Transmitter::advance`]; `None` while ready for a word.
    pub wait_us: Option<u16>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Asking,
    Ready,
    Placed,
    Pulsed,
    Gap,
}

/// The register when only the mark is left.
const NOTHING_LEFT: u16 = 1 << 15;

/// Sends words bit by bit once the receiver has answered.
#[derive(Debug, Clone)]
pub struct Transmitter {
    bits: u8,
    phase: Phase,
    /// What is left of the word, the next bit highest, and behind the last bit a mark: a bit that
    /// is set.
    register: u16,
    answered: bool,
}

impl Transmitter {
    /// A sender of words of [`WORD_BITS`] bits that has not yet been answered; to be advanced at
    /// once.
    #[must_use]
    pub const fn new() -> Self {
        Self::with_bits(WORD_BITS)
    }

    /// The same for words of `bits` bits, 1..=15.
    #[must_use]
    pub const fn with_bits(bits: u8) -> Self {
        assert!(1 <= bits && bits <= 15);
        Self {
            bits,
            phase: Phase::Asking,
            register: NOTHING_LEFT,
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

    /// Whether bits of a word are still to be sent.
    #[must_use]
    pub fn is_sending(&self) -> bool {
        matches!(self.phase, Phase::Placed | Phase::Pulsed)
    }

    /// Begins to send `word`; `None`, and nothing happens, unless [`Transmitter::is_ready`].
    #[must_use = "the step is to be carried out"]
    pub fn start(&mut self, word: u16) -> Option<Step> {
        if !self.is_ready() {
            return None;
        }
        self.register = word << (16 - self.bits) | NOTHING_LEFT >> self.bits;
        Some(self.place())
    }

    /// The time of the step before is over: the next one.
    #[inline(always)]
    #[must_use = "the step is to be carried out"]
    pub fn advance(&mut self) -> Step {
        match self.phase {
            Phase::Placed => {
                self.phase = Phase::Pulsed;
                step(Action::Pulse, TIMING.half_us)
            }
            Phase::Pulsed if self.register != NOTHING_LEFT => self.place(),
            Phase::Pulsed => {
                self.phase = Phase::Gap;
                step(Action::Release, TIMING.gap_us)
            }
            // The answer to a pulse is acted on when the next one would be due: after a silence, so
            // that the first word does not stick to the pulse.
            Phase::Asking if !self.answered => step(Action::Pulse, TIMING.handshake_us),
            Phase::Asking | Phase::Gap | Phase::Ready => {
                self.phase = Phase::Ready;
                Step {
                    action: Action::Nothing,
                    wait_us: None,
                }
            }
        }
    }

    #[inline(always)]
    fn place(&mut self) -> Step {
        self.phase = Phase::Placed;
        let bit = self.register & 1 << 15 != 0;
        self.register <<= 1;
        step(Action::Place(bit), TIMING.half_us)
    }
}

impl Default for Transmitter {
    fn default() -> Self {
        Self::new()
    }
}

#[inline(always)]
const fn step(action: Action, wait_us: u16) -> Step {
    Step {
        action,
        wait_us: Some(wait_us),
    }
}
