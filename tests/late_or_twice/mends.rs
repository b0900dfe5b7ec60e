//! What keeps the laws, and what the robot would do without it. Each mend can be taken out where it
//! meets the next machine: then that machine is told what it would have been told before.

use std::time::Duration;

use lager_ports::Stop;
use lager_topics::{Ask, AskKind};

use crate::robot::moment;

/// Which of them are in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mends {
    /// A resume names the stop that it ends.
    pub(crate) named: bool,
    /// An order carries its age over each hop, and a hop notices its own pause.
    pub(crate) aged: bool,
    /// A successor takes up no order that is older than its lease, and who renews lets go.
    pub(crate) heirs: bool,
    /// Sign and silence follow from what runs, not from the mode.
    pub(crate) signs: bool,
    /// The station sees that a GaG does not read.
    pub(crate) seen: bool,
}

impl Mends {
    pub(crate) const ALL: Self = Self {
        named: true,
        aged: true,
        heirs: true,
        signs: true,
        seen: true,
    };

    /// How old an order is, as the bridge is told it.
    pub(crate) fn age(self, age: Duration) -> Duration {
        match self.aged {
            true => age,
            false => Duration::ZERO,
        }
    }

    /// When the state of an earlier bridge was published, as its successor is told it, in ms: one
    /// that takes up everything waits until its board is there.
    pub(crate) fn published(self, now: u64, at: u64) -> u64 {
        match self.heirs {
            true => at,
            false => now + 200,
        }
    }

    /// A request as the bridge is told it.
    pub(crate) fn ask(self, now: u64, ask: Ask, _stop: Option<Stop>) -> Ask {
        let resumes = ask.kind == AskKind::Resume;
        Ask {
            issued_ns: match resumes && !self.named {
                true => moment(now).ns,
                false => ask.issued_ns,
            },
            ..ask
        }
    }
}
