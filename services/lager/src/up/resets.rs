//! How soon a robot is started again on a bus that does not hold.
//!
//! ```text
//!   damaged ──> at once ──> after 1 s ──> after 4 s ──> every 15 s, for as long as it takes
//! ```
//! What damages a bus may last for a while: a full memory, or a program that writes into it. A
//! robot that has given up for good stands until somebody comes; one that tries seldom costs
//! nothing and goes on by itself.

use std::time::{Duration, Instant};

/// The pauses before the first starts.
const PAUSES: [Duration; 3] = [
    Duration::ZERO,
    Duration::from_secs(1),
    Duration::from_secs(4),
];
/// The pause before each further one.
pub const SELDOM: Duration = Duration::from_secs(15);
/// After so many starts in vain it is tried seldom only.
pub const MOST: usize = PAUSES.len();
/// A robot that was whole for so long was not started in vain.
const HELD: Duration = Duration::from_secs(30);

/// The starts that were in vain.
#[derive(Debug, Default)]
pub struct Resets {
    count: usize,
    have_been: bool,
    whole_since: Option<Instant>,
    was_whole: bool,
}

/// When to start everything again on a damaged bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// For the n-th time, after so long a pause.
    StartAgain(usize, Duration),
    /// All those were in vain, and it is tried seldom from now on.
    Seldom,
    /// It is tried seldom already.
    StillSeldom,
}

impl Remedy {
    /// How long nothing is done.
    pub fn pause(self) -> Duration {
        match self {
            Self::StartAgain(_, pause) => pause,
            Self::Seldom | Self::StillSeldom => SELDOM,
        }
    }
}

impl Resets {
    /// Whether the robot has been started again at any time.
    pub fn have_been(&self) -> bool {
        self.have_been
    }

    /// Whether every service has run at any time.
    pub fn was_whole(&self) -> bool {
        self.was_whole
    }

    /// Every service of the robot is started; says whether they have run before. Where the bus was
    /// damaged before any could, there is nothing that they could go on with.
    pub fn whole(&mut self, now: Instant) -> bool {
        self.whole_since.get_or_insert(now);
        core::mem::replace(&mut self.was_whole, true)
    }

    /// The bus is damaged.
    pub fn damaged(&mut self, now: Instant) -> Remedy {
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
        let (mut resets, now) = (Resets::default(), Instant::now());
        resets.damaged(now);
        assert!(resets.have_been() && !resets.was_whole());
        assert!(!resets.whole(now), "none has run yet");
        resets.damaged(now);
        assert!(resets.whole(now));
    }

    #[test]
    fn starts_in_vain_take_longer_and_longer_pauses_and_never_end() {
        let mut resets = Resets::default();
        let mut now = Instant::now();
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
        let mut now = Instant::now();
        for _ in 0..9 {
            resets.damaged(now);
        }
        resets.whole(now);
        now += HELD;
        assert_eq!(resets.damaged(now), Remedy::StartAgain(1, Duration::ZERO));
        assert!(resets.have_been());
    }
}
