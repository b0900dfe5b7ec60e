//! How often a robot is started again on a bus that does not hold.

use std::time::{Duration, Instant};

/// After so many starts in vain nothing is tried any more.
pub const MOST: u32 = 3;
/// A robot that was whole for so long was not started in vain.
const HELD: Duration = Duration::from_secs(30);

/// The starts that were in vain.
#[derive(Debug, Default)]
pub struct Resets {
    count: u32,
    whole_since: Option<Instant>,
    was_whole: bool,
}

/// What to do about a damaged bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// Start everything again, for the n-th time.
    StartAgain(u32),
    /// That would be in vain.
    GiveUp,
}

impl Resets {
    /// Whether the robot has been started again at any time.
    pub fn have_been(&self) -> bool {
        self.count > 0
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
        if self.count >= MOST {
            return Remedy::GiveUp;
        }
        self.count += 1;
        Remedy::StartAgain(self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn services_go_on_only_with_what_ran_before() {
        let (mut resets, now) = (Resets::default(), Instant::now());
        assert_eq!(resets.damaged(now), Remedy::StartAgain(1));
        assert!(!resets.whole(now), "none has run yet");
        assert_eq!(resets.damaged(now), Remedy::StartAgain(2));
        assert!(resets.whole(now));
    }

    #[test]
    fn three_starts_in_vain_are_the_end_and_one_that_held_is_not_counted() {
        let mut resets = Resets::default();
        let mut now = Instant::now();
        for count in [1, 2] {
            assert_eq!(resets.damaged(now), Remedy::StartAgain(count));
            resets.whole(now);
            now += Duration::from_secs(1);
        }
        resets.whole(now);
        now += HELD;
        for count in [1, 2, 3] {
            assert_eq!(resets.damaged(now), Remedy::StartAgain(count));
        }
        assert_eq!(resets.damaged(now), Remedy::GiveUp);
    }
}
