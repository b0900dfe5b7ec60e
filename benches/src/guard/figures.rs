//! Named figures and their sources: a report of ratios, callgrind's counts through gungraun, or the
//! emulator. This module does not judge them.

use std::collections::BTreeMap;
use std::path::Path;

use clap::ValueEnum;
use lager_benches::chip::ChipReport;
use lager_benches::{Mode, Regime, Report, median};
use serde_json::Value;

use crate::error::GuardError;

/// The sources of counts: callgrind, qemu's count on a Raspberry Pi's processor, and the emulator of
/// the chips.
pub(crate) const INSTRUCTIONS: &str = "instructions";
pub(crate) const AARCH64: &str = "instructions-aarch64";
pub(crate) const CYCLES: &str = "cycles";

/// The figures of one source.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Figures {
    /// `hop`, `path`, `fanout`, or the name of a counted source in the limits.
    pub(crate) source: String,
    /// The compiler that built the program, for counts.
    pub(crate) built: Option<Built>,
    /// The value of each run, by the figure's name. The median counts.
    pub(crate) runs: BTreeMap<String, Vec<f64>>,
    /// The time of each ratio before it is divided by its baseline's, in ns, by the same names.
    pub(crate) times_ns: BTreeMap<String, f64>,
    /// What this machine cannot measure: the first words of the figures' names, and the reason.
    pub(crate) unmeasured: BTreeMap<String, String>,
}

/// The compiler that built a program, and the target.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Built {
    /// The compiler's version, `1.95.0`.
    pub(crate) rustc: String,
    /// The target triple.
    pub(crate) target: String,
}

/// The name of a ratio, in parts: `hop block same-core: lager / iceoryx2/event p50`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RatioName<'a> {
    /// The part before ` / `: the name of the row.
    pub(crate) row: &'a str,
    pub(crate) what: &'a str,
    pub(crate) mode: Mode,
    pub(crate) regime: Regime,
    pub(crate) label: &'a str,
    /// The label of the row with which it is compared.
    pub(crate) to: &'a str,
}

impl<'a> RatioName<'a> {
    /// Splits a name; `None` if it is not the name of a ratio.
    pub(crate) fn parse(text: &'a str) -> Option<Self> {
        let (row, compared) = text.split_once(" / ")?;
        let (group, label) = row.split_once(": ")?;
        // A label may contain a space.
        let (to, quantile) = compared.rsplit_once(' ')?;
        let [what, mode, regime] = group.split(' ').collect::<Vec<_>>()[..] else {
            return None;
        };
        ["p50", "p99"].contains(&quantile).then_some(())?;
        Some(Self {
            row,
            what,
            mode: Mode::from_str(mode, false).ok()?,
            regime: Regime::from_str(regime, false).ok()?,
            label,
            to,
        })
    }
}

impl Figures {
    /// The median of the runs.
    pub(crate) fn get(&self, figure: &str) -> Option<f64> {
        median(self.runs.get(figure)?.clone())
    }

    /// The ratios of a report.
    pub(crate) fn of_report(source: &str, report: &Report) -> Result<Self, GuardError> {
        let mut figures = Self::from_source(source);
        for row in &report.rows {
            let label = row.label();
            if row.rate.is_some_and(|rate| rate.overload()) {
                // Its figures are absent, so its limits are not kept.
                continue;
            }
            let own = row.service.unwrap_or(row.times);
            for ratio in &row.ratios {
                let runs = ratio.runs.iter();
                let p50: Vec<f64> = runs.clone().map(|run| run.0).collect();
                let p99: Vec<f64> = runs.filter_map(|run| run.1).collect();
                for (quantile, own_ns, runs) in [("p50", own.p50_ns, p50), ("p99", own.p99_ns, p99)]
                {
                    let Some(own_ns) = own_ns.filter(|_| !runs.is_empty()) else {
                        continue;
                    };
                    let name = format!(
                        "{} {} {}: {label} / {} {quantile}",
                        row.what, row.mode, row.regime, ratio.to
                    );
                    figures.times_ns.insert(name.clone(), own_ns as f64);
                    figures.add(name, runs)?;
                }
            }
        }
        Ok(figures)
    }

    /// The instruction counts that gungraun writes, a line of JSON for each bench.
    pub(crate) fn of_callgrind(file: &Path, text: &str, built: Built) -> Result<Self, GuardError> {
        let mut figures = Self::from_source(INSTRUCTIONS);
        figures.built = Some(built);
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            let bench: Value =
                serde_json::from_str(line).map_err(|error| not_counts(file, &error))?;
            let name = match (bench["function_name"].as_str(), bench["id"].as_str()) {
                (Some(function), Some(id)) => format!("{function}/{}", id.replace('_', "-")),
                _ => return Err(not_counts(file, &"a bench without a name")),
            };
            let count = bench["profiles"][0]["data"]["total"]["metrics"]["Ir"]["values"]["new"]
                .as_f64()
                .filter(|count| *count > 0.0)
                .ok_or_else(|| not_counts(file, &format!("`{name}` has no instructions")))?;
            figures.add(name, vec![count])?;
        }
        match figures.runs.is_empty() {
            true => Err(not_counts(file, &"it holds no figure")),
            false => Ok(figures),
        }
    }

    /// The instruction counts of `tests/aarch64/run`, a line `FIGURE COUNT` for each step.
    pub(crate) fn of_qemu(file: &Path, text: &str, built: Built) -> Result<Self, GuardError> {
        let mut figures = Self::from_source(AARCH64);
        figures.built = Some(Built {
            target: "aarch64-unknown-linux-gnu".to_owned(),
            ..built
        });
        for line in text.lines() {
            let (name, count) = line
                .split_once(' ')
                .and_then(|(name, count)| Some((name, count.parse::<u32>().ok()?)))
                .ok_or_else(|| not_counts(file, &format!("`{line}` is no figure")))?;
            figures.add(name.to_owned(), vec![count.into()])?;
        }
        Ok(figures)
    }

    /// The cycles of the boards' images for the figures that have a limit. `lager bench chip`
    /// reports the other figures.
    pub(crate) fn of_chips(
        report: ChipReport,
        limited: impl Fn(&str) -> bool,
    ) -> Result<Self, GuardError> {
        let mut figures = Self::from_source(CYCLES);
        figures.built = Some(Built {
            rustc: report.rustc,
            target: "avr-none".to_owned(),
        });
        for figure in report.figures {
            if limited(&figure.name) {
                figures.add(figure.name, vec![figure.value])?;
            }
        }
        Ok(figures)
    }

    /// Whether this machine cannot measure that figure.
    pub(crate) fn cannot_be_measured(&self, figure: &str) -> bool {
        let what = figure.split(' ').next().unwrap_or_default();
        self.unmeasured.contains_key(what)
    }

    /// Joins the runs of two measurements of the same source.
    pub(crate) fn pooled_with(mut self, other: Self) -> Self {
        for (name, more) in other.runs {
            self.runs.entry(name).or_default().extend(more);
        }
        self
    }

    fn from_source(source: &str) -> Self {
        Self {
            source: source.to_owned(),
            ..Self::default()
        }
    }

    fn add(&mut self, name: String, runs: Vec<f64>) -> Result<(), GuardError> {
        match self.runs.insert(name.clone(), runs) {
            None => Ok(()),
            Some(_) => Err(GuardError::Twice(self.source.clone(), name)),
        }
    }
}

fn not_counts(file: &Path, why: &dyn std::fmt::Display) -> GuardError {
    let why = format!(
        "these are no counts ({why}); run `benches/guard`, or `tests/aarch64/run` for aarch64, which makes them"
    );
    GuardError::Unusable(file.to_owned(), why)
}

impl Built {
    /// The compiler's version and target as `rustc -vV` prints them.
    pub(crate) fn by_rustc() -> Result<Self, GuardError> {
        // Cargo gives the compiler's path to programs that it starts; otherwise it is in PATH.
        let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
        let output = std::process::Command::new(rustc).arg("-vV").output();
        let output = output.map_err(|error| GuardError::Rustc(error.to_string()))?;
        Self::parse(&String::from_utf8_lossy(&output.stdout))
    }

    fn parse(text: &str) -> Result<Self, GuardError> {
        let field = |name: &str| {
            let mut lines = text.lines();
            let value = lines.find_map(|line| line.strip_prefix(name));
            value
                .map(|value| value.trim().to_owned())
                .ok_or_else(|| GuardError::Rustc(format!("no line `{name}`")))
        };
        Ok(Self {
            rustc: field("release:")?,
            target: field("host:")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn built() -> Built {
        Built {
            rustc: "1.95.0".to_owned(),
            target: "t".to_owned(),
        }
    }

    fn of_report(rows: &str) -> Result<Figures, GuardError> {
        let report = format!(r#"{{"machine":"m","rows":[{rows}]}}"#);
        Figures::of_report("hop", &serde_json::from_str(&report).unwrap())
    }

    const ROW: &str = r#"{"name":"lager","what":"hop","mode":"block","regime":"same-core","n":9,
        "p50_ns":50,"p99_ns":60,"p999_ns":70,"ratios":[
        {"to":"futex","p50":1.25,"p99":1.5,"runs":[[1.25,1.5]]},
        {"to":"iceoryx2/event","p50":0.5,"p99":0.6,"runs":[[0.5,0.6]]}]}"#;

    #[test]
    fn a_ratio_is_named_as_it_is_read() {
        let name = RatioName::parse("path@observed block plain: lager/64 observers / floor p99");
        let expected = RatioName {
            row: "path@observed block plain: lager/64 observers",
            what: "path@observed",
            mode: Mode::Block,
            regime: Regime::Plain,
            label: "lager/64 observers",
            to: "floor",
        };
        assert_eq!(name, Some(expected));
        let figures = of_report(ROW).unwrap();
        assert!(
            figures
                .runs
                .keys()
                .all(|name| RatioName::parse(name).is_some())
        );
        assert_eq!(figures.runs.len(), 4, "every comparison is a figure");
        let get = |name| figures.get(name).unwrap();
        assert_eq!(get("hop block same-core: lager / futex p50"), 1.25);
        assert_eq!(get("hop block same-core: lager / iceoryx2/event p99"), 0.6);
    }

    #[test]
    fn what_has_too_few_samples_or_too_slow_a_machine_is_no_figure() {
        let few = of_report(&ROW.replace("1.5]", "null]").replace("0.6]", "null]")).unwrap();
        assert!(few.runs.keys().all(|name| name.ends_with("p50")));
        assert_eq!(few.runs.len(), 2);
        let slow = ROW.replacen('{', r#"{"rate":{"asked_hz":1000.0,"reached_hz":980.0},"#, 1);
        assert!(of_report(&slow).unwrap().runs.is_empty());
    }

    #[test]
    fn two_rows_of_one_name_are_refused() {
        let twice = of_report(&format!("{ROW},{ROW}"));
        assert!(matches!(twice, Err(GuardError::Twice(..))), "{twice:?}");
    }

    #[test]
    fn a_step_on_aarch64_is_a_line() {
        let read = |text: &str| Figures::of_qemu(Path::new("f"), text, built());
        let figures = read("publish/to-1 910\npublish/to-64 3000\n").unwrap();
        assert_eq!(figures.get("publish/to-64"), Some(3000.0));
        let built = figures.built.unwrap();
        assert_eq!(built.target, "aarch64-unknown-linux-gnu");
        for wrong in [
            "publish/to-1",
            "publish/to-1 -3",
            "publish/to-1 \n",
            "a 1\na 2",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn gungrauns_lines_are_counts() {
        let line = |id: &str, count: &str| {
            format!(
                r#"{{"function_name":"publish","id":"{id}","profiles":[{{"data":{{"total":{{"metrics":{{"Ir":{{"values":{{"new":{count}}}}}}}}}}}}}]}}"#
            )
        };
        let read = |text: &str| Figures::of_callgrind(Path::new("f"), text, built());
        let text = format!("{}\n{}\n", line("to_one", "910"), line("to_64", "3000"));
        let figures = read(&text).unwrap();
        assert_eq!(figures.get("publish/to-one"), Some(910.0));
        assert_eq!(figures.get("publish/to-64"), Some(3000.0));
        for wrong in ["", &line("x", "null"), "{}", "panic"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn of_two_measurements_the_median_of_all_runs_counts() {
        let of = |runs: &[f64]| Figures {
            runs: [("a".to_owned(), runs.to_vec())].into(),
            ..Figures::default()
        };
        // Neither one lucky run nor one unlucky run decides.
        let pooled = of(&[1.3, 1.2, 1.4]).pooled_with(of(&[0.5, 1.25, 9.0]));
        assert_eq!(pooled.get("a"), Some(1.275));
    }

    #[test]
    fn rustc_says_what_it_is() {
        let text = "rustc 1.95.0 (5 2026)\nhost: t\nrelease: 1.95.0\nLLVM version: 22\n";
        assert_eq!(Built::parse(text).unwrap(), built());
        assert!(Built::parse("what?").is_err());
    }
}
