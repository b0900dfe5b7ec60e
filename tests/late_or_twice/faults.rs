//! The faults of a case as seen at one moment: which process runs, and which connection works.

use crate::case::{Fault, Line, Who};

/// The time when the robot can be driven, in ms: its boards are up, and a page has its wheel. The
/// times of actions and faults count from then on.
pub(crate) const READY: u64 = 1_500;
/// The shortest time until a killed bridge has a successor, in ms.
const REPLACED: u64 = 60;

/// A moment in ms, and all faults of a run.
#[derive(Clone, Copy)]
pub(crate) struct Faults<'a>(pub(crate) u64, pub(crate) &'a [Fault]);

impl Faults<'_> {
    fn is_in(self, at: u64, lasts: u64) -> bool {
        (at + READY..at + READY + lasts).contains(&self.0)
    }

    /// Whether a process runs.
    pub(crate) fn runs(self, process: Who) -> bool {
        !self.1.iter().any(|fault| match *fault {
            Fault::Freeze { who, at, lasts } => who == process && self.is_in(at, lasts),
            Fault::Replace { at, lasts } => process == Who::Bridge && self.is_in(at, lasts),
            _ => false,
        })
    }

    /// Whether a process has been killed, and has no successor yet.
    pub(crate) fn is_killed(self, process: Who) -> bool {
        self.1.iter().any(|fault| match *fault {
            Fault::Kill { who, at, back } => who == process && self.is_in(at, back),
            // The supervisor kills a silent bridge, and the successor needs a moment.
            Fault::Replace { at, lasts } => {
                process == Who::Bridge && self.is_in(at + lasts, REPLACED)
            }
            _ => false,
        })
    }

    /// Whether the connection is cut now.
    pub(crate) fn is_cut(self, wire: Line) -> bool {
        self.1.iter().any(|fault| {
            matches!(*fault, Fault::Cut { line, at, lasts } if line == wire && self.is_in(at, lasts))
        })
    }

    /// The extra delay of what is sent now, in ms.
    pub(crate) fn slow(self, wire: Line) -> u64 {
        let slow = self.1.iter().map(|fault| match *fault {
            Fault::Slow {
                line,
                at,
                lasts,
                by,
            } if line == wire && self.is_in(at, lasts) => by,
            _ => 0,
        });
        slow.sum()
    }
}
