//! Counters of the receiving ends of both ports: their readers count, and `link/health` shows it.
//!
//! They stand apart because a board may change its port: its epoch and its losses go with the
//! board. The counters are atomic because each port has a thread of its own, and nothing waits for
//! them.

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

/// The counts of both ports' readers. They grow over all lives of the bridge.
#[derive(Debug, Default)]
pub struct Counts {
    /// One per port.
    pub(crate) meters: [Meter; 2],
    /// The present link epoch of each board: sensor, steering.
    pub(crate) epochs: [AtomicU32; 2],
    /// Packets that each board's links have missed: sensor, steering. A meter's count begins at 0
    /// with each epoch; this count does not.
    pub(crate) lost: [AtomicU32; 2],
    /// Board data dropped because the main loop was behind.
    pub(crate) dropped: AtomicU32,
}

impl Counts {
    /// Continues the counts of an earlier bridge.
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

/// A board's place in tables of two; `None` if the callsign is not a board's.
pub(crate) fn index(callsign: Callsign) -> Option<usize> {
    match callsign {
        Callsign::Sensor => Some(0),
        Callsign::Steering => Some(1),
        Callsign::Error | Callsign::Raspi => None,
    }
}
