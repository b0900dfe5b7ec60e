//! [`Late`]: finds out how late a page's line arrives. The page writes the time of its own clock,
//! in ms, into each action.
//!
//! The two clocks show different times, so the panel looks at their difference. The smallest
//! difference in the last [`SPAN`] belongs to a line that nothing has delayed. A line with a
//! greater difference was delayed by the excess. Two clocks drift apart, so the panel forgets the
//! smallest difference after a while. A page says `here` once a second, so new differences keep
//! coming. A longer time without one does not count: then the panel itself was held up, and the
//! lines that wait for it are late.

use core::time::Duration;

/// The panel keeps a smallest difference for one to two of these spans. In 40 s, clocks that a
/// network synchronises drift apart by less than 20 ms.
const SPAN: Duration = Duration::from_secs(20);

/// A longer time without a line does not count.
const GAP: Duration = Duration::from_secs(2);

/// The differences between the clocks of one page and of the panel.
#[derive(Debug, Default)]
pub struct Late {
    /// When the present span began.
    began: Duration,
    /// When the last line came.
    heard: Duration,
    /// The smallest differences of the span before and of this one, in ms.
    least: [Option<i64>; 2],
}

impl Late {
    /// How much later than others a line has come at `now`, if the page sent it at `said_ms` of its
    /// clock.
    pub fn hear(&mut self, said_ms: u32, now: Duration) -> Duration {
        let gap = now.saturating_sub(self.heard);
        self.heard = now;
        if gap > GAP {
            self.began += gap;
        }
        let spans = now.saturating_sub(self.began).as_secs() / SPAN.as_secs();
        if spans > 0 {
            self.began = now;
            self.least = [self.least[1].filter(|_| spans == 1), None];
        }
        let now_ms = i64::try_from(now.as_millis()).unwrap_or(i64::MAX);
        let difference = now_ms.saturating_sub(i64::from(said_ms));
        let least = self.least[1].map_or(difference, |least| least.min(difference));
        self.least[1] = Some(least);
        let least = self.least[0].map_or(least, |before| before.min(least));
        Duration::from_millis(u64::try_from(difference - least).unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn what_is_held_up_is_late_by_so_much() {
        let mut late = Late::default();
        assert_eq!(
            late.hear(70_000, at(1_000)),
            at(0),
            "clocks of two machines"
        );
        assert_eq!(late.hear(70_050, at(1_080)), at(30));
        // An earlier line was delayed more than others, so a quicker line is the new measure.
        assert_eq!(late.hear(70_100, at(1_090)), at(0));
        assert_eq!(late.hear(70_150, at(1_500)), at(360));
        // If several lines waited in the socket, the first one sent is the latest.
        assert_eq!(late.hear(70_490, at(1_500)), at(20));
    }

    #[test]
    fn what_has_waited_for_a_panel_that_was_held_up_is_late_however_long_that_was() {
        for seconds in [5, 30, 90, 3_600] {
            let mut late = Late::default();
            let page = 70_000;
            assert_eq!(late.hear(page, at(1_000)), at(0));
            let now = at(1_000 + seconds * 1_000);
            for second in 1..seconds {
                let said = page + u32::try_from(second * 1_000).unwrap();
                let waited = at((seconds - second) * 1_000);
                assert_eq!(late.hear(said, now), waited, "{second} s of {seconds} s");
            }
        }
    }

    #[test]
    fn clocks_that_drift_apart_make_nothing_late() {
        let mut late = Late::default();
        // A tuned clock is wrong by one second in ten thousand at worst; this is five times as bad.
        for second in 0..3_600 {
            let said = second * 1_000;
            let now = at(u64::from(said) + u64::from(second) / 2);
            assert!(late.hear(said, now) < at(50), "after {second} s");
        }
        assert_eq!(
            late.hear(3_600_000, at(3_600_000 + 1_800 + 700))
                .as_millis()
                / 100,
            7
        );
    }
}
