//! Compares the numbers of samples with the losses that a file admits.

use std::collections::HashMap;

use lager_sample::Stamp;

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
    /// The losses that the first message admits.
    first: Option<(u64, u64)>,
    /// The losses that the last message admits.
    last: (u64, u64),
}

/// A number that is not greater than the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Backwards {
    /// The smallest number that could follow.
    pub(crate) expected: u64,
}

impl Numbers {
    /// Counts the next sample, and the losses that its message admits.
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

    /// The counts of a file that has no end, from its messages alone. In a recording's first file
    /// they include the losses before its first message.
    pub(crate) fn count(&self, is_first_part: bool) -> Count {
        let (lost, dropped) = match self.first {
            Some(first) if !is_first_part => first,
            _ => (0, 0),
        };
        let dropped = self.last.1.saturating_sub(dropped);
        let lost = self.last.0.saturating_sub(lost);
        Count {
            received: self.stored + dropped,
            // The samples in a damaged chunk are lost, too.
            lost: lost.max(self.gaps.saturating_sub(dropped)),
            dropped,
        }
    }
}
