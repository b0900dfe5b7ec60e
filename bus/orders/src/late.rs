//! [`Late`]: finds out how late a page's line arrives. The page writes the time of its own clock,
//! in ms, into each action.
//!
//! The two clocks show different times, so the panel looks at their difference. The smallest
//! difference in the last [`SPAN`] belongs to a line that nothing has delayed. A line with a
//! greater difference was delayed by the excess. Two clocks drift apart, so the panel forgets the
//! smallest difference after a while. A page says `here` once a second, so new differences keep
//! coming.

use core::time::Duration;

/// The panel keeps a smallest difference for one to two of these spans. In 40 s, clocks that a
/// network synchronises drift apart by less than 20 ms.
const SPAN: Duration = Duration::from_secs(20);

/// The differences between the clocks of one page and of the panel.
#[derive(Debug, Default)]
pub struct Late {
    /// When the present span began.
    began: Duration,
    /// The smallest differences of the span before and of this one, in ms.
    least: [Option<i64>; 2],
}

impl Late {
    /// How much later than others a line has come at `now`, if the page sent it at `said_ms` of its
    /// clock.
    pub fn hear(&mut self, said_ms: u32, now: Duration) -> Duration {
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

    #[test]
    fn the_first_line_after_a_long_silence_is_the_measure() {
        let mut late = Late::default();
        late.hear(0, at(0));
        assert_eq!(late.hear(100_000, at(109_000)), at(0));
        assert_eq!(late.hear(100_100, at(109_400)), at(300));
    }
}
