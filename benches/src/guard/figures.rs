//! Named figures and their sources: criterion's estimates, callgrind's counts through gungraun, or the
//! emulator. This module does not judge them.

use std::collections::BTreeMap;
use std::path::Path;

use lager_benches::chip::ChipReport;

use crate::error::GuardError;

/// The source of ratios of times, which criterion estimates ([`crate::estimates`]).
pub(crate) const LATENCY: &str = "latency";

/// The beginning of the figures of a robot that runs in real time.
const REAL_TIME: &str = "latency/path@observed/";

/// The sources of counts: callgrind, qemu's count on a Raspberry Pi's processor, and the emulator of
/// the chips.
pub(crate) const INSTRUCTIONS: &str = "instructions";
pub(crate) const AARCH64: &str = "instructions-aarch64";
pub(crate) const CYCLES: &str = "cycles";

/// The figures of one source.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Figures {
    /// [`LATENCY`], or the name of a counted source in the limits.
    pub(crate) source: String,
    /// The compiler that built the program, for counts.
    pub(crate) built: Option<Built>,
    /// The values by the figures' names.
    pub(crate) values: BTreeMap<String, Interval>,
    /// Why this machine cannot measure the figures of [`REAL_TIME`], if it cannot.
    pub(crate) no_real_time: Option<String>,
}

/// A measured value between the ends between which it lies; those of a count are the count.
pub(crate) type Interval = [f64; 3];

/// The compiler that built a program, and the target.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Built {
    /// The compiler's version, `1.95.0`.
    pub(crate) rustc: String,
    /// The target triple.
    pub(crate) target: String,
}

impl Figures {
    /// The instruction counts that gungraun writes, a line of JSON for each bench.
    pub(crate) fn of_callgrind(file: &Path, text: &str, built: Built) -> Result<Self, GuardError> {
        let mut figures = Self::from_source(INSTRUCTIONS);
        figures.built = Some(built);
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            let bench: serde_json::Value =
                serde_json::from_str(line).map_err(|error| not_counts(file, &error))?;
            let name = match (bench["function_name"].as_str(), bench["id"].as_str()) {
                (Some(function), Some(id)) => format!("{function}/{}", id.replace('_', "-")),
                _ => return Err(not_counts(file, &"a bench without a name")),
            };
            let count = bench["profiles"][0]["data"]["total"]["metrics"]["Ir"]["values"]["new"]
                .as_f64()
                .filter(|count| *count > 0.0)
                .ok_or_else(|| not_counts(file, &format!("`{name}` has no instructions")))?;
            figures.add(name, count)?;
        }
        match figures.values.is_empty() {
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
            figures.add(name.to_owned(), count.into())?;
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
                figures.add(figure.name, figure.value)?;
            }
        }
        Ok(figures)
    }

    /// Whether this machine cannot measure that figure.
    pub(crate) fn cannot_be_measured(&self, figure: &str) -> bool {
        self.no_real_time.is_some() && figure.starts_with(REAL_TIME)
    }

    pub(crate) fn from_source(source: &str) -> Self {
        Self {
            source: source.to_owned(),
            ..Self::default()
        }
    }

    fn add(&mut self, name: String, count: f64) -> Result<(), GuardError> {
        match self.values.insert(name.clone(), [count; 3]) {
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

    #[test]
    fn a_step_on_aarch64_is_a_line() {
        let read = |text: &str| Figures::of_qemu(Path::new("f"), text, built());
        let figures = read("publish/to-1 910\npublish/to-64 3000\n").unwrap();
        assert_eq!(figures.values["publish/to-64"], [3000.0; 3]);
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
        assert_eq!(figures.values["publish/to-one"], [910.0; 3]);
        assert_eq!(figures.values["publish/to-64"], [3000.0; 3]);
        for wrong in ["", &line("x", "null"), "{}", "panic"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn rustc_says_what_it_is() {
        let text = "rustc 1.95.0 (5 2026)\nhost: t\nrelease: 1.95.0\nLLVM version: 22\n";
        assert_eq!(Built::parse(text).unwrap(), built());
        assert!(Built::parse("what?").is_err());
    }
}
