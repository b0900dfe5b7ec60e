//! Numbers for orders and presses.

use crate::moment::Moment;

/// Gives numbers that nothing of this or an earlier process has had for the last hour: the
/// milliseconds of the machine's clock.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ids {
    last: u32,
}

impl Ids {
    /// The next one.
    pub(crate) fn fresh(&mut self, now: Moment) -> u32 {
        let milliseconds = (now.ns / 1_000_000) as u32;
        // Two in one millisecond follow each other; the clock has caught up long before a restart.
        self.last = match milliseconds.wrapping_sub(self.last) {
            0 | 0x8000_0000.. => self.last.wrapping_add(1),
            _ => milliseconds,
        };
        self.last
    }
}
