//! Measures the figures that have limits, and measures again if a limit is broken.
//!
//! **Why again:** other work on the machine comes and goes, and may disturb most of three runs. The
//! median of all runs of all measurements counts, so one lucky run does not hide code that is
//! slower than its limit. A measurement that ended early because the machine was held up has no
//! figures, and is made again, too. One that ended early on any other machine is the guard's end.

use lager_benches::{BenchError, Options, Scenario, may_have_real_time};

use crate::error::GuardError;
use crate::figures::{Figures, RatioName};
use crate::judge::judge;
use crate::limits::Limits;

/// Measures `scenario` until its limits are kept, at most `attempts` times. Returns the figures,
/// and a note for each measurement that broke a limit. Says at once if one is made again because
/// the machine was held up.
pub(crate) fn measure(
    limits: &Limits,
    scenario: Scenario,
    runs: usize,
    attempts: usize,
) -> Result<(Figures, Vec<String>), GuardError> {
    let mut figures: Option<Figures> = None;
    let mut notes = Vec::new();
    for left in (0..attempts).rev() {
        match once(limits, scenario, runs) {
            Err(GuardError::Scenario(_, error @ BenchError::HeldUp(..))) if left > 0 => {
                eprintln!("benches/guard: {scenario} is measured again: {error}");
            }
            Err(error) => return Err(error),
            Ok(more) => {
                let all = match figures.take() {
                    Some(before) => before.pooled_with(more),
                    None => more,
                };
                let (judgements, _) = judge(limits, &all);
                if left == 0 || !judgements.iter().any(|one| one.verdict.fails()) {
                    return Ok((all, notes));
                }
                notes.push(format!(
                    "{scenario}: measured again, because a limit was broken; the medians of all runs count"
                ));
                figures = Some(all);
            }
        }
    }
    unreachable!("there is at least one attempt, and the last one returns")
}

/// Measures `scenario` once.
pub(crate) fn once(
    limits: &Limits,
    scenario: Scenario,
    runs: usize,
) -> Result<Figures, GuardError> {
    let report = scenario
        .measure(&options(limits, scenario, runs))
        .map_err(|error| GuardError::Scenario(scenario, error))?;
    let mut figures = Figures::of_report(&scenario.to_string(), &report)?;
    if scenario == Scenario::Path
        && let Err(error) = may_have_real_time()
    {
        let note = format!("path@observed: {error}");
        figures.unmeasured.insert("path@observed".to_owned(), note);
    }
    Ok(figures)
}

/// Only the modes and regimes that a limit needs: the others would take minutes.
fn options(limits: &Limits, scenario: Scenario, runs: usize) -> Options {
    let source = scenario.to_string();
    let names: Vec<RatioName> = limits.of(&source).filter_map(|one| one.ratio()).collect();
    let mut options = Options {
        runs,
        quick: true,
        ..Options::default()
    };
    let (modes, regimes) = (&mut options.modes, &mut options.regimes);
    modes.retain(|mode| names.iter().any(|name| name.mode == *mode));
    regimes.retain(|regime| names.iter().any(|name| name.regime == *regime));
    options
}
