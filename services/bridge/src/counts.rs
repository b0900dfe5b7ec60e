//! What the receiving ends of both ports count: written by their readers, shown by `link/health`.
//!
//! It is apart because a board may change its port: its epoch and its losses go with the board.
//! The counters are atomic because each port has a thread of its own; nothing waits for them.

use std::sync::atomic::{AtomicU32, Ordering};

use lager_topics::{BoardHealth, Health};
use lager_wire::Callsign;

/// Counters of one port's link.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    pub(crate) packets: AtomicU32,
    pub(crate) lost: AtomicU32,
    pub(crate) refused: AtomicU32,
    pub(crate) skipped_bytes: AtomicU32,
}

/// What both ports' readers count. It grows over the bridge's lives.
#[derive(Debug, Default)]
pub struct Counts {
    /// One per port.
    pub(crate) meters: [Meter; 2],
    /// The present link epoch of each board: sensor, steering.
    pub(crate) epochs: [AtomicU32; 2],
    /// Packets each board's links have missed: sensor, steering. Unlike a meter's count it does
    /// not begin at 0 with each epoch.
    pub(crate) lost: [AtomicU32; 2],
    /// Board data dropped because the main loop was behind.
    pub(crate) dropped: AtomicU32,
}

impl Counts {
    /// Goes on from what an earlier life of the bridge has told.
    pub fn new(kept: Option<&Health>) -> Self {
        let counts = Self::default();
        let earlier = kept.map_or_else(Default::default, |kept| [kept.sensor, kept.steering]);
        for (
            index,
            BoardHealth {
                epoch, lost_total, ..
            },
        ) in earlier.into_iter().enumerate()
        {
            counts.epochs[index].store(epoch, Ordering::Relaxed);
            counts.lost[index].store(lost_total, Ordering::Relaxed);
        }
        counts
    }

    /// Board data dropped because the main loop was behind.
    pub fn dropped(&self) -> u32 {
        self.dropped.load(Ordering::Relaxed)
    }
}

/// The place of a callsign in tables of two; `None` for what is no board.
pub(crate) fn index(callsign: Callsign) -> Option<usize> {
    match callsign {
        Callsign::Sensor => Some(0),
        Callsign::Steering => Some(1),
        Callsign::Error | Callsign::Raspi => None,
    }
}
