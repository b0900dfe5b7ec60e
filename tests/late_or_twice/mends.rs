//! The protections ("mends") that keep the laws. A test can take each of them out: then the next
//! machine gets what it would have got before the mend.

use std::time::Duration;

/// Which mends are in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mends {
    /// A resume names the stop that it ends.
    pub(crate) named: bool,
    /// An order carries its age over each hop, and a hop notices when it was itself held up.
    pub(crate) aged: bool,
    /// A successor takes over no order older than its lease, and a giver stops renewing in time.
    pub(crate) heirs: bool,
    /// The running command decides about signs of life and silence, and not the mode.
    pub(crate) signs: bool,
    /// The station notices a GaG that does not read.
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

    /// The age of an order as the bridge gets it.
    pub(crate) fn age(self, age: Duration) -> Duration {
        match self.aged {
            true => age,
            false => Duration::ZERO,
        }
    }

    /// The time when an earlier bridge published its state, as its successor gets it, in ms.
    /// Without the mend the successor takes over everything, and waits until its board is there.
    pub(crate) fn published(self, now: u64, at: u64) -> u64 {
        match self.heirs {
            true => at,
            false => now + 200,
        }
    }

    /// A line as comm gets it. Without the mend, a resume means the stop that comm knows.
    pub(crate) fn to_comm(self, line: &str, stop_word: u64) -> String {
        match line.split_once(" resume ") {
            Some((number, _)) if !self.named => format!("{number} resume {stop_word}"),
            _ => line.to_owned(),
        }
    }

    /// A line as the station gets it. Without the mend, a sign lacks the robot's clock.
    pub(crate) fn to_station(self, line: &str) -> String {
        match line.starts_with("lager ") && !self.aged {
            true => line.split(' ').take(3).collect::<Vec<_>>().join(" "),
            false => line.to_owned(),
        }
    }
}
