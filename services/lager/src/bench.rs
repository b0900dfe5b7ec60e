//! `lager bench`: the scenarios of `benches/` for anybody, as a table or as JSON.
//!
//! Nothing is measured here; the same code runs under criterion and in the guard.

mod command;
mod link;
mod robot;
mod stop;

use std::fmt;

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use lager_benches::chip::{self, Programs};
use lager_benches::{Options, Scenario as Timed};
use serde::Serialize;

use crate::cli::{BenchArgs, Scenario};
use crate::config::ChipSection;
use crate::exit::Usage;

/// Measures and returns what is to be printed.
pub fn run(args: &BenchArgs) -> Result<String> {
    let options = options(args);
    let scenario = match args.scenario {
        Scenario::Hop => Timed::Hop,
        Scenario::Path => Timed::Path,
        Scenario::Fanout => Timed::Fanout,
        Scenario::Chip => return run_chip(args),
        Scenario::Stop | Scenario::Command | Scenario::Link => return run_robot(args),
    };
    let measured = scenario.measure(&options);
    let report = measured.with_context(|| format!("`lager bench {scenario}` has no result"))?;
    told(args, &report)
}

/// The boards' images in the emulator, where they are built or installed: images that the
/// configuration names are for one baud rate.
fn run_chip(args: &BenchArgs) -> Result<String> {
    let chosen = args.quick || args.runs.is_some();
    ensure!(
        !chosen && args.mode.is_empty() && args.regime.is_empty(),
        Usage(
            "`lager bench chip` counts cycles, and every run counts the same: it takes --json and nothing else"
                .into()
        )
    );
    let [fast, slow] = chip::BAUDS.map(|baud| {
        ChipSection::default().parts(baud).map(|parts| {
            let programs = Programs {
                emulator: parts.emulator,
                sensor_elf: parts.sensor_elf,
                steering_elf: parts.steering_elf,
            };
            (baud, programs)
        })
    });
    let failed = "`lager bench chip` has no result";
    let report = chip::measure([fast.context(failed)?, slow.context(failed)?]).context(failed)?;
    told(args, &report)
}

/// How often a robot is stopped or given a command: for a first look, and in full.
const TIMES: [usize; 2] = [20, 200];
/// How often its link is cut in each of three ways, and made anew.
const CUTS: [usize; 2] = [10, 60];

/// The processes that people run, on a robot of the measurement's own.
fn run_robot(args: &BenchArgs) -> Result<String> {
    let usual = match args.scenario {
        Scenario::Link => CUTS,
        _ => TIMES,
    };
    let times = args.runs.unwrap_or(usual[usize::from(!args.quick)]);
    let name = match args.scenario {
        Scenario::Stop => "stop",
        Scenario::Command => "command",
        _ => "link",
    };
    ensure!(
        args.mode.is_empty() && args.regime.is_empty(),
        Usage(format!(
            "`lager bench {name}` runs the robot as `lager up` does: it takes --runs, --quick and --json"
        ))
    );
    let failed = || format!("`lager bench {name}` has no result");
    match args.scenario {
        Scenario::Stop => told(args, &stop::measure(times).with_context(failed)?),
        Scenario::Command => told(args, &command::measure(times).with_context(failed)?),
        _ => told(args, &link::measure(times).with_context(failed)?),
    }
}

/// As a line of JSON or as a table.
fn told<R: Serialize + fmt::Display>(args: &BenchArgs, report: &R) -> Result<String> {
    Ok(match args.json {
        true => serde_json::to_string(report)?,
        false => report.to_string().trim_end().to_owned(),
    })
}

/// Everything that the flags leave open is measured in full.
fn options(args: &BenchArgs) -> Options {
    fn or_all<T: ValueEnum + PartialEq>(chosen: &[T]) -> Vec<T> {
        let all = T::value_variants().iter().cloned();
        all.filter(|one| chosen.is_empty() || chosen.contains(one))
            .collect()
    }
    Options {
        runs: args.runs.unwrap_or(Options::default().runs),
        quick: args.quick,
        modes: or_all(&args.mode),
        regimes: or_all(&args.regime),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use lager_benches::{Mode, Regime};

    use super::*;
    use crate::cli::{Cli, Command};

    fn parsed(flags: &[&str]) -> Result<BenchArgs, clap::Error> {
        let words = ["lager", "bench"].iter().chain(flags);
        Cli::try_parse_from(words).map(|cli| match cli.command {
            Command::Bench(args) => args,
            other => unreachable!("{other:?}"),
        })
    }

    #[test]
    fn what_is_not_chosen_is_measured_in_full_and_a_choice_once() {
        let all = options(&parsed(&["hop"]).expect("valid"));
        assert_eq!(all, Options::default());
        let args = parsed(&[
            "hop",
            "--runs",
            "9",
            "--mode",
            "block,spin",
            "--mode",
            "block",
            "--regime",
            "no-halt",
        ]);
        let some = options(&args.expect("valid"));
        assert_eq!(some.runs, 9);
        assert_eq!(some.modes, [Mode::Spin, Mode::Block]);
        assert_eq!(some.regimes, [Regime::NoHalt]);
    }

    #[test]
    fn what_does_not_vary_is_not_chosen() {
        for choice in [
            &["--quick"][..],
            &["--runs", "5"],
            &["--mode", "spin"],
            &["--regime", "plain"],
        ] {
            let args = parsed(&[&["chip"], choice].concat()).expect("valid");
            let refused = run(&args).expect_err("nothing to choose");
            assert!(refused.to_string().contains("--json"), "{refused}");
        }
    }

    #[test]
    fn wrong_choices_say_what_there_is() {
        for (flags, words) in [
            (
                &["leap"][..],
                "hop, path, fanout, chip, stop, command, link",
            ),
            (&["hop", "--mode", "busy"], "spin, adaptive, block"),
            (&["hop", "--regime", "calm"], "plain, same-core, no-halt"),
            (&["hop", "--runs", "0"], "the least"),
        ] {
            let said = parsed(flags).expect_err("wrong").to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}
