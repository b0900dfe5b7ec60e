//! The attendant as its supervisor sees it: a line, and how long nothing has come over it.

use std::time::{Duration, Instant};

use lager_ports::ChanceClock;

use crate::words::Line;

/// The most that counts between two looks: this process itself may have slept.
const LONGEST_PIECE: Duration = Duration::from_secs(1);

/// How long it may be silent once it has joined the bus.
pub const SILENCE: Duration = Duration::from_secs(2);
/// How long before: it waits for half a second at each thing that the dead have left half made,
/// which is no hang.
const OPENING: Duration = Duration::from_secs(8);

/// The attendant, as far as it is heard.
pub struct Attendant {
    /// What it says, and whether it has joined the bus.
    pub line: Option<Line>,
    pub joined: bool,
    /// How long it could run in all, when that was looked at, and when it last said something.
    /// Time during which this process slept is not in it.
    pub clock: Option<ChanceClock>,
    pub ran: Duration,
    pub spoke: Duration,
    /// Since when there is none, or when that was looked at.
    pub looked: Instant,
}

impl Attendant {
    /// There is none.
    pub fn absent() -> Self {
        Self {
            line: None,
            joined: false,
            clock: None,
            ran: Duration::ZERO,
            spoke: Duration::ZERO,
            looked: Instant::now(),
        }
    }

    /// Whether it has said nothing for longer than it may, counting only time in which it could run.
    pub fn is_silent(&self) -> bool {
        let most = match self.joined {
            true => SILENCE,
            false => OPENING,
        };
        self.ran - self.spoke >= most
    }

    /// How long it could run since the last look; while there is none, how long that was.
    pub fn look(&mut self) -> Duration {
        let now = Instant::now();
        let passed = now - core::mem::replace(&mut self.looked, now);
        let Some(clock) = &mut self.clock else {
            return passed;
        };
        let ran = clock.look(LONGEST_PIECE);
        ran - core::mem::replace(&mut self.ran, ran)
    }
}
