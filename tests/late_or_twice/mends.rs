//! What keeps the laws, and what the robot would do without it. Each mend can be taken out where it
//! meets the next machine: then that machine is told what it would have been told before.

use std::time::Duration;

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

    /// What comm is told by the station: a resume that names no stop means the one that comm knows.
    pub(crate) fn to_comm(self, line: &str, stop_word: u64) -> String {
        match line.split_once(" resume ") {
            Some((number, _)) if !self.named => format!("{number} resume {stop_word}"),
            _ => line.to_owned(),
        }
    }

    /// What the station is told by comm: a sign without the robot's clock tells no age.
    pub(crate) fn to_station(self, line: &str) -> String {
        match line.starts_with("lager ") && !self.aged {
            true => line.split(' ').take(3).collect::<Vec<_>>().join(" "),
            false => line.to_owned(),
        }
    }
}
