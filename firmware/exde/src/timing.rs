//! The lengths that sender and receiver must agree on.

/// Times of the bus in microseconds.
///
/// They are lower bounds for the sender: when it is stepped late, everything stretches and keeps its order,
/// because the next step is always counted from the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// From data being set to the rise of sync.
    pub lead_us: u32,
    /// How long sync is high.
    pub pulse_us: u32,
    /// From the fall of sync to the next bit.
    pub tail_us: u32,
    /// Silence the sender keeps after a word; longer than `idle_us`.
    pub gap_us: u32,
    /// Silence after which the receiver starts a new word; longer than any pause inside a word.
    pub idle_us: u32,
    /// From one handshake pulse to the next ("now and then", X6); longer than `idle_us`.
    pub handshake_us: u32,
    /// A pulse closer than this to the one before is a disturbance and is not counted as a bit.
    pub shortest_us: u32,
}

impl Timing {
    /// 100 microseconds a bit, 1.1 ms a word, which leaves most of the 5 ms loop to everything else.
    pub const STANDARD: Self = Self {
        lead_us: 40,
        pulse_us: 20,
        tail_us: 40,
        gap_us: 1_500,
        idle_us: 1_000,
        handshake_us: 20_000,
        shortest_us: 30,
    };

    /// Time for one bit.
    #[must_use]
    pub const fn bit_us(&self) -> u32 {
        self.lead_us + self.pulse_us + self.tail_us
    }
}

impl Default for Timing {
    fn default() -> Self {
        Self::STANDARD
    }
}

/// Whether `now` is at or past `due`, for times less than half the clock's round apart.
pub(crate) fn reached(now: u32, due: u32) -> bool {
    now.wrapping_sub(due) < 1 << 31
}
