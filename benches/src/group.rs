//! A group of rows that take turns in short rounds within each run. So other work on the machine
//! hits all rows alike, and a ratio compares figures of one run.
//!
//! This file alone defines how a measurement runs: `lager bench` runs whole groups
//! ([`Group::measure`]), criterion asks for the rounds of a row ([`Group::open`]). The scenario
//! defines a round; nothing here times a sample.

use std::io::{IsTerminal, Write};
use std::time::Instant;

use lager_rig::{Process, Watch, heed_interrupts, interrupted};

use crate::error::BenchError;
use crate::machine::kept_awake;
use crate::report::{Mode, Options, Ratio, Regime, Row};
use crate::rounds::{Rate, Run, Spread, Taken};
use crate::stats::{Distribution, median};

/// One line of a report before it is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// See [`Row::label`].
    pub label: &'static str,
    /// See [`Row::mode`].
    pub mode: Mode,
    /// The labels with which it is compared, the most important first. Each is the unique label of
    /// an entry of the same group.
    pub against: &'static [&'static str],
}

impl Entry {
    pub(crate) const fn new(
        label: &'static str,
        mode: Mode,
        against: &'static [&'static str],
    ) -> Self {
        Self {
            label,
            mode,
            against,
        }
    }
}

/// The processes that are open while a group is measured. It stays in the thread that opened it:
/// the processes end with that thread, which may also be bound to a core.
pub trait Session {
    /// Measures the entry with that index `samples` times.
    ///
    /// # Errors
    /// A process or the carrier failed; the session cannot be used any more.
    fn round(&mut self, index: usize, samples: usize) -> Result<Taken, BenchError>;

    /// Adds further figures to the rows when everything is measured.
    ///
    /// # Errors
    /// As [`Session::round`].
    fn finish(&mut self, _rows: &mut Vec<Row>) -> Result<(), BenchError> {
        Ok(())
    }
}

/// The result of opening a session.
pub type Opened = Result<Box<dyn Session>, BenchError>;

/// A session, and the processes that keep the cores from halting as long as it is open.
struct Awake {
    session: Box<dyn Session>,
    _spinners: Vec<Process>,
}

impl Session for Awake {
    fn round(&mut self, index: usize, samples: usize) -> Result<Taken, BenchError> {
        self.session.round(index, samples)
    }

    fn finish(&mut self, rows: &mut Vec<Row>) -> Result<(), BenchError> {
        self.session.finish(rows)
    }
}

/// Rows that are compared with each other.
pub struct Group {
    /// See [`Row::what`].
    pub what: String,
    /// See [`Row::regime`].
    pub regime: Regime,
    /// The rows.
    pub entries: Vec<Entry>,
    /// Rounds of each entry in a run: with `--quick`, and without.
    pub(crate) rounds: [usize; 2],
    /// Samples of a round: with `--quick`, and without.
    pub(crate) samples: [usize; 2],
    pub(crate) open: Box<dyn Fn() -> Opened + Send>,
}

impl Group {
    /// Starts in this thread the processes that measure it, and what keeps the cores from halting.
    ///
    /// # Errors
    /// See [`BenchError`].
    pub fn open(&self) -> Opened {
        heed_interrupts();
        let _spinners = kept_awake(self.regime)?;
        let session = (self.open)()?;
        Ok(Box::new(Awake { session, _spinners }))
    }

    /// Measures all entries in a thread of its own, in `options.runs` runs of some rounds. In each
    /// round every entry has one turn; each round begins with another entry. If the user has no
    /// right to real time, prints a sentence and leaves out what needs that right.
    ///
    /// # Errors
    /// A session failed, or the user wants to stop. If this machine was held up when something did
    /// not come in time, the error says so ([`BenchError::HeldUp`]).
    pub(crate) fn measure(self, options: &Options) -> Result<Vec<Row>, BenchError> {
        let watch = Watch::begin();
        let measured = std::thread::scope(|scope| {
            let measuring = scope.spawn(move || self.open_and_measure(options));
            let joined = measuring.join();
            joined.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        });
        match measured {
            Err(error @ BenchError::RealTime(_)) => {
                eprintln!("{error}");
                Ok(Vec::new())
            }
            measured => measured.map_err(|error| error.seen_by(watch)),
        }
    }

    fn open_and_measure(&self, options: &Options) -> Result<Vec<Row>, BenchError> {
        let mut session = self.open()?;
        let mut rows = self.take_turns(options, &mut *session)?;
        session.finish(&mut rows)?;
        Ok(rows)
    }

    fn take_turns(
        &self,
        options: &Options,
        session: &mut dyn Session,
    ) -> Result<Vec<Row>, BenchError> {
        let (what, regime, entries) = (&self.what, self.regime, &self.entries);
        let thorough = usize::from(!options.quick);
        let samples = options.samples.unwrap_or(self.samples[thorough]);
        let mut runs: Vec<Vec<Run>> = vec![Vec::new(); entries.len()];
        let count = options.runs.max(1);
        let began = Instant::now();
        for run in 0..count {
            let from_s = began.elapsed().as_secs_f64();
            for own in &mut runs {
                own.push(Run {
                    from_s,
                    ..Run::default()
                });
            }
            for turn in 0..self.rounds[thorough] {
                for place in 0..entries.len() {
                    if interrupted() {
                        return Err(BenchError::Interrupted);
                    }
                    let index = (place + turn) % entries.len();
                    let entry = &entries[index];
                    let row = format!("{what} {} {regime}: {}", entry.mode, entry.label);
                    tell(&format!("{row}, run {} of {count}", run + 1));
                    runs[index][run].add(session.round(index, samples)?);
                }
            }
            for own in &mut runs {
                own[run].took_s = began.elapsed().as_secs_f64() - from_s;
            }
        }
        tell("");
        Ok(rows(what, regime, entries, runs))
    }
}

/// The rows of the results: `runs` holds each entry's runs, the same number of each.
fn rows(what: &str, regime: Regime, entries: &[Entry], runs: Vec<Vec<Run>>) -> Vec<Row> {
    let ratios = |(index, entry): (usize, &Entry)| -> Vec<Ratio> {
        let ratio_to = |label: &&str| {
            let other = entries.iter().position(|other| other.label == *label)?;
            ratio(label, &runs[index], &runs[other])
        };
        entry.against.iter().filter_map(ratio_to).collect()
    };
    let ratios: Vec<_> = entries.iter().enumerate().map(ratios).collect();
    let row = |((entry, runs), ratios): ((&Entry, Vec<Run>), Vec<Ratio>)| {
        let merged = |of: fn(&Run) -> &Distribution| {
            let mut all = Distribution::default();
            runs.iter().for_each(|run| all.add(of(run)));
            all.quantiles()
        };
        let service = merged(|run| &run.service);
        let response = merged(|run| &run.response);
        let paced = response.n > 0;
        let times = if paced { response } else { service };
        (times.n > 0).then(|| Row {
            service: paced.then_some(service),
            spread: Spread::over(&runs),
            rate: Rate::over(runs.iter().flat_map(|run| &run.rates)),
            disordered: runs.iter().map(|run| run.disordered).sum(),
            lost: runs.iter().map(|run| run.lost).sum(),
            ratios,
            runs,
            ..Row::new(what, entry.label, entry.mode, regime, times)
        })
    };
    let entries = entries.iter().zip(runs).zip(ratios);
    entries.filter_map(row).collect()
}

/// The median of each run's ratio, in which a drift from run to run cancels. It compares service
/// times: what the software takes for one sample. A stall of the machine hits one of two rows that
/// take turns, so in response times it would be the ratio of their luck.
fn ratio(to: &str, own: &[Run], other: &[Run]) -> Option<Ratio> {
    let by = |percent| {
        move |(own, other): (&Run, &Run)| {
            let at = |run: &Run| run.service.percentile(percent);
            // If the clock is too coarse for the samples, there are no ratios.
            let other = at(other).filter(|ns| *ns > 0)?;
            Some(at(own)? as f64 / other as f64)
        }
    };
    let pairs = || own.iter().zip(other);
    let runs: Vec<_> = pairs()
        .filter_map(|pair| Some((by(50.0)(pair)?, by(99.0)(pair))))
        .collect();
    Some(Ratio {
        to: to.to_owned(),
        p50: median(runs.iter().map(|run| run.0).collect())?,
        p99: median(runs.iter().filter_map(|run| run.1).collect()),
        runs,
    })
}

/// Shows the current step to a person at a terminal, in place of the step before.
fn tell(now: &str) {
    let mut terminal = std::io::stderr();
    if terminal.is_terminal() {
        let _ = write!(terminal, "\r\x1b[K{now}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENTRIES: &[Entry] = &[
        Entry::new("lager", Mode::Spin, &["iceoryx2/header"]),
        Entry::new("iceoryx2/header", Mode::Spin, &[]),
        Entry::new("pipe", Mode::Block, &[]),
    ];

    /// The results of each round of an entry of [`ENTRIES`].
    struct Planned<R>(R);

    impl<R: FnMut(usize) -> Result<Vec<u64>, BenchError>> Session for Planned<R> {
        fn round(&mut self, index: usize, _: usize) -> Result<Taken, BenchError> {
            let service = (self.0)(index)?;
            Ok(Taken {
                service,
                ..Taken::default()
            })
        }
    }

    fn measure(
        entries: &[Entry],
        runs: usize,
        rounds: usize,
        round: impl FnMut(usize) -> Result<Vec<u64>, BenchError>,
    ) -> Result<Vec<Row>, BenchError> {
        let group = Group {
            what: "hop".to_owned(),
            regime: Regime::Plain,
            entries: entries.to_vec(),
            rounds: [rounds; 2],
            samples: [1; 2],
            open: Box::new(|| unreachable!("it is open")),
        };
        let options = Options {
            runs,
            ..Options::default()
        };
        group.take_turns(&options, &mut Planned(round))
    }

    #[test]
    fn rows_take_turns_and_each_round_begins_with_another() {
        let mut order = Vec::new();
        measure(ENTRIES, 1, 3, |index| {
            order.push(index);
            Ok(vec![1])
        })
        .unwrap();
        assert_eq!(order, [0, 1, 2, 1, 2, 0, 2, 0, 1]);
    }

    #[test]
    fn a_machine_that_drifts_from_run_to_run_does_not_move_a_ratio() {
        // Each run is ten times slower than the one before, for both entries alike.
        let mut rounds = [0_u32; 2];
        let rows = measure(&ENTRIES[..2], 3, 1, |index| {
            let drift = 10_u64.pow(rounds[index]);
            rounds[index] += 1;
            let own = [120, 100][index];
            Ok(vec![own * drift; 100])
        })
        .unwrap();
        assert_eq!(rows[0].ratios[0].to, "iceoryx2/header");
        assert!((rows[0].ratios[0].p50 - 1.2).abs() < 1e-3, "{rows:?}");
        assert_eq!(rows[0].ratios[0].p99, None, "a run has 100 samples");
        assert_eq!((rows[0].times.n, rows[0].times.p50_ns), (300, Some(1200)));
        let spread = rows[0].spread.unwrap();
        assert!(spread.p50_ns[0] == 120 && spread.p50_ns[1] >= 12_000);
        assert_eq!(rows[1].ratios, []);
    }

    #[test]
    fn what_fails_in_a_round_ends_the_measurement() {
        let failed = measure(ENTRIES, 1, 1, |_| Err(BenchError::Interrupted));
        assert!(matches!(failed, Err(BenchError::Interrupted)));
    }
}
