//! Watches the age of the command: the robot must not drive on when the Pi falls silent.
//!
//! ```text
//!              a command                    older than the limit
//!   untold ----------------> fresh --------------------------------> expired
//!                             ^ ^------ renewal or new command --------'
//! ```
//!
//! Expired is a stored state, not a comparison of times, because the clock wraps. A renewal ends
//! it: the wheels run a renewed setpoint again, because the bridge's lease already makes sure that
//! somebody still wants it. A command that runs once was aborted, and needs a new number to run.

use crate::time::reached;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Untold,
    Fresh { since_us: u32 },
    Expired,
}

/// Watches the age of the command in force.
#[derive(Debug, Clone)]
pub(crate) struct CommandAge {
    limit_us: u32,
    state: State,
}

impl CommandAge {
    pub(crate) const fn new(limit_us: u32) -> Self {
        Self {
            limit_us,
            state: State::Untold,
        }
    }

    /// A command came, or the Pi renewed the one in force.
    pub(crate) fn renew(&mut self, now_us: u32) {
        self.state = State::Fresh { since_us: now_us };
    }

    /// Whether the command has just become too old; `true` once for each silence.
    pub(crate) fn expires(&mut self, now_us: u32) -> bool {
        let State::Fresh { since_us } = self.state else {
            return false;
        };
        // Strictly older than the limit.
        let expires = reached(now_us, since_us.wrapping_add(self.limit_us).wrapping_add(1));
        if expires {
            self.state = State::Expired;
        }
        expires
    }

    /// Whether the board has stopped because the Pi was silent.
    pub(crate) fn is_expired(&self) -> bool {
        self.state == State::Expired
    }

    /// Whether the wheels may turn.
    pub(crate) fn is_fresh(&self) -> bool {
        matches!(self.state, State::Fresh { .. })
    }

    /// When the command becomes too old.
    pub(crate) fn next_due_us(&self) -> Option<u32> {
        match self.state {
            State::Fresh { since_us } => Some(since_us.wrapping_add(self.limit_us).wrapping_add(1)),
            _ => None,
        }
    }
}
