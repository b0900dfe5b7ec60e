//! Decides how soon a robot is started again on a bus that is damaged again and again.
//!
//! ```text
//!   damaged ──> at once ──> after 1 s ──> after 4 s ──> every 15 s, for as long as it takes
//! ```
//! The cause may last for a while: a full memory, or a program that writes into the bus. A robot
//! that gave up for good would stand until somebody comes. A robot that tries seldom costs nothing
//! and goes on by itself. Pure: times are real time since some moment.

use std::time::Duration;

/// The pauses before the first starts.
const PAUSES: [Duration; 3] = [
    Duration::ZERO,
    Duration::from_secs(1),
    Duration::from_secs(4),
];
/// The pause before each further one.
pub(crate) const SELDOM: Duration = Duration::from_secs(15);
/// After this many starts in vain the robot tries only seldom.
pub(crate) const MOST: usize = PAUSES.len();
/// If a robot worked for this long, its start was not in vain.
const HELD: Duration = Duration::from_secs(30);

/// Counts the starts that were in vain.
#[derive(Debug, Default)]
pub(crate) struct Resets {
    count: usize,
    have_been: bool,
    whole_since: Option<Duration>,
    was_whole: bool,
}

/// When to start everything again on a damaged bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Remedy {
    /// For the n-th time, after this pause.
    StartAgain(usize, Duration),
    /// All attempts were in vain; from now on only seldom.
    Seldom,
    /// Seldom, as before.
    StillSeldom,
}

impl Remedy {
    /// How long to wait before the new start.
    pub(crate) fn pause(self) -> Duration {
        match self {
            Self::StartAgain(_, pause) => pause,
            Self::Seldom | Self::StillSeldom => SELDOM,
        }
    }
}

impl Resets {
    /// Whether the robot has ever been started again.
    pub(crate) fn have_been(&self) -> bool {
        self.have_been
    }

    /// Whether every service has ever run.
    pub(crate) fn was_whole(&self) -> bool {
        self.was_whole
    }

    /// Every service of the robot has started. Returns whether they had run before. If the bus was
    /// damaged before that, there is no state from which they could go on.
    pub(crate) fn whole(&mut self, now: Duration) -> bool {
        self.whole_since.get_or_insert(now);
        core::mem::replace(&mut self.was_whole, true)
    }

    /// The robot starts again with what is saved: no service goes on from what was before.
    pub(crate) fn renew(&mut self) {
        self.have_been = true;
        self.whole_since = None;
        self.was_whole = false;
    }

    /// The bus is damaged.
    pub(crate) fn damaged(&mut self, now: Duration) -> Remedy {
        let held = self
            .whole_since
            .take()
            .is_some_and(|since| now - since >= HELD);
        if held {
            self.count = 0;
        }
        self.have_been = true;
        self.count += 1;
        match PAUSES.get(self.count - 1) {
            Some(pause) => Remedy::StartAgain(self.count, *pause),
            None if self.count == MOST + 1 => Remedy::Seldom,
            None => Remedy::StillSeldom,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn services_go_on_only_with_what_ran_before() {
        let (mut resets, now) = (Resets::default(), Duration::ZERO);
        resets.damaged(now);
        assert!(resets.have_been() && !resets.was_whole());
        assert!(!resets.whole(now), "none has run yet");
        resets.damaged(now);
        assert!(resets.whole(now));
    }

    #[test]
    fn starts_in_vain_take_longer_and_longer_pauses_and_never_end() {
        let mut resets = Resets::default();
        let mut now = Duration::ZERO;
        let mut pauses = Vec::new();
        for _ in 0..MOST {
            let remedy = resets.damaged(now);
            assert!(matches!(remedy, Remedy::StartAgain(..)), "{remedy:?}");
            pauses.push(remedy.pause());
            resets.whole(now);
            now += Duration::from_secs(1);
        }
        let remedy = resets.damaged(now);
        assert_eq!(remedy, Remedy::Seldom, "it is said");
        pauses.push(remedy.pause());
        assert!(pauses.is_sorted_by(|a, b| a < b), "{pauses:?}");
        for _ in 0..1_000 {
            let remedy = resets.damaged(now);
            assert_eq!(remedy, Remedy::StillSeldom, "it is not said again");
            assert_eq!(remedy.pause(), SELDOM);
        }
    }

    #[test]
    fn a_robot_that_held_begins_anew() {
        let mut resets = Resets::default();
        let mut now = Duration::ZERO;
        for _ in 0..9 {
            resets.damaged(now);
        }
        resets.whole(now);
        now += HELD;
        assert_eq!(resets.damaged(now), Remedy::StartAgain(1, Duration::ZERO));
        assert!(resets.have_been());
    }
}
