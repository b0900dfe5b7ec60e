//! How busy a board is: for its status report.

use crate::divide::divide;

/// Measures between two reports.
#[derive(Debug, Clone)]
pub(crate) struct Load {
    since_us: u32,
    busy_us: u32,
    longest_us: u32,
}

impl Load {
    pub(crate) const fn new(now_us: u32) -> Self {
        Self {
            since_us: now_us,
            busy_us: 0,
            longest_us: 0,
        }
    }

    /// A step worked from `from_us` to `to_us`.
    pub(crate) fn worked(&mut self, from_us: u32, to_us: u32) {
        self.busy_us = self.busy_us.saturating_add(to_us.wrapping_sub(from_us));
    }

    /// One pass of the main loop took this long.
    pub(crate) fn passed(&mut self, pass_us: u32) {
        self.longest_us = self.longest_us.max(pass_us);
    }

    /// Load in percent and the longest pass in 0.1 ms, both since the last call.
    pub(crate) fn report(&mut self, now_us: u32) -> (u8, u8) {
        let span = divide(now_us.wrapping_sub(self.since_us), 100).max(1);
        let percent = divide(self.busy_us, span).min(100) as u8;
        let longest = u8::try_from(divide(self.longest_us, 100)).unwrap_or(u8::MAX);
        *self = Self::new(now_us);
        (percent, longest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn load_is_busy_time_over_time() {
        let mut load = Load::new(u32::MAX - 100);
        load.worked(0, 125_000);
        load.passed(5_000);
        load.passed(4_000);
        assert_eq!(load.report(499_899), (25, 50));
        assert_eq!(load.report(999_899), (0, 0));
    }

    #[test]
    fn a_pass_too_long_for_the_report_saturates() {
        let mut load = Load::new(0);
        load.passed(90_000);
        load.worked(0, 90_000);
        assert_eq!(load.report(50), (100, 255));
    }
}
