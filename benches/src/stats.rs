//! Quantiles of samples and medians over runs.

use serde::{Deserialize, Serialize};

/// The figures of one run of one row, or their medians over several runs; times in ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Quantiles {
    /// The number of samples.
    pub n: u64,
    /// The median.
    pub p50_ns: u64,
    /// 99 % of the samples are at most this.
    pub p99_ns: u64,
    /// 99.9 % of the samples are at most this.
    pub p999_ns: u64,
}

impl Quantiles {
    /// The figures of `samples`, which this sorts; `None` if there are none.
    pub(crate) fn of(samples: &mut [u64]) -> Option<Self> {
        samples.sort_unstable();
        Some(Self {
            n: samples.len() as u64,
            p50_ns: at(samples, 500)?,
            p99_ns: at(samples, 990)?,
            p999_ns: at(samples, 999)?,
        })
    }

    /// Each figure's median over the runs, and the number of all samples; `None` without a run.
    pub(crate) fn over(runs: &[Self]) -> Option<Self> {
        let middle = |figure: fn(&Self) -> u64| {
            let mut figures: Vec<u64> = runs.iter().map(figure).collect();
            figures.sort_unstable();
            at(&figures, 500)
        };
        Some(Self {
            n: runs.iter().map(|run| run.n).sum(),
            p50_ns: middle(|run| run.p50_ns)?,
            p99_ns: middle(|run| run.p99_ns)?,
            p999_ns: middle(|run| run.p999_ns)?,
        })
    }
}

/// The smallest sample that `permille` of all samples do not exceed (nearest rank).
pub(crate) fn at(sorted: &[u64], permille: usize) -> Option<u64> {
    let rank = (sorted.len() * permille).div_ceil(1000);
    sorted.get(rank.saturating_sub(1)).copied()
}

/// The median; the mean of the middle two of an even number. `None` if there is no value.
#[must_use]
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(f64::midpoint(lower, upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_samples_by_nearest_rank() {
        let mut samples: Vec<u64> = (1..=1000).rev().collect();
        assert_eq!(
            Quantiles::of(&mut samples),
            Some(Quantiles {
                n: 1000,
                p50_ns: 500,
                p99_ns: 990,
                p999_ns: 999
            })
        );
    }

    #[test]
    fn few_samples_have_the_largest_as_their_tail() {
        let quantiles = Quantiles::of(&mut [7, 5]).unwrap();
        assert_eq!((quantiles.p50_ns, quantiles.p99_ns), (5, 7));
        assert_eq!(Quantiles::of(&mut [3]).unwrap().p999_ns, 3);
        assert_eq!(Quantiles::of(&mut []), None);
    }

    #[test]
    fn one_bad_run_of_five_moves_no_figure() {
        let run = |p50_ns| Quantiles {
            n: 10,
            p50_ns,
            p99_ns: 2 * p50_ns,
            p999_ns: 3 * p50_ns,
        };
        let over = Quantiles::over(&[run(100), run(9000), run(101), run(99), run(102)]);
        assert_eq!(over, Some(Quantiles { n: 50, ..run(101) }));
        assert_eq!(Quantiles::over(&[]), None);
    }

    #[test]
    fn the_median_lies_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(Vec::new()), None);
    }
}
