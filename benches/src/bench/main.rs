//! `lager-bench`: the program that `lager bench` starts. It runs the scenarios of `benches/` and
//! prints a table or JSON.
//!
//! It is a program of its own so that `lager` links no code that only measures. The scenarios
//! `stop`, `command` and `link` start the `lager` beside this program.

mod command;
mod link;
mod robot;
mod stop;

use std::fmt;
use std::io::Write as _;
use std::process::ExitCode;

use anyhow::Result;
use clap::builder::PossibleValue;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueEnum};
use lager_benches::chip::{self, Programs};
use lager_benches::{Mode, Options, Regime, Scenario as Timed, at_least_one};
use serde::Serialize;

/// The command line.
#[derive(Debug, Parser)]
#[command(
    name = "lager bench",
    version,
    about = "Measure the bus on this machine, beside its baselines in the same run",
    after_help = "Examples:
  lager bench hop --quick                          a first look, in seconds
  lager bench hop --mode block --regime same-core  the software's share of a wake
  lager bench path --runs 9 --json > path.json     for `benches/plot`
  lager bench fanout                               the writer's time for observers
  lager bench chip                                 the boards' images, in exact cycles
  lager bench stop                                 200 stops at full speed; --runs N for N

Times are medians over the runs: of each run's median (p50), and of the times that
99 % and 99.9 % of its samples kept. A ratio compares with a baseline of the same
run; you can compare ratios of two machines, but not times. Measure on an otherwise
idle machine, with no robot up. The hop through Zenoh, which needs many crates, is
measured beside the others only by
`cargo run --release -p lager-benches --features zenoh --bin lager-bench -- hop`."
)]
struct BenchArgs {
    /// What to measure
    scenario: Scenario,
    /// Print one line of JSON instead of a table
    #[arg(long)]
    json: bool,
    /// How often to measure everything; every figure is the median over the runs (not `chip`)
    /// [default: 5]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = at_least_one)]
    runs: Option<usize>,
    /// Take few samples, for a first look (not `chip`)
    #[arg(long)]
    quick: bool,
    /// How the receiver waits [default: all]
    #[arg(long, value_name = "MODE", value_delimiter = ',')]
    mode: Vec<Mode>,
    /// Where the processes run [default: all]
    #[arg(long, value_name = "REGIME", value_delimiter = ',')]
    regime: Vec<Regime>,
}

/// What `lager bench` can measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Scenario {
    /// Time of one sample from a writer to a waiting reader in another process
    Hop,
    /// Time from a sensor packet on one port to its steering command on the other, through bridge
    /// and logic
    Path,
    /// Time that a writer needs to publish to 1 to 64 subscribers and observers
    Fanout,
    /// Cycles that the boards' real images take, from tape to duty and to UART; needs what
    /// `.ci/firmware` builds
    Chip,
    /// Time from the start of `lager stop` until a robot at full speed reports wheels at rest
    Stop,
    /// Time from a GaG's command to the station until the motors of its robot obey
    Command,
    /// Time from a cut of the link to the station until a robot that is driven by hand stands
    Link,
}

fn main() -> ExitCode {
    lager_benches::run_if_asked();
    let args = BenchArgs::parse();
    if let Err(refused) = args.refuse_what_does_not_vary() {
        refused.exit();
    }
    match run(&args) {
        Ok(report) => {
            // It is no error that the reader has gone, as after `| head`.
            let _ = writeln!(std::io::stdout(), "{report}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            let scenario = args.scenario.to_possible_value();
            let scenario = scenario.as_ref().map_or("", PossibleValue::get_name);
            eprintln!("lager: `lager bench {scenario}` has no result: {error:#}");
            ExitCode::FAILURE
        }
    }
}

impl BenchArgs {
    fn refuse_what_does_not_vary(&self) -> Result<(), clap::Error> {
        let varies = !self.mode.is_empty() || !self.regime.is_empty();
        let sentence = match self.scenario {
            Scenario::Hop | Scenario::Path | Scenario::Fanout => return Ok(()),
            Scenario::Chip if varies || self.quick || self.runs.is_some() => {
                "`lager bench chip` counts cycles, and every run counts the same: it takes --json \
                 and nothing else"
            }
            Scenario::Stop | Scenario::Command | Scenario::Link if varies => {
                "this scenario runs the robot as `lager up` does: it takes --runs, --quick and --json"
            }
            _ => return Ok(()),
        };
        Err(Self::command().error(ErrorKind::ArgumentConflict, sentence))
    }

    /// A report as a line of JSON or as a table.
    fn printed<R: Serialize + fmt::Display>(&self, report: &R) -> Result<String> {
        Ok(match self.json {
            true => serde_json::to_string(report)?,
            false => report.to_string().trim_end().to_owned(),
        })
    }
}

/// How often a robot is stopped or gets a command: with `--quick`, and without.
const TIMES: [usize; 2] = [20, 200];
/// How often its link is cut in each of three ways: with `--quick`, and without.
const CUTS: [usize; 2] = [10, 60];

/// Measures, and returns the text to print.
fn run(args: &BenchArgs) -> Result<String> {
    let usual = match args.scenario {
        Scenario::Link => CUTS,
        _ => TIMES,
    };
    let times = args.runs.unwrap_or(usual[usize::from(!args.quick)]);
    match args.scenario {
        Scenario::Hop => args.printed(&Timed::Hop.measure(&options(args))?),
        Scenario::Path => args.printed(&Timed::Path.measure(&options(args))?),
        Scenario::Fanout => args.printed(&Timed::Fanout.measure(&options(args))?),
        Scenario::Chip => args.printed(&chip::measure(programs()?)?),
        Scenario::Stop => args.printed(&stop::measure(times)?),
        Scenario::Command => args.printed(&command::measure(times)?),
        Scenario::Link => args.printed(&link::measure(times)?),
    }
}

/// The emulator and the boards' images for each baud rate. `.ci/firmware` leaves them in the source
/// tree; this searches the tree with this program and the one with the current folder.
fn programs() -> Result<[(u32, Programs); chip::BAUDS.len()]> {
    let program = std::env::current_exe()?;
    let current = std::env::current_dir()?;
    Ok(chip::BAUDS.map(|baud| {
        let trees = program.ancestors().chain(current.ancestors());
        let found = trees.map(|tree| Programs::in_tree(tree, baud));
        let mut found = found.filter(|programs| programs.emulator.is_file());
        // If neither tree has them, the error names the paths in the current folder.
        let programs = found.next();
        (
            baud,
            programs.unwrap_or_else(|| Programs::in_tree(&current, baud)),
        )
    }))
}

/// The options; if a flag is absent, everything is measured.
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
    use super::*;

    fn parsed(flags: &[&str]) -> Result<BenchArgs, clap::Error> {
        BenchArgs::try_parse_from(["lager bench"].iter().chain(flags))
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
            let refused = args
                .refuse_what_does_not_vary()
                .expect_err("nothing to choose");
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
            (&["hop", "--runs", "0"], "1 or more"),
        ] {
            let said = parsed(flags).expect_err("wrong").to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}
