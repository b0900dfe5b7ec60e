//! The guard: a program that measures, and fails if a limit of `benches/limits.toml` is broken.
//!
//! Run it with `benches/guard`: the script builds it, starts callgrind to count instructions, and
//! gives the guard the counts. The guard is apart from the library because a scenario measures and
//! judges nothing, while the guard judges and leaves the measuring to the library.
//!
//! Exit codes: 0 all limits are kept, 1 a limit is broken or its figure is missing, 2 the guard
//! could not do its work.

mod error;
mod figures;
mod judge;
mod limits;
mod measure;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use lager_benches::chip::{self, ChipReport, Programs};
use lager_benches::{Scenario, at_least_one, median};
use lager_machine::Machine;
use serde::Serialize;

use crate::error::{GuardError, read};
use crate::figures::{AARCH64, Built, CYCLES, Figures, INSTRUCTIONS};
use crate::judge::{Judgement, Verdict, judge};
use crate::limits::Limits;
use crate::measure::measure;

/// Checks the bus, the path and the boards' images against their limits: ratios measured in one
/// run, and counts of instructions and cycles.
///
/// Exit codes: 0 all limits are kept; 1 a limit is broken or its figure is missing; 2 the guard
/// could not do its work.
#[derive(Debug, Parser)]
#[command(
    name = "benches/guard",
    bin_name = "benches/guard",
    after_help = "Examples:\n  benches/guard                        everything, about four minutes\n  benches/guard --only instructions    the counts alone, which no load disturbs\n  benches/guard --only hop --json\n  benches/guard --only hop,path,fanout --spread 10    before a limit is changed"
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
    /// How often to measure a scenario while a limit is broken or the machine is held up; all runs
    /// count together
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    attempts: usize,
    /// Judge nothing: measure each scenario N times, and show how far its figures spread
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    spread: Option<usize>,
    /// One line of JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Instruction counts as gungraun writes them (the script gives this)
    #[arg(long, value_name = "FILE", hide = true)]
    callgrind: Option<PathBuf>,
    /// Instruction counts on aarch64, which `tests/aarch64/run` makes and gives
    #[arg(long, value_name = "FILE", hide = true)]
    aarch64: Option<PathBuf>,
}

/// The guard's results.
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
    match Guard::new(Arguments::parse()).and_then(|guard| guard.run()) {
        Ok(kept) => ExitCode::from(u8::from(!kept)),
        Err(error) => {
            eprintln!("benches/guard: {error}");
            ExitCode::from(2)
        }
    }
}

/// The guard's task.
struct Guard {
    arguments: Arguments,
    limits: Limits,
    /// The sources that have limits, or the chosen ones, in the file's order.
    sources: Vec<String>,
}

impl Guard {
    fn new(arguments: Arguments) -> Result<Self, GuardError> {
        let limits = Limits::load(&arguments.limits)?;
        let mut sources: Vec<String> = Vec::new();
        for limit in &limits.limits {
            if !sources.contains(&limit.source) {
                sources.push(limit.source.clone());
            }
        }
        let only = &arguments.only;
        if let Some(unknown) = only.iter().find(|name| !sources.contains(name)) {
            let known = sources.join(", ");
            return Err(GuardError::NoSuchSource(unknown.clone(), known));
        }
        // The counts of another processor need its compiler and an emulator, which few machines have.
        let is_usual = |source: &String| source != AARCH64 || arguments.aarch64.is_some();
        sources.retain(|source| match only.is_empty() {
            true => is_usual(source),
            false => only.contains(source),
        });
        Ok(Self {
            arguments,
            limits,
            sources,
        })
    }

    /// Measures and judges; returns whether every limit is kept.
    fn run(&self) -> Result<bool, GuardError> {
        if let Some(times) = self.arguments.spread {
            return self.spread(times).map(|()| true);
        }
        let findings = self.judge()?;
        match self.arguments.json {
            true => println!("{}", json(&findings)),
            false => print(&findings),
        }
        Ok(findings.kept)
    }

    fn judge(&self) -> Result<Findings, GuardError> {
        let limits = &self.limits;
        let mut findings = Findings {
            machine: Machine::here().to_string(),
            kept: true,
            limits: Vec::new(),
            notes: Vec::new(),
        };
        for source in &self.sources {
            let counts = match source.as_str() {
                AARCH64 => &self.arguments.aarch64,
                _ => &self.arguments.callgrind,
            };
            let figures = match (Scenario::from_str(source, false), counts) {
                (Ok(scenario), _) => {
                    let (runs, attempts) = (self.arguments.runs, self.arguments.attempts);
                    let (figures, notes) = measure(limits, scenario, runs, attempts)?;
                    findings.notes.extend(notes);
                    figures
                }
                (Err(_), _) if source == CYCLES => Figures::of_chips(chips()?, |name| {
                    limits.of(CYCLES).any(|limit| limit.figure == name)
                })?,
                (Err(_), Some(file)) if source == INSTRUCTIONS => {
                    Figures::of_callgrind(file, &read(file)?, Built::by_rustc()?)?
                }
                (Err(_), Some(file)) if source == AARCH64 => {
                    Figures::of_qemu(file, &read(file)?, Built::by_rustc()?)?
                }
                (Err(_), _) => return Err(GuardError::NoCounts(source.clone())),
            };
            let (judgements, notes) = judge(limits, &figures);
            findings.kept &= !judgements.iter().any(|one| one.verdict.fails());
            findings.limits.extend(judgements);
            findings.notes.extend(notes);
        }
        Ok(findings)
    }

    /// Shows how far the limited ratios spread from one measurement to the next.
    fn spread(&self, times: usize) -> Result<(), GuardError> {
        head(["lowest", "median", "highest", "limit", "goal"], "");
        for scenario in self.scenarios() {
            let once = |_| measure::once(&self.limits, scenario, self.arguments.runs);
            let measured = (0..times).map(once).collect::<Result<Vec<_>, _>>()?;
            for limit in self.limits.of(&scenario.to_string()) {
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

    /// The sources that are timed.
    fn scenarios(&self) -> impl Iterator<Item = Scenario> {
        let scenario = |source: &String| Scenario::from_str(source, false).ok();
        self.sources.iter().filter_map(scenario)
    }
}

/// The cycles of the boards' images; `benches/guard` runs this in the source tree.
fn chips() -> Result<ChipReport, GuardError> {
    let programs = chip::BAUDS.map(|baud| (baud, Programs::in_tree("".as_ref(), baud)));
    chip::measure(programs).map_err(GuardError::Chip)
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

/// Prints the machine, and the head of a table of figures.
fn head<const N: usize>(columns: [&str; N], last: &str) {
    println!("{}\n", Machine::here());
    line("figure", columns.map(str::to_owned), last);
}

/// Prints a line of a table of figures.
fn line<const N: usize>(figure: &str, cells: [String; N], last: &str) {
    let cells = cells.map(|cell| format!(" {cell:>9}")).concat();
    println!("{figure:<70}{cells}  {last}");
}

/// A ratio with two digits, or a count as a whole number.
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
