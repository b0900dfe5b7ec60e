//! The guard: measures, and fails when a limit of `benches/limits.toml` is broken.
//!
//! `benches/guard` is the way to run it: the script builds this, has callgrind count instructions,
//! and hands the counts over. Apart from the library, because a scenario measures and asserts
//! nothing, while this decides and measures nothing itself.
//!
//! Exit codes: 0 all limits are kept, 1 a limit is broken or its figure is missing, 2 the guard
//! could not do its work.

mod figures;
mod judge;
mod limits;
mod measure;
mod trial;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use lager_benches::chip::{self, Programs};
use lager_benches::{BenchError, Scenario, machine, median};
use serde::Serialize;

use crate::figures::{Built, Figures, FiguresError};
use crate::judge::{Judgement, Verdict, judge};
use crate::limits::{Limits, LimitsError};
use crate::measure::{MeasureError, Thoroughness, measure};

/// Holds the bus, the path and the boards' images to their limits: ratios measured in one run, and
/// counts of instructions and cycles.
///
/// Exit codes: 0 all limits are kept; 1 a limit is broken or its figure is missing; 2 the guard
/// could not do its work.
#[derive(Debug, Parser)]
#[command(
    name = "benches/guard",
    bin_name = "benches/guard",
    after_help = "Examples:\n  benches/guard                        everything, about four minutes\n  benches/guard --only instructions    the counts alone, which no load disturbs\n  benches/guard --only hop --json\n  benches/guard --only hop,path,fanout --spread 10    before a limit is changed\n  benches/guard --only hop,path,fanout --try          after that: does each limit hold?"
)]
struct Arguments {
    /// The limits
    #[arg(long, value_name = "FILE", default_value = "benches/limits.toml")]
    limits: PathBuf,
    /// Judge these sources only: hop, path, fanout, instructions, cycles
    #[arg(long, value_name = "SOURCE", value_delimiter = ',')]
    only: Vec<String>,
    /// Runs of each measurement; a ratio is the median over them
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    runs: usize,
    /// How often to measure a scenario while one of its limits is broken; all runs count together
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    attempts: usize,
    /// Judge nothing: measure each scenario so many times, and show how far its figures spread
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    spread: Option<usize>,
    /// Try the limits on ratios: plant a slow-down just above each, and fail if one goes unnoticed
    #[arg(long = "try", conflicts_with = "spread")]
    trial: bool,
    /// One line of JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Instruction counts as gungraun writes them (the script gives this)
    #[arg(long, value_name = "FILE", hide = true)]
    callgrind: Option<PathBuf>,
    /// Counts of another program: {"source":…,"built":{"rustc":…,"target":…},"figures":{NAME:N,…}}
    #[arg(long, value_name = "FILE")]
    counts: Vec<PathBuf>,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err("give a whole number, 1 or more".to_owned()),
        Ok(number) => Ok(number),
    }
}

/// Why the guard could not do its work.
#[derive(Debug, thiserror::Error)]
enum GuardError {
    #[error(transparent)]
    Limits(#[from] LimitsError),
    #[error(transparent)]
    Figures(#[from] FiguresError),
    #[error(transparent)]
    Measure(#[from] MeasureError),
    #[error("cycles: {0}")]
    Chip(#[from] BenchError),
    #[error("the guard could not be started again with a slow-down: {0}")]
    Trial(std::io::Error),
    #[error("`--only {0}` selects nothing; the sources that have limits are: {1}")]
    NoSuchSource(String, String),
    #[error(
        "there are no counts of `{0}`; run `benches/guard`, which makes them, or leave them out with --only"
    )]
    NoCounts(String),
}

/// The source that is counted by the emulator, in chips.
const CYCLES: &str = "cycles";

/// What the guard has found.
#[derive(Debug, Serialize)]
struct Findings {
    machine: String,
    kept: bool,
    limits: Vec<Judgement>,
    notes: Vec<String>,
}

fn main() -> ExitCode {
    lager_benches::run_if_asked();
    lager_benches::slow::refuse_in_vain();
    let arguments = Arguments::parse();
    let kept = if let Some(times) = arguments.spread {
        spread(&arguments, times).map(|()| true)
    } else if arguments.trial {
        try_limits(&arguments)
    } else {
        guard(&arguments).map(|findings| {
            if arguments.json {
                let json = serde_json::to_string(&findings).expect("names and numbers are JSON");
                println!("{json}");
            } else {
                print(&findings);
            }
            findings.kept
        })
    };
    match kept {
        Ok(kept) => ExitCode::from(u8::from(!kept)),
        Err(error) => {
            eprintln!("benches/guard: {error}");
            ExitCode::from(2)
        }
    }
}

fn guard(arguments: &Arguments) -> Result<Findings, GuardError> {
    let limits = Limits::load(&arguments.limits)?;
    let sources = sources(&limits, &arguments.only)?;
    let counts = counts(arguments)?;
    let how = Thoroughness {
        runs: arguments.runs,
        attempts: arguments.attempts,
    };
    let mut findings = Findings {
        machine: machine::describe(),
        kept: true,
        limits: Vec::new(),
        notes: Vec::new(),
    };
    for source in sources {
        let counted = counts.iter().find(|figures| figures.source == source);
        let figures = match (counted, source.parse::<Scenario>()) {
            (Some(figures), _) => figures.clone(),
            (None, Ok(scenario)) => {
                let measured = measure(&limits, scenario, how)?;
                if measured.attempts > 1 {
                    let times = measured.attempts;
                    findings.notes.push(format!(
                        "{source}: measured {times} times because a limit was broken; the medians of all runs count"
                    ));
                }
                measured.figures
            }
            (None, Err(_)) if source == CYCLES => {
                // `benches/guard` runs this in the source tree.
                let here = Path::new("");
                let traces =
                    chip::measure(chip::BAUDS.map(|baud| (baud, Programs::in_tree(here, baud))))?;
                let limited = |name: &str| limits.of(CYCLES).any(|limit| limit.figure == name);
                Figures::of_traces(CYCLES, &traces, limited)?
            }
            (None, Err(_)) => return Err(GuardError::NoCounts(source)),
        };
        let (judgements, notes) = judge(&limits, &figures);
        findings.kept &= !judgements.iter().any(|one| one.verdict.fails());
        findings.limits.extend(judgements);
        findings.notes.extend(notes);
    }
    Ok(findings)
}

/// Shows how far the ratios that have limits spread from one measurement to the next.
fn spread(arguments: &Arguments, times: usize) -> Result<(), GuardError> {
    let limits = Limits::load(&arguments.limits)?;
    let scenarios = scenarios(&limits, arguments)?;
    println!("{}\n", machine::describe());
    println!(
        "{:<70} {:>7} {:>7} {:>7} {:>7} {:>7}",
        "figure", "lowest", "median", "highest", "limit", "goal"
    );
    for scenario in scenarios {
        let measured = measure::spread(&limits, scenario, arguments.runs, times)?;
        for limit in limits.of(scenario.as_str()) {
            let mut values: Vec<f64> = measured
                .iter()
                .filter_map(|figures| figures.figures.get(&limit.figure).copied())
                .collect();
            values.sort_unstable_by(f64::total_cmp);
            let show = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
            println!(
                "{:<70} {:>7} {:>7} {:>7} {:>7} {:>7}",
                limit.figure,
                show(values.first().copied()),
                show(median(values.clone())),
                show(values.last().copied()),
                show(limit.at_most),
                show(limit.goal),
            );
        }
    }
    Ok(())
}

/// Plants a slow-down just above each limit on a ratio; whether the guard has noticed each.
fn try_limits(arguments: &Arguments) -> Result<bool, GuardError> {
    let limits = Limits::load(&arguments.limits)?;
    let scenarios = scenarios(&limits, arguments)?;
    let how = Thoroughness {
        runs: arguments.runs,
        attempts: 1,
    };
    let mut all_noticed = true;
    if !arguments.json {
        println!("{}\n", machine::describe());
        println!(
            "{:<70} {:>7} {:>7} {:>12} {:>7}  noticed",
            "figure", "limit", "before", "slower by ns", "with it"
        );
    }
    for scenario in scenarios {
        let measured = measure(&limits, scenario, how)?;
        for mut trial in trial::trials(&limits, &measured.figures) {
            let source = scenario.as_str();
            trial::run(&mut trial, &arguments.limits, source, arguments.runs)
                .map_err(GuardError::Trial)?;
            for planted in trial {
                all_noticed &= planted.noticed;
                if arguments.json {
                    let json = serde_json::to_string(&planted).expect("names and numbers are JSON");
                    println!("{json}");
                    continue;
                }
                println!(
                    "{:<70} {:>7} {:>7} {:>12} {:>7}  {}",
                    planted.figure,
                    number(planted.limit),
                    number(planted.before),
                    planted.spin_ns,
                    planted.with.map_or_else(|| "-".to_owned(), number),
                    if planted.noticed { "yes" } else { "NO" },
                );
            }
        }
    }
    Ok(all_noticed)
}

/// The sources that have limits, in the file's order, or those of them that were asked for.
fn sources(limits: &Limits, only: &[String]) -> Result<Vec<String>, GuardError> {
    let mut all: Vec<String> = Vec::new();
    for limit in &limits.limits {
        if !all.contains(&limit.source) {
            all.push(limit.source.clone());
        }
    }
    if let Some(unknown) = only.iter().find(|name| !all.contains(name)) {
        return Err(GuardError::NoSuchSource(unknown.clone(), all.join(", ")));
    }
    all.retain(|source| only.is_empty() || only.contains(source));
    Ok(all)
}

/// Those of the sources that are timed.
fn scenarios(limits: &Limits, arguments: &Arguments) -> Result<Vec<Scenario>, GuardError> {
    let sources = sources(limits, &arguments.only)?;
    let scenario = |source: &String| source.parse().ok();
    Ok(sources.iter().filter_map(scenario).collect())
}

fn counts(arguments: &Arguments) -> Result<Vec<Figures>, GuardError> {
    let read = |file: &Path| {
        std::fs::read_to_string(file).map_err(|error| FiguresError::Unreadable {
            file: file.display().to_string(),
            detail: error.to_string(),
        })
    };
    let mut counts = Vec::new();
    if let Some(file) = &arguments.callgrind {
        let name = file.display().to_string();
        counts.push(Figures::of_callgrind(
            &name,
            &read(file)?,
            Built::by_rustc()?,
        )?);
    }
    for file in &arguments.counts {
        counts.push(Figures::of_counts(
            &file.display().to_string(),
            &read(file)?,
        )?);
    }
    Ok(counts)
}

fn print(findings: &Findings) {
    println!("{}\n", findings.machine);
    println!(
        "{:<70} {:>9} {:>9} {:>7}  verdict",
        "figure", "measured", "limit", "goal"
    );
    let mut source = "";
    for one in &findings.limits {
        if one.source != source {
            source = &one.source;
            println!("{source}");
        }
        println!(
            "  {:<68} {:>9} {:>9} {:>7}  {}",
            one.figure,
            one.measured.map_or_else(|| "-".to_owned(), number),
            bound(one),
            one.goal.map(number).unwrap_or_default(),
            one.verdict,
        );
        if one.verdict.fails() {
            println!("      {}", one.reason);
        }
    }
    for note in &findings.notes {
        println!("\n{note}");
    }
    let failing = findings
        .limits
        .iter()
        .filter(|one| one.verdict.fails())
        .count();
    let judged = findings
        .limits
        .iter()
        .filter(|one| one.verdict != Verdict::NotJudged)
        .count();
    println!("\n{} of {judged} limits kept", judged - failing);
}

/// The limit, marked where it is one from below.
fn bound(one: &Judgement) -> String {
    let mark = if one.at_least { ">= " } else { "" };
    format!("{mark}{}", number(one.limit))
}

/// Ratios with two digits, counts as what they are.
fn number(value: f64) -> String {
    if value.fract() == 0.0 && value >= 100.0 {
        format!("{value}")
    } else {
        format!("{value:.2}")
    }
}
