//! Finds out whether somebody has driven the robot by hand since the navigator last knew its place.
//!
//! In manual mode the bridge sums the turning of the wheels, over all lives of both services. So a
//! navigator that was not running meanwhile finds out as well. This file only compares and
//! converts.

use lager_topics::NavigatorStatus;

use crate::config::LogicConfig;

/// The bridge's sum, now and when the robot's place was last known, in duty × µs of both motors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ByHand {
    here: Option<u64>,
    now: u64,
}

impl ByHand {
    /// As an earlier navigator left it.
    pub(crate) fn from_status(sum: u64) -> Self {
        let here = Some(sum).filter(|sum| *sum != NavigatorStatus::NEVER_HEARD);
        Self {
            here,
            now: here.unwrap_or_default(),
        }
    }

    /// All that a successor needs.
    pub(crate) fn to_status(self) -> u64 {
        self.here.unwrap_or(NavigatorStatus::NEVER_HEARD)
    }

    /// The robot's place is known now.
    pub(crate) fn stand_here(&mut self) {
        if self.here.is_some() {
            self.here = Some(self.now);
        }
    }

    /// Takes the bridge's sum. Returns how far the wheels have moved since the place was known, in
    /// mm. A bridge that has lost its sum has stopped the robot because of that.
    pub(crate) fn take(&mut self, sum: u64, config: &LogicConfig) -> f32 {
        self.now = sum;
        let here = *self.here.get_or_insert(sum);
        let turned = sum.saturating_sub(here) as f32;
        turned / 2.0 / f32::from(config.duty) * config.cruise_mm_per_s / 1e6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both motors at 100 for so many ms.
    fn both(millis: u64) -> u64 {
        200 * 1_000 * millis
    }

    #[test]
    fn what_was_driven_before_the_first_look_is_nobodys() {
        let mut by_hand = ByHand::default();
        assert_eq!(by_hand.take(both(90_000), &LogicConfig::default()), 0.0);
        assert!((by_hand.take(both(91_000), &LogicConfig::default()) - 73.3).abs() < 0.01);
        by_hand.stand_here();
        assert_eq!(by_hand.take(both(91_000), &LogicConfig::default()), 0.0);
    }

    #[test]
    fn a_successor_finds_out_what_was_driven_while_nobody_looked() {
        let mut by_hand = ByHand::default();
        by_hand.take(both(500), &LogicConfig::default());
        let mut successor = ByHand::from_status(by_hand.to_status());
        assert!((successor.take(both(1_500), &LogicConfig::default()) - 73.3).abs() < 0.01);
        let fresh = ByHand::from_status(ByHand::default().to_status());
        assert_eq!(fresh, ByHand::default());
    }
}
