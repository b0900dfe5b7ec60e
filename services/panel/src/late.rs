//! How late what a page says comes. A page puts the milliseconds of its own clock into each action.
//!
//! Nobody compares that clock with the panel's. What is compared is the difference of both from one
//! line to the next: the least difference of the last [`SPAN`] is that of a line that nothing held
//! up, and whatever comes with a greater one was held up by so much more. Two clocks drift apart,
//! so the least is forgotten in time; a page says `here` once a second, so that there always is
//! one.

use std::time::Duration;

/// A least difference counts for one to two of these: in 40 s clocks that are tuned to the second
/// drift by less than 20 ms.
const SPAN: Duration = Duration::from_secs(20);

/// The differences that one page's lines came with.
#[derive(Debug, Default)]
pub(crate) struct Late {
    /// When the present span began.
    began: Duration,
    /// The least of the span before and of this one, in ms.
    least: [Option<i64>; 2],
}

impl Late {
    /// How much later than others a line has come at `now` that was said at `said_ms` by the page's
    /// clock.
    pub(crate) fn hear(&mut self, said_ms: u32, now: Duration) -> Duration {
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
        // A line before was held up more than others: what is quicker is the new measure.
        assert_eq!(late.hear(70_100, at(1_090)), at(0));
        assert_eq!(late.hear(70_150, at(1_500)), at(360));
        // What was said first of all that lay in the socket is the latest.
        assert_eq!(late.hear(70_490, at(1_500)), at(20));
    }

    #[test]
    fn clocks_that_drift_apart_make_nothing_late() {
        let mut late = Late::default();
        // One second in ten thousand is the worst that a tuned clock does; this is five times as
        // bad.
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
