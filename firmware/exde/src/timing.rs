//! The times that sender and receiver must agree on.

/// Times of the bus in microseconds.
///
/// The sender waits at least that long: if its timer is served late, all later edges move, in the
/// same order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Half a bit: from a change of data to the pulse on sync, and from the pulse to the next
    /// change.
    pub half_us: u16,
    /// The sender's silence after a word; longer than `idle_us`.
    pub gap_us: u16,
    /// After this silence the receiver starts a new word; longer than any pause inside a word.
    pub idle_us: u16,
    /// Time between two handshake pulses ("now and then", X6); longer than `gap_us`.
    pub handshake_us: u16,
    /// A pulse sooner than this after the last one is a disturbance and not a bit.
    pub shortest_us: u16,
}

impl Timing {
    /// 20 microseconds a bit; the chip's interrupts add a little. The receiver's interrupt may be
    /// late by half of it. A word takes about as long as a packet to the Pi, 220 microseconds, and
    /// both are sent at the same time.
    pub const STANDARD: Self = Self {
        half_us: 10,
        gap_us: 80,
        idle_us: 60,
        handshake_us: 20_000,
        shortest_us: 6,
    };

    /// Time for one bit.
    #[must_use]
    pub const fn bit_us(&self) -> u16 {
        2 * self.half_us
    }

    /// Time for the `bits` of a word, without the gap after it.
    #[must_use]
    pub const fn word_us(&self, bits: u8) -> u16 {
        self.bit_us() * bits as u16
    }
}

impl Default for Timing {
    fn default() -> Self {
        Self::STANDARD
    }
}
