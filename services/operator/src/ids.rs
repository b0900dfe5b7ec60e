//! [`Ids`]: numbers for orders and presses.

/// Gives numbers that no order or press has had for the last hour, in this or an earlier process:
/// the milliseconds of the machine's clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ids {
    last: u32,
}

impl Ids {
    /// The next number at this moment, given in ns of `CLOCK_MONOTONIC`; never 0.
    pub fn fresh(&mut self, now_ns: u64) -> u32 {
        let milliseconds = (now_ns / 1_000_000) as u32;
        let next = self.last.wrapping_add(1);
        // Two in one millisecond follow each other; the clock has caught up long before a restart.
        let is_behind = self.last != 0 && milliseconds.wrapping_sub(next) >= 0x8000_0000;
        self.last = match is_behind {
            true => next,
            false => milliseconds,
        }
        .max(1);
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_the_clocks_and_comes_only_once() {
        // Also on a machine that has been up for months.
        for up_ms in [7_000, 3_000_000_000, u64::from(u32::MAX) - 1, 5_000_000_000] {
            let mut ids = Ids::default();
            let mut given = [0, 0, 1, 3].map(|ms| ids.fresh((up_ms + ms) * 1_000_000));
            assert_eq!(given[0], (up_ms as u32).max(1));
            given.sort_unstable();
            assert!(given.windows(2).all(|two| two[0] != two[1]), "{given:?}");
        }
    }
}
