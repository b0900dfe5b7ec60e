//! The sender: a state machine that a timer advances; each step sets one edge.
//!
//! ```text
//!              answered                  start(word)         half          half
//!   asking ---------------> ready -----------------> placed -----> pulsed -----.
//!    |  ^                     ^                        ^                       |
//!    '--' a pulse on sync     | gap over               '------- next bit ------|
//!         every handshake_us  '----------- gap <------------ last bit ---------'
//! ```
//!
//! It reads no clock: every step says how long to wait before the next one.

use crate::{Timing, WORD_BITS};

/// A constant, because the sender's interrupt comes twice a bit and must be short.
const TIMING: Timing = Timing::STANDARD;

/// An action on the wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WireAction {
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
    pub action: WireAction,
    /// Call [`Transmitter::advance`] after this many microseconds; `None` while ready for a word.
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

/// The register when no bit is left, only the mark.
const NOTHING_LEFT: u16 = 1 << 15;

/// Sends words bit by bit once the receiver has answered.
#[derive(Debug, Clone)]
pub struct Transmitter {
    bits: u8,
    phase: Phase,
    /// The remaining bits of the word, the next one highest; a set bit behind the last one marks
    /// the end.
    register: u16,
    answered: bool,
}

impl Transmitter {
    /// A sender of words of [`WORD_BITS`] bits that nobody has answered yet. Call `advance` at
    /// once.
    #[must_use]
    pub const fn new() -> Self {
        Self::with_bits(WORD_BITS)
    }

    /// A sender of words of `bits` bits, 1..=15.
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

    /// Return sync rose (X6): the receiver has answered. Later pulses change nothing.
    pub fn on_return(&mut self) {
        self.answered = true;
    }

    /// Whether the handshake is complete.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.answered
    }

    /// Whether [`Transmitter::start`] accepts a word.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.phase == Phase::Ready
    }

    /// Whether bits of a word are still to be sent.
    #[must_use]
    pub fn is_sending(&self) -> bool {
        matches!(self.phase, Phase::Placed | Phase::Pulsed)
    }

    /// Begins to send `word`. `None`: nothing happens, because it is not [`Transmitter::is_ready`].
    #[must_use = "the step is to be carried out"]
    pub fn start(&mut self, word: u16) -> Option<Step> {
        if !self.is_ready() {
            return None;
        }
        self.register = word << (16 - self.bits) | NOTHING_LEFT >> self.bits;
        Some(self.place())
    }

    /// The wait of the last step is over: returns the next step.
    #[inline(always)]
    #[must_use = "the step is to be carried out"]
    pub fn advance(&mut self) -> Step {
        match self.phase {
            Phase::Placed => {
                self.phase = Phase::Pulsed;
                step(WireAction::Pulse, TIMING.half_us)
            }
            Phase::Pulsed if self.register != NOTHING_LEFT => self.place(),
            Phase::Pulsed => {
                self.phase = Phase::Gap;
                step(WireAction::Release, TIMING.gap_us)
            }
            // An answer takes effect only when the next pulse would be due: after a silence, so
            // that the receiver does not add the pulse to the first word.
            Phase::Asking if !self.answered => step(WireAction::Pulse, TIMING.handshake_us),
            Phase::Asking | Phase::Gap | Phase::Ready => {
                self.phase = Phase::Ready;
                Step {
                    action: WireAction::Nothing,
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
        step(WireAction::Place(bit), TIMING.half_us)
    }
}

impl Default for Transmitter {
    fn default() -> Self {
        Self::new()
    }
}

#[inline(always)]
const fn step(action: WireAction, wait_us: u16) -> Step {
    Step {
        action,
        wait_us: Some(wait_us),
    }
}
