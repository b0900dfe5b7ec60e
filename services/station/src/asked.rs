//! The numbers of actions and stops, and which of them a robot has not answered yet.

use std::time::Duration;

/// The actions and stops that the station has sent to a robot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Asked {
    last: u32,
    /// The numbers that the robot has not answered, with the time when the station sent each one.
    /// The oldest comes first.
    open: Vec<(u32, Duration)>,
}

impl Asked {
    /// Actions that a robot may leave unanswered, at most.
    pub(crate) const MOST: usize = 64;
    /// How long the station waits for an answer. The longest wait is for a calibration of a robot
    /// that is simulated slowly.
    const PATIENCE: Duration = Duration::from_secs(60);

    /// A new number whose answer nobody waits for.
    pub(crate) fn number(&mut self) -> u32 {
        self.last = self.last.wrapping_add(1);
        self.last
    }

    /// A new number whose answer somebody waits for; `None` if too many wait for their answers.
    pub(crate) fn open(&mut self, now: Duration) -> Option<u32> {
        if self.open.len() >= Self::MOST {
            return None;
        }
        let number = self.number();
        self.open.push((number, now));
        Some(number)
    }

    /// The same for an action that is always sent. If too many wait, the oldest number is dropped
    /// and returned.
    pub(crate) fn open_always(&mut self, now: Duration) -> (u32, Option<u32>) {
        let is_full = self.open.len() >= Self::MOST;
        let dropped = is_full.then(|| self.open.remove(0).0);
        let number = self.number();
        self.open.push((number, now));
        (number, dropped)
    }

    /// The robot has answered this number. Returns whether somebody waits for it.
    pub(crate) fn close(&mut self, number: u32) -> bool {
        let before = self.open.len();
        self.open.retain(|(open, _)| *open != number);
        self.open.len() < before
    }

    /// Takes the numbers that the robot will not answer: all if it has gone, else the old ones.
    pub(crate) fn lost(&mut self, now: Duration, has_gone: bool) -> Vec<u32> {
        let is_lost = |at: Duration| has_gone || now.saturating_sub(at) >= Self::PATIENCE;
        let lost = self.open.iter().filter(|(_, at)| is_lost(*at));
        let lost = lost.map(|(number, _)| *number).collect();
        self.open.retain(|(_, at)| !is_lost(*at));
        lost
    }
}
