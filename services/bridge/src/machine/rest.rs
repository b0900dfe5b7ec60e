//! Finds out when a stop has reached the wheels: when the steering board reports them at rest.
//!
//! It stands apart from the core because it is a proof of its own, from three things: when the
//! stop's standby was written, when a report was read, and what the report says.

use lager_wire::SteerData;

/// How many reports in a row with wheels at rest prove that they are at rest.
const REPORTS: u8 = 2;

/// A report that is read within this time after the standby was written may have left the board
/// before the standby reached it, in ns.
const ON_ITS_WAY_NS: u64 = 5_000_000;

/// How far the board has obeyed the stop in force.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rest {
    /// When the stop in force was first written to the board, in ns.
    written_ns: Option<u64>,
    /// How many reports in a row have shown the wheels at rest since then.
    reports: u8,
}

impl Rest {
    /// The standby of the stop in force has been written to the steering board.
    pub(super) fn written(&mut self, at_ns: u64) {
        self.written_ns.get_or_insert(at_ns);
    }

    /// A report of the steering board was read at `at_ns`. Returns whether it proves the wheels at
    /// rest.
    pub(super) fn report(&mut self, data: &SteerData, at_ns: u64) -> bool {
        let on_its_way_until = self.written_ns.map(|written| written + ON_ITS_WAY_NS);
        if on_its_way_until.is_none_or(|until| at_ns < until) {
            return false;
        }
        self.reports = match [data.left_duty, data.right_duty] == [0, 0] {
            true => self.reports.saturating_add(1),
            false => 0,
        };
        self.reports == REPORTS
    }
}
