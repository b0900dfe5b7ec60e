//! Tries the limits on ratios: plants a slow-down just above each and sees whether the guard fails.
//!
//! How long a slow-down has to be is computed from what this machine shows without it, so the same
//! trial is fair to a fast and a slow one. The slow-downs stand in the benches beside the code that
//! is measured (`lager_benches::slow`). A trial runs the guard anew with several of them, in rows
//! that are not compared with each other.

use std::path::Path;
use std::process::Command;

use lager_benches::slow;
use serde::Serialize;
use serde_json::Value;

use crate::error::GuardError;
use crate::figures::{Figures, RatioName};
use crate::limits::{Limit, Limits};

/// How far above its limit a ratio is brought.
const ABOVE: f64 = 1.25;

/// A limit and the slow-down that should break it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Planted<'a> {
    #[serde(skip)]
    name: RatioName<'a>,
    pub(crate) figure: &'a str,
    pub(crate) limit: f64,
    /// The ratio without the slow-down.
    pub(crate) before: f64,
    /// The slow-down of each sample, in ns.
    pub(crate) spin_ns: u64,
    /// The ratio with it.
    pub(crate) with: Option<f64>,
    /// The guard has failed because of this figure.
    pub(crate) noticed: bool,
}

/// Slow-downs that are tried at once.
pub(crate) type Trial<'a> = Vec<Planted<'a>>;

/// The trials of a source, whose ratios without any slow-down are `figures`.
pub(crate) fn trials<'a>(limits: &'a Limits, figures: &Figures) -> Vec<Trial<'a>> {
    let mut trials: Vec<Trial> = Vec::new();
    for limit in limits.of(&figures.source) {
        let Some(planted) = planted(limit, figures) else {
            continue;
        };
        let fits = |trial: &Trial| trial.iter().all(|one| are_apart(&one.name, &planted.name));
        match trials.iter_mut().find(|trial| fits(trial)) {
            Some(trial) => trial.push(planted),
            None => trials.push(vec![planted]),
        }
    }
    trials
}

/// Whether one of the two rows can be slowed down without touching the other one's ratio.
fn are_apart(one: &RatioName, other: &RatioName) -> bool {
    (one.what, one.regime) != (other.what, other.regime)
        || (one.row != other.row && one.to != other.label && other.to != one.label)
}

/// The slow-down that brings a ratio above its limit; `None` without such a ratio.
fn planted<'a>(limit: &'a Limit, figures: &Figures) -> Option<Planted<'a>> {
    let at_most = limit.at_most?;
    let before = figures.get(&limit.figure)?;
    let own_ns = *figures.times_ns.get(&limit.figure)?;
    let baseline_ns = own_ns / before;
    let spin_ns = (ABOVE * at_most - before).max(0.0) * baseline_ns;
    Some(Planted {
        name: limit.ratio()?,
        figure: &limit.figure,
        limit: at_most,
        before,
        spin_ns: spin_ns.ceil() as u64,
        with: None,
        noticed: false,
    })
}

/// Runs this program again with the slow-downs of one trial, and notes what it says.
pub(crate) fn run(
    trial: &mut Trial,
    limits: &Path,
    source: &str,
    runs: usize,
) -> Result<(), GuardError> {
    let row = |planted: &Planted| format!("{}={}", planted.name.row, planted.spin_ns);
    let rows: Vec<String> = trial.iter().map(row).collect();
    let guard = std::env::current_exe().map_err(GuardError::Trial)?;
    let output = Command::new(guard)
        .env(slow::VARIABLE, format!("spin:{}", rows.join(";")))
        .arg("--limits")
        .arg(limits)
        .args(["--only", source, "--json", "--attempts", "1", "--runs"])
        .arg(runs.to_string())
        .output()
        .map_err(GuardError::Trial)?;
    let findings: Value = serde_json::from_slice(&output.stdout).map_err(|_| {
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        GuardError::Trial(std::io::Error::other(said))
    })?;
    for planted in trial {
        let found = findings["limits"]
            .as_array()
            .into_iter()
            .flatten()
            .find(|limit| limit["figure"] == planted.figure);
        if let Some(found) = found {
            planted.with = found["measured"].as_f64();
            planted.noticed = found["verdict"] == "broken" && output.status.code() == Some(1);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(figures: &[&str], at_most: f64) -> Limits {
        let limit = |figure: &&str| {
            format!(
                "[[limit]]\nsource = 'path'\nfigure = '{figure}'\nat_most = {at_most:?}\nreason = 'a test'\n"
            )
        };
        let text: String = figures.iter().map(limit).collect();
        Limits::parse(&text).unwrap()
    }

    fn figures(all: &[&str], ratio: f64, time_ns: f64) -> Figures {
        let names = || all.iter().map(|name| (*name).to_owned());
        Figures {
            source: "path".to_owned(),
            runs: names().map(|name| (name, vec![ratio])).collect(),
            times_ns: names().map(|name| (name, time_ns)).collect(),
            ..Figures::default()
        }
    }

    const BLOCK: &str = "path block plain: lager/block / floor p50";
    const BLOCK_P99: &str = "path block plain: lager/block / floor p99";
    const ADAPTIVE: &str = "path adaptive plain: lager/adaptive / lager/block p50";
    const OBSERVED: &str = "path@observed block plain: lager/64 observers / lager/alone p50";

    #[test]
    fn a_slow_down_is_as_long_as_its_limit_wants() {
        let figures = figures(&[BLOCK], 1.2, 60_000.0);
        let limits = limits(&[BLOCK], 1.6);
        let trials = trials(&limits, &figures);
        // From 60 us to 1.25 times 1.6 baselines of 50 us.
        assert_eq!(trials[0][0].spin_ns.abs_diff(40_000), 0, "{trials:?}");
    }

    #[test]
    fn rows_that_are_compared_with_each_other_are_slowed_down_one_after_the_other() {
        let all = [BLOCK, BLOCK_P99, ADAPTIVE, OBSERVED];
        let limits = limits(&all, 1.3);
        let trials = trials(&limits, &figures(&all, 1.0, 1_000.0));
        let names: Vec<Vec<&str>> = trials
            .iter()
            .map(|trial| trial.iter().map(|one| one.figure).collect())
            .collect();
        assert_eq!(
            names,
            [vec![BLOCK, OBSERVED], vec![BLOCK_P99], vec![ADAPTIVE]]
        );
    }
}
