//! The supervisor's connection to the attendant, and how long the attendant has been silent.

use std::time::{Duration, Instant};

use lager_home::ChanceClock;

use crate::protocol::Line;

/// At most this counts between two looks: this process itself may have slept.
const LONGEST_PIECE: Duration = Duration::from_secs(1);

/// How long it may be silent once it has joined the bus.
pub(crate) const SILENCE: Duration = Duration::from_secs(2);
/// How long it may be silent before that. It waits for half a second at each thing that dead
/// processes have left half made, and then it does not hang.
const OPENING: Duration = Duration::from_secs(8);

/// The attendant, as the supervisor hears it.
pub(crate) struct AttendantLink {
    /// The connection, and whether the attendant has joined the bus.
    pub(crate) line: Option<Line>,
    pub(crate) joined: bool,
    /// How long it could run in all, the moment when this was read, and the same when it last said
    /// something. Time in which this process slept does not count.
    pub(crate) clock: Option<ChanceClock>,
    pub(crate) ran: Duration,
    pub(crate) spoke: Duration,
    /// Since when there is no attendant, or when this was last read.
    pub(crate) looked: Instant,
}

impl AttendantLink {
    /// There is no attendant.
    pub(crate) fn absent() -> Self {
        Self {
            line: None,
            joined: false,
            clock: None,
            ran: Duration::ZERO,
            spoke: Duration::ZERO,
            looked: Instant::now(),
        }
    }

    /// Whether it has been silent for too long, counting only time in which it could run.
    pub(crate) fn is_silent(&self) -> bool {
        let most = match self.joined {
            true => SILENCE,
            false => OPENING,
        };
        self.ran - self.spoke >= most
    }

    /// How long it could run since the last call. If there is no attendant: how long that was.
    pub(crate) fn look(&mut self) -> Duration {
        let now = Instant::now();
        let passed = now - core::mem::replace(&mut self.looked, now);
        let Some(clock) = &mut self.clock else {
            return passed;
        };
        let ran = clock.look(LONGEST_PIECE);
        ran - core::mem::replace(&mut self.ran, ran)
    }
}
