//! [`Recent`]: the values that a sensor has told in the last moments.

use core::time::Duration;
use std::collections::VecDeque;

/// How far back a value counts, in robot time.
const WINDOW: Duration = Duration::from_millis(500);
/// Without a new value for this long, the sensor is silent.
const SILENT: Duration = Duration::from_millis(400);
/// So many values are needed; one alone may be disturbed.
const FEWEST: usize = 5;

/// The values of the last half second.
#[derive(Clone, Debug)]
pub(crate) struct Recent<T>(VecDeque<(Duration, T)>);

impl<T> Default for Recent<T> {
    fn default() -> Self {
        Self(VecDeque::new())
    }
}

impl<T: Copy + Ord> Recent<T> {
    pub(crate) fn push(&mut self, now: Duration, value: T) {
        self.0.push_back((now, value));
        while self.0.front().is_some_and(|(at, _)| *at + WINDOW < now) {
            self.0.pop_front();
        }
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// All of them in rising order, unless the sensor is silent.
    pub(crate) fn all(&self, now: Duration) -> Option<Vec<T>> {
        let (newest, _) = self.0.back()?;
        let mut values: Vec<T> = self
            .0
            .iter()
            .filter(|(at, _)| *at + WINDOW >= now)
            .map(|(_, value)| *value)
            .collect();
        values.sort_unstable();
        (*newest + SILENT >= now && values.len() >= FEWEST).then_some(values)
    }

    /// The middle one.
    pub(crate) fn median(&self, now: Duration) -> Option<T> {
        let values = self.all(now)?;
        values.get(values.len() / 2).copied()
    }

    /// The most frequent one.
    pub(crate) fn mode(&self, now: Duration) -> Option<T> {
        let values = self.all(now)?;
        let runs = values.chunk_by(|one, other| one == other);
        runs.max_by_key(|run| run.len())?.first().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    #[test]
    fn one_wrong_value_and_an_old_one_do_not_count() {
        let mut recent = Recent::default();
        recent.push(ms(0), 900);
        for (at, value) in [(600, 7), (610, 8), (620, 0), (630, 8), (640, 8)] {
            recent.push(ms(at), value);
        }
        assert_eq!(recent.median(ms(650)), Some(8));
        assert_eq!(recent.mode(ms(650)), Some(8));
        assert_eq!(recent.all(ms(650)).map(|all| all.len()), Some(5));
    }

    #[test]
    fn a_silent_sensor_has_no_value() {
        let mut recent = Recent::default();
        for at in 0..10 {
            recent.push(ms(at), 1);
        }
        assert_eq!(recent.median(ms(409)), Some(1));
        assert_eq!(recent.median(ms(410)), None);
    }
}
