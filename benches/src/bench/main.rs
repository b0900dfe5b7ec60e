//! `lager-bench`: the program that `lager bench` starts. It runs the scenarios of `benches/` and
//! prints a table or JSON.
//!
//! It is a program of its own so that `lager` links no code that only measures. The scenarios
//! `stop`, `command` and `link` start the `lager` beside this program.

mod command;
mod link;
mod robot;
mod stop;
mod topic;

use std::fmt;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::builder::PossibleValue;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueEnum};
use lager_benches::chip::{self, Programs};
use lager_benches::compare::Comparison;
use lager_benches::saved::Saved;
use lager_benches::{
    Explained, Load, Mode, Options, Pace, Regime, Report, SIZES, Scenario as Timed, Wanted,
    at_least_one, explain,
};
use serde::Serialize;

/// The command line.
#[derive(Debug, Parser)]
#[command(
    name = "lager bench",
    version,
    about = "Measure the bus on this machine, beside its baselines in the same run",
    after_help = "Examples:
  lager bench hop --quick                          a first look, in seconds
  lager bench hop --wait block --regime same-core  the software's share of a wake
  lager bench hop --size 65536 --rate 100 --wait block
                                                   your size, your rate
  lager bench path --runs 9 --json > path.json     for `benches/plot`
  lager bench path --explain 200us --trace late.json    why frames were late
  lager bench fanout                               the writer's time for observers
  lager bench chip                                 the boards' images, in exact cycles
  lager bench stop                                 200 stops at full speed; --runs N for N
  lager bench topic sensor/line                    a topic of the robot that is up
  lager bench hop --out before                     saved, to compare it later
  lager bench compare before.json after.json

A percentile is that of all runs together, and absent if fewer than ten samples lie
beyond it. Where samples are due at a rate, a time counts from when its sample was
due, so a stall hurts every sample that it delays. A ratio compares with a baseline
of the same run, and is the median over the runs; you can compare ratios of two
machines, but not times. Measure on an otherwise idle machine, with no robot up. The
hop through Zenoh, which needs many crates, is measured beside the others only by
`cargo run --release -p lager-benches --features zenoh --bin lager-bench -- hop`.",
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true
)]
struct BenchArgs {
    #[command(subcommand)]
    action: Option<Action>,
    /// What to measure
    #[arg(required = true)]
    scenario: Option<Scenario>,
    /// Print one line of JSON instead of a table
    #[arg(long)]
    json: bool,
    /// How often to measure everything (not `chip`)
    /// [default: 5]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = at_least_one)]
    runs: Option<usize>,
    /// Take few samples, for a first look (not `chip`)
    #[arg(long)]
    quick: bool,
    /// Samples of each round, of which a run has several (`hop`, `path`, `fanout`)
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = at_least_one)]
    samples: Option<usize>,
    /// The cores of the two processes [default: the first two]
    #[arg(long, value_name = "A,B", value_parser = two_cores)]
    cores: Option<(usize, usize)>,
    /// How often a sample is due: so many times a second, or `full`, as fast as they come back
    /// (`hop`) [default: `full`, and 10000 with an adaptive receiver, too]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate: Option<Pace>,
    /// The size of a sample in bytes: 8, 16, 64, 256, 1024, … or 1048576 (`hop`)
    #[arg(long, value_name = "BYTES", allow_negative_numbers = true, value_parser = size)]
    size: Option<usize>,
    /// Add a row beside so many processes that only watch, 1 to 64 (`hop`, `path`)
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = observers)]
    observers: Option<usize>,
    /// Load the machine meanwhile, with `stress-ng`; `cyclictest` measures its floor beside it (`hop`,
    /// `path`)
    #[arg(long, value_name = "LOAD")]
    load: Option<Load>,
    /// Save everything in NAME.json, for `lager bench compare`, and the histograms also in
    /// NAME.hlog, HdrHistogram's log format (`hop`, `path`, `fanout`)
    #[arg(long, value_name = "NAME")]
    out: Option<PathBuf>,
    /// Say why frames took longer than this, by the kernel's events around each: an interrupt,
    /// another thread, a sleeping core, a hypervisor, a page fault, our own code (`path`); needs
    /// root, and says less without
    #[arg(long, value_name = "TIME", value_parser = lager_tracer::limit)]
    explain: Option<u64>,
    /// With --explain, bridge, logic and boards run in real time
    #[arg(long, requires = "explain")]
    realtime: bool,
    /// With --explain, draw the latest frames into a file that ui.perfetto.dev opens
    #[arg(long, value_name = "FILE", requires = "explain")]
    trace: Option<PathBuf>,
    /// How the receiver waits [default: all]
    #[arg(long, value_name = "MODE", value_delimiter = ',')]
    wait: Vec<Mode>,
    /// Where the processes run [default: all]
    #[arg(long, value_name = "REGIME", value_delimiter = ',')]
    regime: Vec<Regime>,
}

/// What `lager bench` does beside its scenarios.
#[derive(Clone, Debug, clap::Subcommand)]
enum Action {
    Topic(topic::Args),
    /// Compare two saved measurements. Exit codes: 0 nothing is slower, 1 something is slower or
    /// missing, 2 they cannot be compared
    Compare {
        /// The accepted measurement, which `--out` wrote
        a: PathBuf,
        /// The measurement to judge
        b: PathBuf,
        /// Slower is what takes longer by more than this, in percent
        #[arg(long, value_name = "PERCENT", default_value_t = 3.0, value_parser = percent)]
        limit: f64,
        /// Compare them even if they come from machines that differ
        #[arg(long)]
        across_machines: bool,
        /// Print one line of JSON instead of a table
        #[arg(long)]
        json: bool,
    },
}

/// Two cores, with a comma between them.
fn two_cores(text: &str) -> Result<(usize, usize), String> {
    let two = text.split_once(',');
    let two = two.and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    two.ok_or_else(|| "give two cores, such as 0,1".to_owned())
}

/// The size of a hop's sample.
fn size(text: &str) -> Result<usize, String> {
    let bytes = text.parse().ok().filter(|bytes| SIZES.contains(bytes));
    bytes.ok_or_else(|| {
        let all: Vec<String> = SIZES.iter().map(usize::to_string).collect();
        format!("give one of {}: each is a type of its own", all.join(", "))
    })
}

/// How many observers may watch.
fn observers(text: &str) -> Result<usize, String> {
    let most = Options::OBSERVERS;
    let number = text.parse().ok().filter(|many| (1..=most).contains(many));
    number.ok_or_else(|| format!("give a number from 1 to {most}: a topic has so many places"))
}

/// How much slower still counts as the same.
fn percent(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    let number = number.filter(|percent| (0.0..=1_000.0).contains(percent));
    number.ok_or_else(|| "give a number from 0 to 1000".to_owned())
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

/// Two measurements cannot be compared; 1 says that something is slower.
const INCOMPARABLE: u8 = 2;

fn main() -> ExitCode {
    lager_benches::run_if_asked();
    let args = BenchArgs::parse();
    match &args.action {
        Some(Action::Compare {
            a,
            b,
            limit,
            across_machines,
            json,
        }) => {
            let limit = 1.0 + limit / 100.0;
            let compared = compare([a, b], limit, *across_machines, *json);
            return ended("compare", compared, ExitCode::from(INCOMPARABLE));
        }
        Some(Action::Topic(args)) => {
            let measured = topic::measure(args).map(|report| (report, ExitCode::SUCCESS));
            return ended("topic", measured, ExitCode::FAILURE);
        }
        None => {}
    }
    if let Err(refused) = args.refuse_what_does_not_vary() {
        refused.exit();
    }
    let scenario = args.scenario().to_possible_value();
    let name = scenario.as_ref().map_or("", PossibleValue::get_name);
    let measured = run(&args).map(|report| (report, ExitCode::SUCCESS));
    ended(name, measured, ExitCode::FAILURE)
}

/// Prints what was found, or why there is nothing.
fn ended(name: &str, result: Result<(String, ExitCode)>, failure: ExitCode) -> ExitCode {
    match result {
        Ok((report, code)) => {
            // It is no error that the reader has gone, as after `| head`.
            let _ = writeln!(std::io::stdout(), "{report}");
            code
        }
        Err(error) => {
            eprintln!("lager: `lager bench {name}` has no result: {error:#}");
            failure
        }
    }
}

/// Compares the second measurement with the first.
fn compare(
    [a, b]: [&PathBuf; 2],
    limit: f64,
    across: bool,
    json: bool,
) -> Result<(String, ExitCode)> {
    let comparison = Comparison::of(&Saved::read(a)?, &Saved::read(b)?, limit, across)?;
    let code = ExitCode::from(u8::from(comparison.fails()));
    Ok((printed(json, &comparison)?, code))
}

/// A report as a line of JSON or as a table.
fn printed<R: Serialize + fmt::Display>(json: bool, report: &R) -> Result<String> {
    Ok(match json {
        true => serde_json::to_string(report)?,
        false => report.to_string().trim_end().to_owned(),
    })
}

impl BenchArgs {
    const fn scenario(&self) -> Scenario {
        self.scenario.expect("clap demands it")
    }

    fn refuse_what_does_not_vary(&self) -> Result<(), clap::Error> {
        let varies = !self.wait.is_empty() || !self.regime.is_empty();
        let varies = varies || self.samples.is_some() || self.out.is_some();
        let varies = varies || self.cores.is_some() || self.rate.is_some();
        let varies = varies || self.size.is_some() || self.observers.is_some();
        let varies = varies || self.load.is_some();
        let sentence = match self.scenario() {
            scenario if self.explain.is_some() && scenario != Scenario::Path => {
                "only the late frames of `path` are explained"
            }
            _ if self.explain.is_some() && self.out.is_some() => {
                "--out saves a measurement, and --explain is none: --json prints its verdicts"
            }
            Scenario::Path if self.rate.is_some() => {
                "the path's frames come at 1 kHz, as its robot needs them; only `hop` takes --rate"
            }
            Scenario::Path if self.size.is_some() => {
                "the path's frames are the boards' packets; only `hop` takes --size"
            }
            Scenario::Fanout if self.load.is_some() => {
                "a fan-out's readers look without pause, which is load enough; only `hop` and `path` \
                 take --load"
            }
            Scenario::Fanout if self.size.is_some() || self.observers.is_some() => {
                "it publishes 64 bytes, 64 KiB and 1 MiB to 1, 8 and 64 readers; only `hop` takes \
                 --size, and only `hop` and `path` take --observers"
            }
            Scenario::Fanout if self.rate.is_some() => {
                "a writer publishes when all readers are ready; only `hop` takes --rate"
            }
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

    fn printed<R: Serialize + fmt::Display>(&self, report: &R) -> Result<String> {
        printed(self.json, report)
    }

    /// Explains late frames, and draws them if that is asked for.
    fn explained(&self, limit_ns: u64) -> Result<String> {
        let realtime = self.realtime;
        let wanted = Wanted { limit_ns, realtime };
        let explained: Explained = explain(&options(self), wanted)?;
        if let Some(file) = &self.trace {
            let drawn = explained.draw(file);
            let drawn = drawn.with_context(|| format!("cannot write {}", file.display()))?;
            match drawn {
                true => eprintln!("drawn in {}; ui.perfetto.dev opens it", file.display()),
                false => eprintln!("nothing to draw without the kernel's events"),
            }
        }
        self.printed(&explained)
    }

    /// Measures, and saves the result if that is asked for.
    fn timed(&self, scenario: Timed) -> Result<String> {
        let report = scenario.measure(&options(self))?;
        saved(&report, self.out.as_deref())?;
        self.printed(&report)
    }
}

/// Saves the result, if that is asked for.
fn saved(report: &Report, name: Option<&Path>) -> Result<()> {
    if let Some(name) = name {
        let [json, hlog] = Saved::of(report).write(name)?;
        eprintln!("saved in {} and {}", json.display(), hlog.display());
    }
    Ok(())
}

/// How often a robot is stopped or gets a command: with `--quick`, and without.
const TIMES: [usize; 2] = [20, 200];
/// How often its link is cut in each of three ways: with `--quick`, and without.
const CUTS: [usize; 2] = [10, 60];

/// Measures, and returns the text to print.
fn run(args: &BenchArgs) -> Result<String> {
    let usual = match args.scenario() {
        Scenario::Link => CUTS,
        _ => TIMES,
    };
    let times = args.runs.unwrap_or(usual[usize::from(!args.quick)]);
    match args.scenario() {
        Scenario::Hop => args.timed(Timed::Hop),
        Scenario::Path => match args.explain {
            Some(limit_ns) => args.explained(limit_ns),
            None => args.timed(Timed::Path),
        },
        Scenario::Fanout => args.timed(Timed::Fanout),
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
        samples: args.samples,
        cores: args.cores,
        pace: args.rate,
        size: args.size,
        load: args.load,
        observers: args.observers,
        modes: or_all(&args.wait),
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
            "--wait",
            "block,spin",
            "--wait",
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
            &["--wait", "spin"],
            &["--size", "64"],
            &["--observers", "8"],
            &["--load", "cpu"],
            &["--regime", "plain"],
            &["--samples", "9"],
            &["--out", "x"],
            &["--cores", "0,1"],
            &["--rate", "100"],
        ] {
            let args = parsed(&[&["chip"], choice].concat()).expect("valid");
            let refused = args
                .refuse_what_does_not_vary()
                .expect_err("nothing to choose");
            assert!(refused.to_string().contains("--json"), "{refused}");
        }
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_its_reason() {
        for (flags, words) in [
            (&["path", "--size", "64"][..], "boards' packets"),
            (&["path", "--rate", "100"], "1 kHz"),
            (&["fanout", "--size", "64"], "64 readers"),
            (&["fanout", "--observers", "8"], "64 readers"),
            (&["fanout", "--load", "cpu"], "without pause"),
        ] {
            let args = parsed(flags).expect("valid");
            let refused = args.refuse_what_does_not_vary().expect_err("no sense");
            assert!(refused.to_string().contains(words), "{refused}");
        }
        for fits in [
            &["path", "--observers", "8", "--load", "irq"][..],
            &["hop", "--size", "64", "--observers", "8", "--load", "io"],
        ] {
            let args = parsed(fits).expect("valid");
            assert!(args.refuse_what_does_not_vary().is_ok(), "{fits:?}");
        }
    }

    #[test]
    fn two_files_are_compared_and_nothing_is_measured_with_them() {
        let two = parsed(&["compare", "a.json", "b.json", "--limit", "5"]).expect("valid");
        assert!(
            matches!(two.action, Some(Action::Compare { limit: 5.0, .. })),
            "{two:?}"
        );
        for wrong in [
            &["compare", "a.json"][..],
            &["compare", "a", "b", "--limit", "-1"],
            &["hop", "compare", "a", "b"],
            &[],
        ] {
            assert!(parsed(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn slower_and_broken_have_exit_codes_of_their_own() {
        let incomparable = ExitCode::from(INCOMPARABLE);
        let ended = |result| format!("{:?}", super::ended("compare", result, incomparable));
        let judged = |fails: bool| {
            let code = ExitCode::from(u8::from(fails));
            ended(Ok((String::new(), code)))
        };
        let unreadable = compare(
            [&"none.json".into(), &"none.json".into()],
            1.03,
            false,
            true,
        );
        let codes = [judged(false), judged(true), ended(unreadable)];
        let expected = [0, 1, INCOMPARABLE].map(|code| format!("{:?}", ExitCode::from(code)));
        assert_eq!(codes, expected);
    }

    #[test]
    fn wrong_choices_say_what_there_is() {
        for (flags, words) in [
            (
                &["leap"][..],
                "hop, path, fanout, chip, stop, command, link",
            ),
            (&["hop", "--wait", "busy"], "spin, adaptive, block"),
            (&["hop", "--load", "fan"], "cpu, memory, io, irq"),
            (&["hop", "--size", "7"], "64, 256, 1024"),
            (&["hop", "--observers", "65"], "from 1 to 64"),
            (&["hop", "--regime", "calm"], "plain, same-core, no-halt"),
            (&["hop", "--runs", "0"], "1 or more"),
            (&["hop", "--cores", "0"], "such as 0,1"),
            (&["hop", "--rate", "0"], "samples a second"),
        ] {
            let said = parsed(flags).expect_err("wrong").to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}
