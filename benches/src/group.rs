//! The order of measuring: contenders take turns in short rounds within each run, so that whatever
//! the machine does meanwhile hits all of them alike; ratios are taken within a run.
//!
//! What a round is, the scenario says; nothing here starts a process or reads a clock.

use std::io::{IsTerminal, Write};

use crate::error::BenchError;
use crate::parts::interrupted;
use crate::report::{Mode, Options, Ratio, Regime, Row};
use crate::slow;
use crate::stats::{Quantiles, median};

/// One line of a report before it is measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    /// See [`Row::name`].
    pub(crate) name: &'static str,
    /// See [`Row::variant`].
    pub(crate) variant: &'static str,
    /// See [`Row::mode`].
    pub(crate) mode: Mode,
    /// The labels it is compared with, the most important first; each belongs to an entry of the
    /// same group whose label is unique there.
    pub(crate) against: &'static [&'static str],
}

impl Entry {
    /// See [`Row::label`].
    pub(crate) fn label(&self) -> String {
        if self.variant.is_empty() {
            self.name.to_owned()
        } else {
            format!("{}/{}", self.name, self.variant)
        }
    }
}

/// The indices of the entries whose mode is wanted, and of those they are compared with.
pub(crate) fn wanted(entries: &[Entry], options: &Options) -> Vec<usize> {
    let asked = |entry: &Entry| options.modes.contains(&entry.mode);
    let needed = |entry: &Entry| {
        let label = entry.label();
        entries
            .iter()
            .any(|other| asked(other) && other.against.contains(&label.as_str()))
    };
    (0..entries.len())
        .filter(|index| asked(&entries[*index]) || needed(&entries[*index]))
        .collect()
}

/// Measures `entries` against each other: `options.runs` runs of `rounds` rounds each, every entry
/// once in each round, each round beginning with another one. `round` measures one entry once and
/// returns its samples in ns.
///
/// # Errors
/// What `round` returns, or somebody wants to stop.
pub(crate) fn measure(
    what: &str,
    regime: Regime,
    entries: &[Entry],
    options: &Options,
    rounds: usize,
    mut round: impl FnMut(usize) -> Result<Vec<u64>, BenchError>,
) -> Result<Vec<Row>, BenchError> {
    let mut runs: Vec<Vec<Quantiles>> = vec![Vec::new(); entries.len()];
    for run in 0..options.runs.max(1) {
        let mut samples: Vec<Vec<u64>> = vec![Vec::new(); entries.len()];
        for turn in 0..rounds {
            for place in 0..entries.len() {
                if interrupted() {
                    return Err(BenchError::Interrupted);
                }
                let index = (place + turn) % entries.len();
                progress(what, regime, run, options, &entries[index]);
                let entry = &entries[index];
                slow::row(&format!(
                    "{what} {} {regime}: {}",
                    entry.mode,
                    entry.label()
                ));
                samples[index].extend(round(index)?);
            }
        }
        for (index, samples) in samples.iter_mut().enumerate() {
            runs[index].extend(Quantiles::of(samples));
        }
    }
    clear_progress();
    Ok(rows(what, regime, entries, &runs))
}

/// The rows of what was measured: `runs` holds each entry's runs, the same number of each.
pub(crate) fn rows(
    what: &str,
    regime: Regime,
    entries: &[Entry],
    runs: &[Vec<Quantiles>],
) -> Vec<Row> {
    entries
        .iter()
        .zip(runs)
        .filter_map(|(entry, own)| {
            let over = Quantiles::over(own)?;
            let ratios: Vec<Ratio> = entry
                .against
                .iter()
                .filter_map(|label| {
                    let other = entries.iter().position(|other| other.label() == **label)?;
                    ratio(label, own, &runs[other])
                })
                .collect();
            let first = ratios.first();
            Some(Row {
                name: entry.name.to_owned(),
                variant: entry.variant.to_owned(),
                what: what.to_owned(),
                mode: entry.mode,
                regime,
                n: over.n,
                p50_ns: over.p50_ns,
                p99_ns: over.p99_ns,
                p999_ns: over.p999_ns,
                ratio_to: first.map_or_else(String::new, |first| first.to.clone()),
                ratio_p50: first.map_or(1.0, |first| first.p50),
                ratio_p99: first.map_or(1.0, |first| first.p99),
                ratios,
                cpu_percent: None,
            })
        })
        .collect()
}

/// The median of the ratios of each run: what drifts from run to run cancels.
fn ratio(to: &str, own: &[Quantiles], other: &[Quantiles]) -> Option<Ratio> {
    let runs: Vec<[f64; 2]> = own
        .iter()
        .zip(other)
        // A clock that cannot tell a sample from nothing cannot tell ratios either.
        .filter(|(_, other)| other.p50_ns > 0)
        .map(|(own, other)| {
            [
                own.p50_ns as f64 / other.p50_ns as f64,
                own.p99_ns as f64 / other.p99_ns as f64,
            ]
        })
        .collect();
    Some(Ratio {
        to: to.to_owned(),
        p50: median(runs.iter().map(|run| run[0]).collect())?,
        p99: median(runs.iter().map(|run| run[1]).collect())?,
        runs,
    })
}

/// Says to a person at a terminal that something is going on.
fn progress(what: &str, regime: Regime, run: usize, options: &Options, entry: &Entry) {
    let mut terminal = std::io::stderr();
    if terminal.is_terminal() {
        let _ = write!(
            terminal,
            "\r\x1b[K{what}, {regime}: run {} of {}, {} {}",
            run + 1,
            options.runs.max(1),
            entry.label(),
            entry.mode
        );
    }
}

fn clear_progress() {
    let mut terminal = std::io::stderr();
    if terminal.is_terminal() {
        let _ = write!(terminal, "\r\x1b[K");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENTRIES: &[Entry] = &[
        Entry {
            name: "lager",
            variant: "",
            mode: Mode::Spin,
            against: &["iceoryx2/header"],
        },
        Entry {
            name: "iceoryx2",
            variant: "header",
            mode: Mode::Spin,
            against: &[],
        },
        Entry {
            name: "lager",
            variant: "",
            mode: Mode::Adaptive,
            against: &["iceoryx2/header"],
        },
        Entry {
            name: "pipe",
            variant: "",
            mode: Mode::Block,
            against: &[],
        },
    ];

    fn options(modes: &[Mode]) -> Options {
        Options {
            runs: 3,
            quick: true,
            modes: modes.to_vec(),
            regimes: vec![Regime::Plain],
        }
    }

    #[test]
    fn a_wanted_mode_brings_what_it_is_compared_with() {
        assert_eq!(wanted(ENTRIES, &options(&[Mode::Adaptive])), [1, 2]);
        assert_eq!(wanted(ENTRIES, &options(&[Mode::Block])), [3]);
        assert_eq!(wanted(ENTRIES, &options(&Mode::ALL)), [0, 1, 2, 3]);
    }

    #[test]
    fn contenders_take_turns_and_each_round_begins_with_another() {
        let mut order = Vec::new();
        let options = Options {
            runs: 1,
            ..options(&Mode::ALL)
        };
        measure("hop", Regime::Plain, &ENTRIES[..3], &options, 3, |index| {
            order.push(index);
            Ok(vec![1])
        })
        .unwrap();
        assert_eq!(order, [0, 1, 2, 1, 2, 0, 2, 0, 1]);
    }

    #[test]
    fn a_machine_that_drifts_from_run_to_run_does_not_move_a_ratio() {
        // Each run is ten times slower than the one before, for both alike.
        let mut rounds = [0_u32; 2];
        let rows = measure(
            "hop",
            Regime::Plain,
            &ENTRIES[..2],
            &options(&Mode::ALL),
            1,
            |index| {
                let drift = 10_u64.pow(rounds[index]);
                rounds[index] += 1;
                let own = [120, 100][index];
                Ok(vec![own * drift; 100])
            },
        )
        .unwrap();
        assert_eq!(rows[0].ratio_to, "iceoryx2/header");
        assert!((rows[0].ratio_p50 - 1.2).abs() < 1e-9, "{rows:?}");
        assert_eq!((rows[0].n, rows[0].p50_ns), (300, 1200));
        assert_eq!((rows[1].ratio_to.as_str(), rows[1].ratio_p50), ("", 1.0));
    }

    #[test]
    fn what_fails_in_a_round_ends_the_measurement() {
        let failed = measure("hop", Regime::Plain, ENTRIES, &options(&[]), 1, |_| {
            Err(BenchError::NothingToMeasure("on purpose".to_owned()))
        });
        assert!(matches!(failed, Err(BenchError::NothingToMeasure(_))));
    }
}
