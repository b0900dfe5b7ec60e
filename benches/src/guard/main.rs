//! The guard: a program that fails if a limit of `benches/limits.toml` is broken.
//!
//! Run it with `benches/guard`: the script builds it, lets criterion time and callgrind count, and
//! gives the guard the estimates and the counts. The guard judges, and measures nothing itself.
//!
//! Exit codes: 0 all limits are kept, 1 a limit is broken or its figure is missing, 2 the guard
//! could not do its work.

mod error;
mod estimates;
mod figures;
mod judge;
mod limits;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use lager_benches::chip::{self, ChipReport, Programs};
use lager_machine::Machine;
use serde::Serialize;

use crate::error::{GuardError, read};
use crate::figures::{AARCH64, Built, CYCLES, Figures, INSTRUCTIONS, LATENCY};
use crate::judge::{Judgement, Verdict, judge};
use crate::limits::Limits;

/// Checks the bus, the path and the boards' images against their limits: ratios of criterion's
/// estimates, and counts of instructions and cycles.
///
/// Exit codes: 0 all limits are kept; 1 a limit is broken or its figure is missing; 2 the guard
/// could not do its work.
#[derive(Debug, Parser)]
#[command(
    name = "benches/guard",
    bin_name = "benches/guard",
    after_help = "Examples:\n  benches/guard                        everything, about five minutes\n  benches/guard --only instructions    the counts alone, which no load disturbs\n  benches/guard --only latency --json\n  benches/guard --only latency --repetitions 20    before a limit is changed"
)]
struct Arguments {
    /// The limits
    #[arg(long, value_name = "FILE", default_value = "benches/limits.toml")]
    limits: PathBuf,
    /// Judge these sources only: latency, instructions, cycles
    #[arg(long, value_name = "SOURCE", value_delimiter = ',')]
    only: Vec<String>,
    /// One line of JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Criterion's estimates, a folder for each repetition (the script gives this)
    #[arg(long, value_name = "FOLDER", hide = true)]
    estimates: Option<PathBuf>,
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
            let figures = self.figures(source)?;
            let (judgements, notes) = judge(limits, &figures);
            findings.kept &= !judgements.iter().any(|one| one.verdict.fails());
            findings.limits.extend(judgements);
            findings.notes.extend(notes);
        }
        Ok(findings)
    }

    fn figures(&self, source: &str) -> Result<Figures, GuardError> {
        let measured = match source {
            LATENCY => &self.arguments.estimates,
            AARCH64 => &self.arguments.aarch64,
            _ => &self.arguments.callgrind,
        };
        let names = || self.limits.of(source).map(|limit| limit.figure.as_str());
        match (source, measured) {
            (CYCLES, _) => Figures::of_chips(chips()?, |name| names().any(|one| one == name)),
            (LATENCY, Some(folder)) => estimates::ratios(folder, names()),
            (INSTRUCTIONS, Some(file)) => {
                Figures::of_callgrind(file, &read(file)?, Built::by_rustc()?)
            }
            (AARCH64, Some(file)) => Figures::of_qemu(file, &read(file)?, Built::by_rustc()?),
            _ => Err(GuardError::NotMeasured(source.to_owned())),
        }
    }
}

/// The cycles of the boards' images; `benches/guard` runs this in the source tree.
fn chips() -> Result<ChipReport, GuardError> {
    let programs = chip::BAUDS.map(|baud| (baud, Programs::in_tree("".as_ref(), baud)));
    chip::measure(programs).map_err(GuardError::Chip)
}

fn print(findings: &Findings) {
    println!("{}\n", findings.machine);
    let line = |figure: &str, [measured, interval, limit, goal, verdict]: [&str; 5]| {
        println!("{figure:<68} {measured:>9} {interval:>15} {limit:>9} {goal:>9}  {verdict}");
    };
    line("figure", ["measured", "95 %", "limit", "goal", "verdict"]);
    for one in &findings.limits {
        let mark = if one.at_least { ">= " } else { "" };
        let limit = format!("{mark}{}", number(Some(one.limit)));
        let interval = one
            .interval
            .map(|ends| ends.map(|end| number(Some(end))).join(" to "));
        let verdict = one.verdict.to_string();
        let (measured, goal) = (number(one.measured), number(one.goal));
        let interval = interval.unwrap_or_default();
        line(&one.figure, [&measured, &interval, &limit, &goal, &verdict]);
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

/// A ratio, or a count as a whole number.
fn number(value: Option<f64>) -> String {
    match value {
        Some(value) if value.fract() == 0.0 && value >= 100.0 => format!("{value}"),
        Some(value) if value < 0.1 => format!("{value:.3}"),
        Some(value) => format!("{value:.2}"),
        None => "-".to_owned(),
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("names and numbers are JSON")
}
