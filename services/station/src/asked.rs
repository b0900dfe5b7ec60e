//! The numbers of actions and stops, and which of them a robot has still to answer.

use std::time::Duration;

/// What a robot has been asked.
#[derive(Clone, Debug, Default)]
pub(crate) struct Asked {
    last: u32,
    /// What it has not answered, and when it was asked; the oldest first.
    open: Vec<(u32, Duration)>,
}

impl Asked {
    /// Actions that a robot may leave unanswered, at most.
    pub(crate) const MOST: usize = 64;
    /// How long an answer is waited for. A calibration of a robot that is simulated slowly takes
    /// longest.
    const PATIENCE: Duration = Duration::from_secs(60);

    /// A number that nothing has had before, and whose answer nobody awaits.
    pub(crate) fn number(&mut self) -> u32 {
        self.last = self.last.wrapping_add(1);
        self.last
    }

    /// A number whose answer is awaited; `None` if too many are open.
    pub(crate) fn open(&mut self, now: Duration) -> Option<u32> {
        if self.open.len() >= Self::MOST {
            return None;
        }
        let number = self.number();
        self.open.push((number, now));
        Some(number)
    }

    /// The same for what may be asked however much is open: the oldest gives way, and is returned.
    pub(crate) fn open_always(&mut self, now: Duration) -> (u32, Option<u32>) {
        let is_full = self.open.len() >= Self::MOST;
        let dropped = is_full.then(|| self.open.remove(0).0);
        let number = self.number();
        self.open.push((number, now));
        (number, dropped)
    }

    /// It has answered this; whether that was awaited.
    pub(crate) fn close(&mut self, number: u32) -> bool {
        let before = self.open.len();
        self.open.retain(|(open, _)| *open != number);
        self.open.len() < before
    }

    /// What it answers no more: everything where it has gone, else what is too old.
    pub(crate) fn lost(&mut self, now: Duration, has_gone: bool) -> Vec<u32> {
        let is_lost = |at: Duration| has_gone || now.saturating_sub(at) >= Self::PATIENCE;
        let lost = self.open.iter().filter(|(_, at)| is_lost(*at));
        let lost = lost.map(|(number, _)| *number).collect();
        self.open.retain(|(_, at)| !is_lost(*at));
        lost
    }
}
