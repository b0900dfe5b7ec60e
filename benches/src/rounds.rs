//! The times of a row, round by round and run by run: what a session brings, and what a report is made
//! of. Nothing here measures.

use serde::{Deserialize, Serialize};

use crate::stats::{Distribution, median};

/// The times of one round of a row, in ns: from when each was sent, and from when it was due.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Taken {
    /// From when each sample was sent.
    pub service: Vec<u64>,
    /// From when each was due; empty if the samples are sent as fast as they come back.
    pub response: Vec<u64>,
    /// Samples that came before they were sent, by the clock. They are in neither.
    pub disordered: u64,
    /// Samples that were overwritten before their reader had them.
    pub lost: u64,
    /// Samples a second: planned and sent. `None` if they are sent as fast as they come back.
    pub rate: Option<Rate>,
}

impl Taken {
    /// The times of samples that were due every `period` ns: when each was due, sent and received.
    pub(crate) fn paced(period: u64, samples: impl IntoIterator<Item = [u64; 3]>) -> Self {
        let mut taken = Self::default();
        let (mut first, mut last, mut n) = (None, 0, 0_u32);
        for [due, sent, received] in samples {
            taken.add(Some(due), sent, received);
            (last, n) = (sent, n + 1);
            first = first.or(Some(sent));
        }
        let took = last.saturating_sub(first.unwrap_or(last));
        taken.rate = (took > 0).then(|| Rate {
            asked_hz: 1e9 / period as f64,
            reached_hz: f64::from(n - 1) * 1e9 / took as f64,
        });
        taken
    }

    /// Adds a sample by the clock's readings.
    pub(crate) fn add(&mut self, due: Option<u64>, sent: u64, received: u64) {
        let Some(service) = received.checked_sub(sent) else {
            self.disordered += 1;
            return;
        };
        self.service.push(service);
        self.response
            .extend(due.map(|due| service + sent.saturating_sub(due)));
    }
}

/// Samples a second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// That were due.
    pub asked_hz: f64,
    /// That were sent.
    pub reached_hz: f64,
}

impl Rate {
    /// The median of what the rounds reached: one stall at the end of a round is not yet a machine
    /// that cannot do it.
    pub(crate) fn over<'a>(rounds: impl Iterator<Item = &'a Self> + Clone) -> Option<Self> {
        let asked_hz = rounds.clone().next()?.asked_hz;
        let reached_hz = median(rounds.map(|rate| rate.reached_hz).collect())?;
        Some(Self {
            asked_hz,
            reached_hz,
        })
    }

    /// Whether less than 99 % of what was asked was reached. Such times say how long the backlog
    /// grew, and nothing about the software at that rate.
    #[must_use]
    pub fn overload(&self) -> bool {
        self.reached_hz < 0.99 * self.asked_hz
    }
}

/// The times of a row in one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// From when each sample was sent.
    pub service: Distribution,
    /// From when each was due; empty if the samples have no plan.
    pub response: Distribution,
    /// Samples that came before they were sent, by the clock.
    #[serde(default)]
    pub disordered: u64,
    /// Samples that were overwritten before their reader had them.
    #[serde(default)]
    pub lost: u64,
    /// The rate of each round.
    #[serde(default)]
    pub rates: Vec<Rate>,
    /// When it began, in seconds since the measurement's beginning.
    #[serde(default)]
    pub from_s: f64,
    /// How long it took in seconds, with the turns of the other rows.
    #[serde(default)]
    pub took_s: f64,
}

impl Run {
    /// Adds a round.
    pub(crate) fn add(&mut self, taken: Taken) {
        self.service.extend(taken.service);
        self.response.extend(taken.response);
        self.disordered += taken.disordered;
        self.lost += taken.lost;
        self.rates.extend(taken.rate);
    }

    /// What a person waits for who asks for the row's times: response times where there is a plan.
    #[must_use]
    pub fn times(&self) -> &Distribution {
        match self.response.quantiles().n {
            0 => &self.service,
            _ => &self.response,
        }
    }
}

/// The lowest and the highest figure of the runs, in ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Spread {
    /// Of each run's p50.
    pub p50_ns: [u64; 2],
    /// Of each run's p99; `None` if no run has enough samples for it.
    pub p99_ns: Option<[u64; 2]>,
}

impl Spread {
    /// `None` for a single run, and if no run has enough samples.
    pub(crate) fn over(runs: &[Run]) -> Option<Self> {
        let ends = |percent| {
            let of = |run: &Run| run.times().percentile(percent);
            let figures = || runs.iter().filter_map(of);
            Some([figures().min()?, figures().max()?])
        };
        (runs.len() > 1).then_some(())?;
        Some(Self {
            p50_ns: ends(50.0)?,
            p99_ns: ends(99.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_that_came_before_it_was_sent_is_counted_and_in_no_percentile() {
        let taken = Taken::paced(100, [[0, 0, 30], [100, 100, 90], [200, 250, 290]]);
        assert_eq!((taken.service, taken.disordered), (vec![30, 40], 1));
        assert_eq!(taken.response, [30, 90]);
    }

    #[test]
    fn a_rate_that_was_not_reached_is_told_from_one_that_stumbled() {
        let due = |number: u64| number * 1_000;
        let reached = |sent: &dyn Fn(u64) -> u64| {
            let samples = (0..1_000).map(|number| [due(number), sent(number), sent(number) + 10]);
            Taken::paced(1_000, samples).rate.unwrap()
        };
        // Twice as long for each sample; and one stall, after which it has caught up.
        let slow = reached(&|number| 2 * due(number));
        let stumbled = reached(&|number| due(number) + if number == 500 { 900 } else { 0 });
        assert!(
            slow.overload() && !stumbled.overload(),
            "{slow:?} {stumbled:?}"
        );
        assert!((slow.reached_hz - 500_000.0).abs() < 1.0, "{slow:?}");
    }
}
