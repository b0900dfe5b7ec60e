//! Whether a machine's calendar can be believed, and when it was set.
//!
//! A Pi has no clock that runs without power. Its calendar starts in 1970, or at the time when it
//! was switched off. The Pi sets it when it finds a network, or never. Stamps come from
//! `CLOCK_MONOTONIC`, which nobody sets, so a recording's durations are right in any case. Its
//! dates follow from the difference between both clocks when it began. So a [`Calendar`] watches
//! this difference, and the file notes each change of it ([`Step`]).

use std::collections::BTreeMap;

/// The metadata record that says that the calendar was set.
pub(crate) const NAME: &str = "lager.calendar";
/// A reader reads at most so many of these records.
pub(crate) const MOST: usize = 100;

/// 2024-01-01, before which no program of this project ran, in ns since 1970.
const FIRST_NS: u64 = 1_704_067_200_000_000_000;
/// 2262-04-11, where a signed number of ns ends.
const LAST_NS: u64 = i64::MAX as u64;
/// A smaller change of the offset does not count as a setting of the calendar: the system corrects
/// the calendar while it runs, and nobody can read both clocks at the same moment.
const SMALL_NS: u64 = 250_000_000;

/// Whether a date in ns since 1970 lies outside the years in which a set calendar can be.
pub const fn is_doubtful(unix_ns: u64) -> bool {
    unix_ns < FIRST_NS || unix_ns >= LAST_NS
}

/// A moment at which the calendar was set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// When, in ns since 1970, by the dates of the recording. They go on as they began.
    pub at_ns: u64,
    /// What is added to the recording's dates to get those of the new calendar, in ns.
    pub by_ns: i64,
}

impl Step {
    pub(crate) fn to_texts(self) -> BTreeMap<String, String> {
        [
            ("at_unix_ns", self.at_ns.to_string()),
            ("by_ns", self.by_ns.to_string()),
        ]
        .map(|(name, text)| (name.to_owned(), text))
        .into()
    }

    /// The step that the metadata record `name` describes.
    pub(crate) fn of_note(name: &str, texts: &BTreeMap<String, String>) -> Option<Self> {
        let text = |of: &str| texts.get(of).filter(|_| name == NAME);
        Some(Self {
            at_ns: text("at_unix_ns")?.parse().ok()?,
            by_ns: text("by_ns")?.parse().ok()?,
        })
    }

    /// A date of the recording, in ns since 1970, by the calendar as it was set here.
    pub const fn corrected(&self, unix_ns: u64) -> u64 {
        unix_ns.saturating_add_signed(self.by_ns)
    }
}

/// Watches the calendar while a recording goes on.
#[derive(Clone, Copy, Debug)]
pub struct Calendar {
    /// The offset by which the recording's dates go.
    began_ns: i64,
    /// The last offset.
    seen_ns: i64,
}

impl Calendar {
    /// For a recording that begins with this difference between ns since 1970 and the stamps'
    /// clock.
    pub const fn new(offset_ns: i64) -> Self {
        Self {
            began_ns: offset_ns,
            seen_ns: offset_ns,
        }
    }

    /// Whether somebody has set the calendar since the last call. The offset is `offset_ns` at
    /// `stamp_ns` of the stamps' clock.
    pub fn look(&mut self, stamp_ns: u64, offset_ns: i64) -> Option<Step> {
        if offset_ns.abs_diff(self.seen_ns) < SMALL_NS {
            return None;
        }
        self.seen_ns = offset_ns;
        Some(Step {
            at_ns: stamp_ns.saturating_add_signed(self.began_ns),
            by_ns: offset_ns.saturating_sub(self.began_ns),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;
    /// 2026-11-27 08:00:00.
    const NOW: i64 = 1_795_766_400 * SECOND;

    #[test]
    fn dates_before_2024_and_after_2262_are_doubtful() {
        for seconds in [0, 10, 1_000_000_000, 1_704_067_199] {
            assert!(is_doubtful(seconds * SECOND as u64), "{seconds}");
        }
        assert!(!is_doubtful(FIRST_NS) && !is_doubtful(NOW as u64));
        assert!(!is_doubtful(LAST_NS - 1));
        assert!(is_doubtful(LAST_NS) && is_doubtful(u64::MAX));
    }

    #[test]
    fn a_calendar_that_is_set_is_told_once_and_leads_to_the_true_dates() {
        // The machine has run for 20 s; its calendar began in 1970 with it, 10 s ago.
        let mut calendar = Calendar::new(-10 * SECOND);
        assert_eq!(calendar.look(20_000_000_000, -10 * SECOND), None);
        let set = calendar.look(24_000_000_000, NOW - 24 * SECOND);
        let set = set.expect("it was set");
        assert_eq!(set.at_ns, 14_000_000_000);
        assert_eq!(set.corrected(set.at_ns), NOW as u64);
        assert_eq!(calendar.look(25_000_000_000, NOW - 24 * SECOND), None);
        // Back again: by the dates as they began, nothing has changed.
        let back = calendar.look(26_000_000_000, -10 * SECOND).expect("again");
        assert_eq!((back.at_ns, back.by_ns), (16_000_000_000, 0));
        assert_eq!(Step::of_note(NAME, &set.to_texts()), Some(set));
        assert_eq!(Step::of_note("other", &set.to_texts()), None);
        assert_eq!(Step::of_note(NAME, &BTreeMap::new()), None);
    }

    #[test]
    fn a_clock_that_is_corrected_while_it_runs_was_not_set() {
        let mut calendar = Calendar::new(NOW);
        for second in 1..1_000 {
            // 500 in a million, the most that the kernel does, and some jitter.
            let offset = NOW + second * 500_000 % 200_000_000;
            assert_eq!(calendar.look(0, offset), None);
        }
        // Nothing overflows, whatever the clocks say.
        let step = calendar.look(u64::MAX, i64::MIN).expect("a step");
        assert_eq!(step.corrected(0), 0);
        let step = calendar.look(0, i64::MAX).expect("a step");
        assert_eq!(step.corrected(u64::MAX), u64::MAX);
    }
}
