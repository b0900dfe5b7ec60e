//! Counts how far the wheels turn while a person drives, for services that must know whether the
//! robot has moved from its place.
//!
//! This file stands apart because it only counts and decides nothing. It belongs to the bridge
//! because the bridge sees every report and outlives the services that need the count.

use core::time::Duration;

use lager_wire::COMMAND_AGE;

/// The duty that counts for both motors of a board that does not report it, while it has a command
/// to move.
const STANDARD_DUTY: u64 = 200;

/// The time that a bridge may not have counted if it was killed while a person drove: since its
/// last `link/health`, plus the board's limit on a command's age.
const UNTOLD: Duration = Duration::from_millis(100).saturating_add(COMMAND_AGE);

/// Duty × µs, summed over both motors, whatever the direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Driven {
    sum: u64,
    duty: u64,
    reckoned: Duration,
    believed_until: Duration,
}

impl Driven {
    /// Continues the sum of an earlier bridge, which ended while a person drove or not.
    pub(super) fn resume(sum: u64, was_driven: bool) -> Self {
        let untold = if was_driven {
            STANDARD_DUTY.saturating_mul(micros(UNTOLD))
        } else {
            0
        };
        Self {
            sum: sum.saturating_add(untold),
            ..Self::default()
        }
    }

    /// Advances to `now`. It counts only while a person drives.
    pub(super) fn advance(&mut self, now: Duration, by_hand: bool) {
        let until = now.min(self.believed_until);
        if by_hand {
            let span = micros(until.saturating_sub(self.reckoned));
            self.sum = self.sum.saturating_add(self.duty.saturating_mul(span));
        }
        self.reckoned = self.reckoned.max(now);
    }

    /// The board reports these duties.
    pub(super) fn report(&mut self, now: Duration, left: u8, right: u8) {
        self.duty = u64::from(left) + u64::from(right);
        self.believed_until = now + COMMAND_AGE;
    }

    /// A board that does not report has a command to move, or to stand.
    pub(super) fn told(&mut self, moves: bool) {
        self.duty = if moves { STANDARD_DUTY } else { 0 };
        self.believed_until = Duration::MAX;
    }

    pub(super) fn sum(&self) -> u64 {
        self.sum
    }
}

fn micros(span: Duration) -> u64 {
    u64::try_from(span.as_micros()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    #[test]
    fn only_what_a_person_drives_is_counted_and_no_report_is_believed_for_long() {
        let mut driven = Driven::default();
        driven.advance(ms(1_000), true);
        driven.report(ms(1_000), 100, 90);
        driven.advance(ms(1_010), true);
        assert_eq!(driven.sum(), 190 * 10_000);
        driven.advance(ms(1_020), false);
        driven.advance(ms(5_000), true);
        assert_eq!(driven.sum(), 190 * (10_000 + 130_000));
    }

    #[test]
    fn a_board_without_reports_moves_until_it_is_told_to_stand() {
        let mut driven = Driven::default();
        driven.advance(ms(1_000), true);
        driven.told(true);
        driven.advance(ms(3_000), true);
        driven.told(false);
        driven.advance(ms(9_000), true);
        assert_eq!(driven.sum(), 200 * 2_000_000);
    }

    #[test]
    fn a_killed_bridge_has_told_too_little() {
        assert_eq!(Driven::resume(7, false).sum(), 7);
        assert_eq!(Driven::resume(7, true).sum(), 7 + 200 * 250_000);
        assert_eq!(Driven::resume(u64::MAX, true).sum(), u64::MAX);
    }
}
