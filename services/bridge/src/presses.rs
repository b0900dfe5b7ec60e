//! Presses of the switch: each one counts once, however often and however late its sample comes.
//!
//! A press toggles the mode, so a repeated press would undo itself. This file is pure, and a new
//! bridge goes on where the one before ended.

use lager_topics::Health;

use crate::arbiter::STALE;

/// A press that is older than this no longer counts, in real ns: it lets the robot move, and the
/// person who pressed has given it up.
pub(crate) const LONGEST_NS: u64 = STALE.as_nanos() as u64 + 1;

/// The presses taken last.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Presses {
    taken: [u32; 4],
}

impl Presses {
    pub(crate) fn resume(kept: &Health) -> Self {
        Self {
            taken: kept.switch_ids,
        }
    }

    /// Writes all that [`Presses::resume`] needs.
    pub(crate) fn fill(&self, health: &mut Health) {
        health.switch_ids = self.taken;
    }

    /// Whether the press with this id, made at `pressed_ns` of `CLOCK_MONOTONIC`, counts now.
    pub(crate) fn take(&mut self, id: u32, pressed_ns: u64, now_ns: u64) -> bool {
        let is_old = pressed_ns.abs_diff(now_ns) >= LONGEST_NS;
        if id == 0 || is_old || self.taken.contains(&id) {
            return false;
        }
        self.taken.rotate_right(1);
        self.taken[0] = id;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: u64 = 5_000_000_000;

    #[test]
    fn a_press_counts_once_also_across_a_restart() {
        let mut presses = Presses::default();
        assert!(presses.take(7, NOW, NOW));
        assert!(presses.take(8, NOW, NOW));
        assert!(!presses.take(7, NOW, NOW));
        let mut health = Health::default();
        presses.fill(&mut health);
        let mut presses = Presses::resume(&health);
        assert!(!presses.take(8, NOW, NOW) && !presses.take(7, NOW, NOW));
        assert!(presses.take(9, NOW, NOW));
    }

    #[test]
    fn a_press_without_a_number_or_from_another_time_does_not_count() {
        let mut presses = Presses::default();
        assert!(!presses.take(0, NOW, NOW));
        assert!(!presses.take(1, NOW - LONGEST_NS, NOW));
        assert!(!presses.take(1, NOW + LONGEST_NS, NOW));
        assert!(presses.take(1, NOW - LONGEST_NS + 1, NOW));
    }
}
