//! The lengths that sender and receiver must agree on.

/// Times of the bus in microseconds.
///
/// They are lower bounds for the sender: when its timer is served late, everything after it moves
/// and keeps its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Half a bit: from data being set to the pulse on sync, and from there to the next bit.
    pub half_us: u16,
    /// Silence the sender keeps after a word; longer than `idle_us`.
    pub gap_us: u16,
    /// Silence after which the receiver starts a new word; longer than any pause inside a word.
    pub idle_us: u16,
    /// From one handshake pulse to the next ("now and then", X6); longer than `gap_us`.
    pub handshake_us: u16,
    /// A pulse closer than this to the one before is a disturbance and is not counted as a bit.
    pub shortest_us: u16,
}

impl Timing {
    /// 20 microseconds a bit; the chip's interrupts make it somewhat more. Half of it is what the
    /// receiver's interrupt may be late. A word is sent beside a packet to the Pi, which takes 220
    /// microseconds too.
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
