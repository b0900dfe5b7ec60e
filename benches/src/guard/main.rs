//! The guard: measures, and fails when a limit of `benches/limits.toml` is broken.
//!
//! `benches/guard` is the way to run it: the script builds this, has callgrind count instructions,
//! and hands the counts over. Apart from the library, because a scenario measures and asserts
//! nothing, while this decides and measures nothing itself.
//!
//! Exit codes: 0 all limits are kept, 1 a limit is broken or its figure is missing, 2 the guard
//! could not do its work.

mod error;
mod figures;
mod judge;
mod limits;
mod measure;
mod trial;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use lager_benches::chip::{self, Programs};
use lager_benches::{Scenario, machine, median};
use serde::Serialize;

use crate::error::{GuardError, read};
use crate::figures::{Built, Figures};
use crate::judge::{Judgement, Verdict, judge};
use crate::limits::Limits;
use crate::measure::measure;

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
            match arguments.json {
                true => println!("{}", json(&findings)),
                false => print(&findings),
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
    let mut findings = Findings {
        machine: machine::describe(),
        kept: true,
        limits: Vec::new(),
        notes: Vec::new(),
    };
    for source in sources {
        let counted = counts.iter().find(|figures| figures.source == source);
        let figures = match (counted, Scenario::from_str(&source, false)) {
            (Some(figures), _) => figures.clone(),
            (None, Ok(scenario)) => {
                let (runs, attempts) = (arguments.runs, arguments.attempts);
                let (figures, times) = measure(&limits, scenario, runs, attempts)?;
                if times > 1 {
                    findings.notes.push(format!(
                        "{source}: measured {times} times because a limit was broken; the medians of all runs count"
                    ));
                }
                figures
            }
            (None, Err(_)) if source == CYCLES => {
                // `benches/guard` runs this in the source tree.
                let programs = chip::BAUDS.map(|baud| (baud, Programs::in_tree("".as_ref(), baud)));
                let report = chip::measure(programs).map_err(GuardError::Chip)?;
                let limited = |name: &str| limits.of(CYCLES).any(|limit| limit.figure == name);
                Figures::of_chips(CYCLES, report, limited)?
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
    head(["lowest", "median", "highest", "limit", "goal"], "");
    for scenario in scenarios {
        let once = |_| measure::once(&limits, scenario, arguments.runs);
        let measured = (0..times).map(once).collect::<Result<Vec<_>, _>>()?;
        for limit in limits.of(&scenario.to_string()) {
            let values = measured.iter().filter_map(|one| one.get(&limit.figure));
            let mut values: Vec<f64> = values.collect();
            values.sort_unstable_by(f64::total_cmp);
            let (lowest, highest) = (values.first().copied(), values.last().copied());
            let cells = [lowest, median(values), highest, limit.at_most, limit.goal];
            line(&limit.figure, cells.map(number), "");
        }
    }
    Ok(())
}

/// Plants a slow-down just above each limit on a ratio; whether the guard has noticed each.
fn try_limits(arguments: &Arguments) -> Result<bool, GuardError> {
    let limits = Limits::load(&arguments.limits)?;
    let scenarios = scenarios(&limits, arguments)?;
    let mut all_noticed = true;
    if !arguments.json {
        head(["limit", "before", "slower ns", "with it"], "noticed");
    }
    for scenario in scenarios {
        let (figures, _) = measure(&limits, scenario, arguments.runs, 1)?;
        for mut trial in trial::trials(&limits, &figures) {
            let source = scenario.to_string();
            trial::run(&mut trial, &arguments.limits, &source, arguments.runs)?;
            for planted in trial {
                all_noticed &= planted.noticed;
                if arguments.json {
                    println!("{}", json(&planted));
                    continue;
                }
                let (limit, before) = (Some(planted.limit), Some(planted.before));
                let cells = [limit, before, Some(planted.spin_ns as f64), planted.with];
                let noticed = if planted.noticed { "yes" } else { "NO" };
                line(&planted.figure, cells.map(number), noticed);
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
    let scenario = |source: &String| Scenario::from_str(source, false).ok();
    Ok(sources.iter().filter_map(scenario).collect())
}

fn counts(arguments: &Arguments) -> Result<Vec<Figures>, GuardError> {
    let callgrind = arguments.callgrind.iter();
    let instructions =
        callgrind.map(|file| Figures::of_callgrind(file, &read(file)?, Built::by_rustc()?));
    let others = arguments.counts.iter();
    let others = others.map(|file| Figures::of_counts(file, &read(file)?));
    instructions.chain(others).collect()
}

fn print(findings: &Findings) {
    head(["measured", "limit", "goal"], "verdict");
    for one in &findings.limits {
        let mark = if one.at_least { ">= " } else { "" };
        let limit = format!("{mark}{}", number(Some(one.limit)));
        let cells = [number(one.measured), limit, number(one.goal)];
        line(&one.figure, cells, &one.verdict.to_string());
        if one.verdict.fails() {
            println!("      {}", one.reason);
        }
    }
    for note in &findings.notes {
        println!("\n{note}");
    }
    let count = |is: fn(Verdict) -> bool| {
        let verdicts = findings.limits.iter().map(|one| one.verdict);
        verdicts.filter(|verdict| is(*verdict)).count()
    };
    let kept = count(|verdict| verdict == Verdict::Kept);
    let judged = count(|verdict| verdict != Verdict::NotJudged);
    println!("\n{kept} of {judged} limits kept");
}

/// The machine, and the head of a table of figures.
fn head<const N: usize>(columns: [&str; N], last: &str) {
    println!("{}\n", machine::describe());
    line("figure", columns.map(str::to_owned), last);
}

/// A line of a table of figures.
fn line<const N: usize>(figure: &str, cells: [String; N], last: &str) {
    let cells = cells.map(|cell| format!(" {cell:>9}")).concat();
    println!("{figure:<70}{cells}  {last}");
}

/// Ratios with two digits, counts as what they are.
fn number(value: Option<f64>) -> String {
    match value {
        Some(value) if value.fract() == 0.0 && value >= 100.0 => format!("{value}"),
        Some(value) => format!("{value:.2}"),
        None => "-".to_owned(),
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("names and numbers are JSON")
}
