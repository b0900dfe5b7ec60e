//! Measures the figures that have limits, and measures again where a limit is broken.
//!
//! **Why again:** other work on the machine comes and goes, and may meet most of three runs. What
//! is measured again is put together with what was measured before, and the median of all runs
//! counts. So a single lucky run does not hide code that is slower than its limit.

use lager_benches::{BenchError, Mode, Options, Regime, Scenario};

use crate::figures::{Figures, FiguresError, RatioName};
use crate::judge::judge;
use crate::limits::Limits;

/// How thoroughly to measure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Thoroughness {
    /// Runs of each measurement; a ratio is the median over them.
    pub(crate) runs: usize,
    /// Measurements of a scenario while one of its limits is broken.
    pub(crate) attempts: usize,
}

/// Why a scenario has no figures.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MeasureError {
    #[error("{scenario}: {error}")]
    Bench {
        scenario: Scenario,
        error: BenchError,
    },
    #[error(transparent)]
    Figures(#[from] FiguresError),
}

/// What a scenario has shown.
#[derive(Debug)]
pub(crate) struct Measured {
    pub(crate) figures: Figures,
    pub(crate) attempts: usize,
}

/// Measures `scenario` until its limits are kept, at most as often as allowed.
pub(crate) fn measure(
    limits: &Limits,
    scenario: Scenario,
    how: Thoroughness,
) -> Result<Measured, MeasureError> {
    let options = options(limits, scenario, how.runs);
    let mut so_far: Option<Figures> = None;
    let mut attempts = 0;
    loop {
        attempts += 1;
        let figures = once(scenario, &options)?;
        let figures = match so_far.take() {
            Some(earlier) => earlier.pooled_with(figures),
            None => figures,
        };
        let broken = judge(limits, &figures)
            .0
            .iter()
            .any(|judgement| judgement.verdict.fails());
        if !broken || attempts >= how.attempts {
            return Ok(Measured { figures, attempts });
        }
        so_far = Some(figures);
    }
}

/// Measures `scenario` so many times and returns the figures of each, for whoever chooses limits.
pub(crate) fn spread(
    limits: &Limits,
    scenario: Scenario,
    runs: usize,
    times: usize,
) -> Result<Vec<Figures>, MeasureError> {
    let options = options(limits, scenario, runs);
    (0..times).map(|_| once(scenario, &options)).collect()
}

fn once(scenario: Scenario, options: &Options) -> Result<Figures, MeasureError> {
    let report = scenario
        .measure(options)
        .map_err(|error| MeasureError::Bench { scenario, error })?;
    let mut figures = Figures::of_report(scenario.as_str(), &report)?;
    if scenario == Scenario::Path
        && let Err(error) = lager_benches::may_have_real_time()
    {
        let note = format!("path@observed: {error}");
        figures.unmeasured.insert("path@observed".to_owned(), note);
    }
    Ok(figures)
}

/// Only the modes and regimes that some limit is about: the rest would cost minutes.
fn options(limits: &Limits, scenario: Scenario, runs: usize) -> Options {
    let names: Vec<RatioName> = limits
        .of(scenario.as_str())
        .filter_map(|limit| limit.figure.parse().ok())
        .collect();
    Options {
        runs,
        quick: true,
        modes: Mode::ALL
            .into_iter()
            .filter(|mode| names.iter().any(|name| name.mode == *mode))
            .collect(),
        regimes: Regime::ALL
            .into_iter()
            .filter(|regime| names.iter().any(|name| name.regime == *regime))
            .collect(),
    }
}
