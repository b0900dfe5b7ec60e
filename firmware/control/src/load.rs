//! Measures how busy a board is; the board status reports it.

/// Collects working time and the longest pass between two reports.
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

    /// Load in percent and the longest pass in 0.1 ms, both since the last call. The wheels wait
    /// meanwhile, so it divides only 16-bit numbers: the chip takes 400 cycles for a longer one.
    pub(crate) fn report(&mut self, now_us: u32) -> (u8, u8) {
        let mut span = now_us.wrapping_sub(self.since_us).max(1);
        let mut busy = self.busy_us.min(span);
        while span > LONGEST_SPAN {
            span >>= 1;
            busy >>= 1;
        }
        let percent = busy as u16 * 100 / span as u16;
        let longest = self.longest_us.min(LONGEST_PASS_US) as u16 / 100;
        *self = Self::new(now_us);
        (percent as u8, longest as u8)
    }
}

/// A hundred times this still fits 16 bits.
const LONGEST_SPAN: u32 = u16::MAX as u32 / 100;
/// The longest pass that a report can hold, in microseconds.
const LONGEST_PASS_US: u32 = 25_500;

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

    #[test]
    fn short_numbers_are_near_enough() {
        for span in (1..3_000_000).step_by(7_919) {
            for share in [0, 1, 49, 50, 99, 100] {
                let mut load = Load::new(5);
                let busy = span * share / 100;
                load.worked(0, busy);
                let exact = busy * 100 / span;
                let told = u32::from(load.report(5 + span).0);
                assert!(told.abs_diff(exact) <= 1, "{busy} of {span}: {told}");
            }
        }
    }
}
