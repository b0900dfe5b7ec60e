//! How orders end: when their lease lapses, when the board reports their end, by a stop or by a
//! change of mode.
//!
//! This file stands apart from the judgement of orders because no origin asks for these ends.
//! `wire.rs` then writes to the board.

use core::time::Duration;

use lager_topics::{Finish, Origin};

use super::ledger::Ended;
use super::{Arbiter, Grant, STANDBY};

impl Arbiter {
    /// Ends what runs, and puts nothing in its place.
    pub(super) fn quiet(&mut self) {
        self.grant = None;
        if self.running.is_some() {
            self.finish_running(Finish::Aborted);
        }
        self.stand_anew();
        self.revision = self.revision.wrapping_add(1);
    }

    /// Ends the order in force; logic's standby below it comes back if there is one.
    pub(super) fn finish_running(&mut self, finish: Finish) {
        let Some(over) = self.running.take() else {
            return;
        };
        let by_person = over.key.origin == Origin::Operator;
        // A command to stand is never too late, and logic stands by one order for any time.
        if over.command != STANDBY || finish == Finish::Refused || by_person {
            let key = over.key;
            self.ledger.enter(Ended { key, finish });
        }
        if over.command == STANDBY && finish != Finish::Refused {
            self.stand_on(&over);
        } else {
            self.last = Some(Ended {
                key: over.key,
                finish,
            });
            self.stand_anew();
        }
        if let Some(Grant {
            key: Some(key),
            lease,
        }) = self.grant.take()
        {
            self.stand_for(key, lease);
        }
        self.revision = self.revision.wrapping_add(1);
    }

    /// Ends every order that was not renewed before `at`.
    pub(super) fn expire(&mut self, at: Duration) {
        if self.grant.is_some_and(|grant| grant.lease.is_over(at)) {
            // The operator moved the arm by logic's permission.
            self.grant = None;
            self.lapse();
        }
        // The standby below an arm order may have lapsed as well.
        for _ in 0..2 {
            if self
                .running
                .is_some_and(|running| running.lease.is_over(at))
            {
                self.lapse();
            }
        }
    }

    /// Nobody has renewed the order in force.
    fn lapse(&mut self) {
        if self
            .running
            .is_some_and(|running| running.command != STANDBY)
        {
            self.leases_expired = self.leases_expired.wrapping_add(1);
        }
        self.finish_running(Finish::Aborted);
    }
}
