//! Finds boards that reset again and again: a robot whose power or processor fails must not drive.
//!
//! Pure. It stands apart from the arbiter because it counts for both boards and sets no stop
//! itself.

use core::time::Duration;

use lager_wire::Callsign;

use crate::counts;

/// This many resets of one board within [`WINDOW`] are too many.
const TOO_MANY: usize = 3;

/// In robot time.
const WINDOW: Duration = Duration::from_secs(10);

/// When each board was reset last.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Resets {
    times: [[Option<Duration>; TOO_MANY]; 2],
}

impl Resets {
    /// A board has been reset. Returns whether it has been reset too often.
    pub(crate) fn note(&mut self, now: Duration, board: Callsign) -> bool {
        let Some(index) = counts::index(board) else {
            return false;
        };
        let times = &mut self.times[index];
        times.rotate_left(1);
        times[TOO_MANY - 1] = Some(now);
        times[0].is_some_and(|first| now.saturating_sub(first) <= WINDOW)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn notes(seconds: &[u64], board: Callsign, resets: &mut Resets) -> Vec<bool> {
        let note = |at: &u64| resets.note(Duration::from_secs(*at), board);
        seconds.iter().map(note).collect()
    }

    #[test]
    fn the_third_reset_of_one_board_within_ten_seconds_is_too_many() {
        let mut resets = Resets::default();
        let steering = Callsign::Steering;
        assert_eq!(
            notes(&[100, 105, 110, 111, 130, 139, 141], steering, &mut resets),
            [false, false, true, true, false, false, false]
        );
        assert_eq!(notes(&[149], steering, &mut resets), [true]);
    }

    #[test]
    fn resets_of_different_boards_do_not_add_up() {
        let mut resets = Resets::default();
        assert_eq!(notes(&[1, 2], Callsign::Steering, &mut resets), [false; 2]);
        assert_eq!(notes(&[3, 4], Callsign::Sensor, &mut resets), [false; 2]);
        assert_eq!(notes(&[5], Callsign::Steering, &mut resets), [true]);
    }
}
