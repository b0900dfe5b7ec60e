//! The numbers that samples carry, compared with what a file says is missing.

use std::collections::HashMap;

use lager_topics::Stamp;

use crate::counts::Count;

/// The numbers of one topic's samples as they stand in a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Numbers {
    /// The next number of each stream, by writer and epoch.
    next: HashMap<(u32, u64), u64>,
    /// Samples in the file.
    pub(crate) stored: u64,
    /// Numbers that were skipped.
    pub(crate) gaps: u64,
    /// What the first message said of losses.
    first: Option<(u64, u64)>,
    /// What the last message said of losses.
    last: (u64, u64),
}

/// A number that is not above the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Backwards {
    /// The number that could come at the earliest.
    pub(crate) expected: u64,
}

impl Numbers {
    /// Notes the next sample and what its message says is missing before it.
    pub(crate) fn note(&mut self, stamp: &Stamp, lost: u64, dropped: u64) -> Result<(), Backwards> {
        self.stored += 1;
        self.first.get_or_insert((lost, dropped));
        self.last = (lost, dropped);
        let following = stamp.sequence.saturating_add(1);
        match self.next.insert((stamp.writer, stamp.epoch), following) {
            Some(expected) if stamp.sequence < expected => Err(Backwards { expected }),
            Some(expected) => {
                self.gaps = self.gaps.saturating_add(stamp.sequence - expected);
                Ok(())
            }
            None => Ok(()),
        }
    }

    /// The count of a file of which only the messages are left. A recording's first file also has
    /// what was missing before its first message.
    pub(crate) fn count(&self, is_first_part: bool) -> Count {
        let (lost, dropped) = match self.first {
            Some(first) if !is_first_part => first,
            _ => (0, 0),
        };
        let dropped = self.last.1.saturating_sub(dropped);
        let lost = self.last.0.saturating_sub(lost);
        Count {
            received: self.stored + dropped,
            // What stood in a damaged chunk is lost, too.
            lost: lost.max(self.gaps.saturating_sub(dropped)),
            dropped,
        }
    }
}
