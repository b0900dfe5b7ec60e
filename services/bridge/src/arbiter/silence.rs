//! No order moves the robot unseen: what the arbiter does if the steering board does not report, is
//! absent, or must not be driven.
//!
//! ```text
//!            report                     200 ms without a report
//!  heard <----------- heard ---------------------------------------> silent: what moves ends,
//!    ^                                                                  |    standby is written,
//!    +------------------------- report ---------------------------------+    all else is refused
//! ```
//!
//! This file stands apart from the wire's side because it decides for all origins alike and writes
//! nothing.

use core::time::Duration;

use lager_orders::lease::UNHEARD;
use lager_topics::{Finish, Refusal};
use lager_wire::Version;

use super::{Arbiter, Gate, STANDBY};

impl Arbiter {
    /// Why the steering board lets no origin move anything.
    pub fn board_objection(&self, now: Duration) -> Option<Refusal> {
        match self.board {
            None => Some(Refusal::NoBoard),
            Some(Version::Original) => (!self.original_boards).then_some(Refusal::OriginalBoard),
            Some(Version::One) if self.is_unheard(now) => Some(Refusal::BoardSilent),
            Some(Version::One) => (self.wheels == Gate::Shut).then_some(Refusal::Undescribed),
        }
    }

    fn is_unheard(&self, now: Duration) -> bool {
        self.reported
            .is_none_or(|reported| reported + UNHEARD <= now)
    }

    /// Ends every order that moves something while no board shows it, and keeps the reason why no
    /// origin may move anything.
    pub(super) fn watch_board(&mut self, now: Duration) {
        let objection = self.board_objection(now);
        self.silent = objection == Some(Refusal::BoardSilent);
        if self
            .running
            .is_some_and(|running| running.command != STANDBY)
        {
            // An order taken over from an earlier bridge waits this long for its board.
            self.reported.get_or_insert(now);
            let is_over = match objection {
                Some(Refusal::NoBoard) => self.is_unheard(now),
                other => other.is_some(),
            };
            if is_over {
                self.finish_running(Finish::Aborted);
            }
        }
        let objection = objection.unwrap_or(Refusal::None);
        if self.objection != objection {
            self.objection = objection;
            self.revision = self.revision.wrapping_add(1);
        }
    }

    /// When the silence must be noticed, if no report comes before.
    pub(super) fn silence_due(&self) -> Option<Duration> {
        let is_awaited = match self.board {
            None => self
                .running
                .is_some_and(|running| running.command != STANDBY),
            Some(Version::One) => !self.silent,
            Some(Version::Original) => false,
        };
        let reported = self.reported.filter(|_| is_awaited)?;
        Some(reported + UNHEARD)
    }
}
