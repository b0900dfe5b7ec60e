//! Compares two saved measurements, row by row, with an interval for each ratio.
//!
//! The runs of a measurement are its observations: the interval says how far their order could also
//! have made the ratio. It is that of Hodges and Lehmann for two independent samples (all ratios of
//! a run of the one and a run of the other, less as many at each end as the distribution of Mann and
//! Whitney's U allows), at 95 %. It assumes no shape of the noise, and needs four runs on each side.
//!
//! Two machines are never compared unless somebody insists, and nothing makes a result the next
//! baseline: five results, each 0.9 % slower than the last, are 4.6 % slower than the first.

use core::fmt;

use serde::Serialize;

use crate::report::Row;
use crate::rounds::Run;
use crate::saved::{Saved, SavedRow};

/// Why two measurements cannot be compared.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum Incomparable {
    /// They come from machines that differ in this.
    #[error(
        "not comparable: {field} was `{a}`, and is `{b}`; measure both on one machine, or give --across-machines"
    )]
    Machine {
        /// The name of what differs.
        field: &'static str,
        /// In the first measurement.
        a: String,
        /// In the second.
        b: String,
    },
    /// No row of the first is in the second, or none has enough runs.
    #[error(
        "nothing to compare: {0}; measure the same rows twice, each with --runs 4 or more and --out"
    )]
    Nothing(&'static str),
}

/// What is said of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Its interval has 1 in it, or it is slower by less than the limit.
    Same,
    /// The whole interval is below 1.
    Faster,
    /// The whole interval is above 1, and the ratio above the limit.
    Slower,
    /// Too few runs, or too few samples in them, for an interval.
    TooFew,
    /// One of both did not reach the rate that was asked for.
    Overload,
    /// Only the second measurement has it.
    New,
    /// Only the first measurement has it.
    Missing,
}

/// A percentile of a row in both measurements.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// `WHAT MODE REGIME: ROW p50`.
    pub figure: String,
    /// The verdict.
    pub verdict: Verdict,
    /// Second by first, and the ends of the interval.
    pub ratio: Option<[f64; 3]>,
}

/// The comparison of two measurements.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// What differs between the machines, if somebody insisted.
    pub across_machines: Option<String>,
    /// A row is slower from this ratio on.
    pub limit: f64,
    /// Every row of both.
    pub rows: Vec<Compared>,
}

impl Comparison {
    /// Compares `b` with `a`; a row is slower if its ratio is above `limit`.
    ///
    /// # Errors
    /// See [`Incomparable`].
    pub fn of<'s>(
        a: &'s Saved,
        b: &'s Saved,
        limit: f64,
        across: bool,
    ) -> Result<Self, Incomparable> {
        let differs = a.machine.differs(&b.machine);
        if let (Some((field, a, b)), false) = (differs.clone(), across) {
            return Err(Incomparable::Machine { field, a, b });
        }
        let mut rows = Vec::new();
        // A row without runs only counts something, such as frames that were overtaken.
        let measured = |saved: &'s Saved| saved.rows.iter().filter(|one| !one.runs.is_empty());
        for one in measured(a) {
            let name = name(&one.row);
            match measured(b).find(|other| self::name(&other.row) == name) {
                Some(other) => rows.extend(both(&name, one, other, limit)),
                None => rows.push(alone(name, Verdict::Missing)),
            }
        }
        for other in measured(b) {
            let name = name(&other.row);
            if !measured(a).any(|one| self::name(&one.row) == name) {
                rows.push(alone(name, Verdict::New));
            }
        }
        let judged = |one: &Compared| one.ratio.is_some();
        match rows.iter().any(judged) {
            true => Ok(Self {
                across_machines: differs.map(|(field, a, b)| format!("{field}: {a}, and {b}")),
                limit,
                rows,
            }),
            false
                if rows
                    .iter()
                    .all(|row| matches!(row.verdict, Verdict::New | Verdict::Missing)) =>
            {
                Err(Incomparable::Nothing("they have no row in common"))
            }
            false => Err(Incomparable::Nothing(
                "no row has four runs with enough samples at its rate in both",
            )),
        }
    }

    /// Whether something became slower or vanished.
    #[must_use]
    pub fn fails(&self) -> bool {
        let mut rows = self.rows.iter();
        rows.any(|row| matches!(row.verdict, Verdict::Slower | Verdict::Missing))
    }
}

/// Rows of path@observed and of hop have different names; those of both measurements the same.
fn name(row: &Row) -> String {
    format!("{} {} {}: {}", row.what, row.mode, row.regime, row.label())
}

const fn alone(figure: String, verdict: Verdict) -> Compared {
    Compared {
        figure,
        verdict,
        ratio: None,
    }
}

/// The two percentiles of a row that both measurements have.
fn both(name: &str, a: &SavedRow, b: &SavedRow, limit: f64) -> [Compared; 2] {
    let overload = |one: &SavedRow| one.row.rate.is_some_and(|rate| rate.overload());
    [50.0, 99.0].map(|percent| {
        let figure = format!("{name} p{percent}");
        if overload(a) || overload(b) {
            return alone(figure, Verdict::Overload);
        }
        let of = |one: &SavedRow| -> Vec<f64> {
            let at = |run: &Run| run.times().percentile(percent);
            let figures = one.runs.iter().filter_map(at);
            figures.filter(|ns| *ns > 0).map(|ns| ns as f64).collect()
        };
        let Some([ratio, low, high]) = interval(&of(a), &of(b)) else {
            return alone(figure, Verdict::TooFew);
        };
        let verdict = match () {
            () if low > 1.0 && ratio > limit => Verdict::Slower,
            () if high < 1.0 => Verdict::Faster,
            () => Verdict::Same,
        };
        Compared {
            figure,
            verdict,
            ratio: Some([ratio, low, high]),
        }
    })
}

/// The median of all ratios of a `b` and an `a`, and the ends of its interval at 95 %. `None` if
/// these are too few.
fn interval(a: &[f64], b: &[f64]) -> Option<[f64; 3]> {
    let cut = cut(a.len(), b.len())?;
    let mut ratios: Vec<f64> = b
        .iter()
        .flat_map(|b| a.iter().map(move |a| b / a))
        .collect();
    ratios.sort_unstable_by(f64::total_cmp);
    let (low, high) = (ratios[cut], ratios[ratios.len() - 1 - cut]);
    Some([crate::stats::median(ratios)?, low, high])
}

/// How many ratios to leave out at each end: the most at which U is as small by chance in at most
/// 2.5 of 100 cases. `None` if even the smallest U is more frequent.
fn cut(m: usize, n: usize) -> Option<usize> {
    let counts = counts(m, n);
    let all: f64 = counts.iter().sum();
    let mut below = 0.0;
    let mut cut = None;
    for (u, count) in counts.iter().enumerate() {
        below += count / all;
        if below > 0.025 {
            break;
        }
        cut = Some(u);
    }
    cut
}

/// How many of the orders of `m` and `n` values give each U: the coefficients of the Gaussian
/// binomial, the product of (1 - q^(n+i)) / (1 - q^i) for i from 1 to m.
fn counts(m: usize, n: usize) -> Vec<f64> {
    let mut counts = vec![0.0; m * n + 1];
    counts[0] = 1.0;
    for i in 1..=m {
        for u in (n + i..=m * n).rev() {
            counts[u] -= counts[u - n - i];
        }
        for u in i..=m * n {
            counts[u] += counts[u - i];
        }
    }
    counts
}

impl fmt::Display for Comparison {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(across) = &self.across_machines {
            writeln!(
                formatter,
                "two machines ({across}): a ratio may be theirs\n"
            )?;
        }
        writeln!(
            formatter,
            "{:<62} {:>6}  {:<13} verdict",
            "figure", "ratio", "95 %"
        )?;
        for row in &self.rows {
            let verdict = match row.verdict {
                Verdict::Same => "",
                Verdict::Faster => "faster",
                Verdict::Slower => "slower",
                Verdict::TooFew => "too few runs or samples",
                Verdict::Overload => "overload",
                Verdict::New => "new, no baseline",
                Verdict::Missing => "missing",
            };
            let [ratio, interval] = row
                .ratio
                .map_or_else(Default::default, |[ratio, low, high]| {
                    [format!("{ratio:.3}"), format!("{low:.3}-{high:.3}")]
                });
            let line = format!("{:<62} {ratio:>6}  {interval:<13} {verdict}", row.figure);
            writeln!(formatter, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{Mode, Regime};
    use crate::rounds::Rate;
    use crate::stats::Distribution;
    use lager_machine::Machine;

    /// A measurement with these rows: name, and the median of each run in us.
    fn saved(rows: &[(&str, &[u64])]) -> Saved {
        let row = |(label, runs): &(&str, &[u64])| {
            let run = |us: &u64| Run {
                service: (0..1_000).map(|_| us * 1_000).collect(),
                ..Run::default()
            };
            let times = Distribution::default().quantiles();
            SavedRow {
                row: Row::new("hop", label, Mode::Block, Regime::Plain, times),
                runs: runs.iter().map(run).collect(),
            }
        };
        Saved::new(Machine::default(), rows.iter().map(row).collect())
    }

    fn verdicts(a: &Saved, b: &Saved) -> Vec<(String, Verdict)> {
        let comparison = Comparison::of(a, b, 1.03, false).unwrap();
        let rows = comparison.rows.into_iter();
        rows.map(|row| (row.figure, row.verdict)).collect()
    }

    #[test]
    fn the_interval_is_that_of_hodges_and_lehmann() {
        // From tables of the Mann-Whitney test, two-sided at 5 %.
        for (runs, largest) in [
            (4, Some(0)),
            (5, Some(2)),
            (8, Some(13)),
            (10, Some(23)),
            (3, None),
        ] {
            assert_eq!(cut(runs, runs), largest, "{runs} runs");
        }
        assert_eq!(counts(2, 2), [1.0, 1.0, 2.0, 1.0, 1.0]);
        let [ratio, low, high] = interval(&[10.0; 4], &[11.0, 12.0, 13.0, 14.0]).unwrap();
        assert_eq!((ratio, low, high), (1.25, 1.1, 1.4));
    }

    #[test]
    fn a_difference_within_the_noise_is_none() {
        let a = saved(&[("lager", &[100, 103, 98, 110, 101])]);
        let noise = saved(&[("lager", &[104, 99, 111, 100, 102])]);
        let slower = saved(&[("lager", &[120, 118, 125, 119, 122])]);
        let both =
            |verdict| ["p50", "p99"].map(|p| (format!("hop block plain: lager {p}"), verdict));
        assert_eq!(verdicts(&a, &noise), both(Verdict::Same));
        assert_eq!(verdicts(&a, &slower), both(Verdict::Slower));
        assert_eq!(verdicts(&slower, &a), both(Verdict::Faster));
    }

    #[test]
    fn small_steps_add_up_against_the_first() {
        let step = |us| saved(&[("lager", &[us, us + 1, us + 2, us + 3, us + 4])]);
        let steps = [10_000, 10_090, 10_180, 10_272, 10_365, 10_458].map(step);
        for pair in steps.windows(2) {
            assert!(
                !Comparison::of(&pair[0], &pair[1], 1.03, false)
                    .unwrap()
                    .fails()
            );
        }
        assert!(
            Comparison::of(&steps[0], &steps[5], 1.03, false)
                .unwrap()
                .fails()
        );
    }

    #[test]
    fn new_and_vanished_rows_are_named() {
        let runs: &[u64] = &[10, 11, 12, 13];
        let (a, b) = (
            saved(&[("a", runs), ("b", runs)]),
            saved(&[("b", runs), ("c", runs)]),
        );
        let comparison = Comparison::of(&a, &b, 1.03, false).unwrap();
        let of = |name: &str, verdict| {
            let mut rows = comparison.rows.iter();
            rows.any(|row| row.figure.contains(name) && row.verdict == verdict)
        };
        assert!(
            of(": a", Verdict::Missing) && of(": b p50", Verdict::Same) && of(": c", Verdict::New)
        );
        assert!(comparison.fails(), "what vanished is no success");
        let said = comparison.to_string();
        assert!(
            said.contains("missing") && said.contains("new, no baseline"),
            "{said}"
        );
        assert!(said.lines().all(|line| line.chars().count() <= 110));
    }

    #[test]
    fn nothing_that_can_be_judged_is_no_success() {
        let (few, other) = (
            saved(&[("a", &[10, 11, 12])]),
            saved(&[("b", &[10, 11, 12, 13])]),
        );
        let mut slow = saved(&[("b", &[10, 11, 12, 13])]);
        slow.rows[0].row.rate = Some(Rate {
            asked_hz: 2.0,
            reached_hz: 1.0,
        });
        for (a, b) in [
            (&few, &few),
            (&few, &other),
            (&other, &slow),
            (&saved(&[]), &other),
        ] {
            let refused = Comparison::of(a, b, 1.03, false);
            assert!(
                matches!(refused, Err(Incomparable::Nothing(_))),
                "{refused:?}"
            );
        }
    }

    #[test]
    fn another_machine_is_named_and_refused() {
        let a = saved(&[("a", &[10, 11, 12, 13])]);
        for (field, change) in [
            ("processor", (|m| m.processor.push('x')) as fn(&mut Machine)),
            ("cores", |m| m.cores += 1),
            ("governor", |m| m.governor.push('x')),
            ("kernel", |m| m.kernel.push('x')),
            ("clock source", |m| m.clock_source.push('x')),
        ] {
            let mut b = a.clone();
            change(&mut b.machine);
            let refused = Comparison::of(&a, &b, 1.03, false).unwrap_err();
            assert!(
                refused
                    .to_string()
                    .starts_with(&format!("not comparable: {field}"))
            );
            let insisted = Comparison::of(&a, &b, 1.03, true).unwrap();
            assert!(insisted.to_string().contains(field), "{insisted}");
        }
    }
}
