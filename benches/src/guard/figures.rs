//! Named figures and where they come from: a report of ratios, callgrind's counts by way of
//! gungraun, or a plain file of counts (`--counts`). Nothing is judged here.

use core::fmt;
use core::str::FromStr;
use std::collections::BTreeMap;

use lager_benches::chip::Trace;
use lager_benches::{Mode, Regime, Report, median};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The figures of one source.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Figures {
    /// `hop`, `path`, `fanout`, or what the limits call a counted source.
    pub(crate) source: String,
    /// What built the program, for counts.
    #[serde(default)]
    pub(crate) built: Option<Built>,
    /// The figures by name; of ratios, the medians of `runs`.
    pub(crate) figures: BTreeMap<String, f64>,
    /// The ratios of each run, by the same names.
    #[serde(skip)]
    pub(crate) runs: BTreeMap<String, Vec<f64>>,
    /// The time that each ratio compares with its baseline's, in ns, by the same names.
    #[serde(skip)]
    pub(crate) times_ns: BTreeMap<String, f64>,
    /// What this machine cannot measure, with the reason: the first words of figures' names.
    #[serde(skip)]
    pub(crate) unmeasured: BTreeMap<String, String>,
}

/// Which compiler built a program, and for what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Built {
    /// The compiler's version, `1.95.0`.
    pub(crate) rustc: String,
    /// The target triple.
    pub(crate) target: String,
}

/// Why there are no figures.
#[derive(Debug, PartialEq, thiserror::Error)]
pub(crate) enum FiguresError {
    #[error(
        "`{source_name}` yields `{figure}` twice, so a limit on it would hold one of them only; give one of the rows another name or variant"
    )]
    Twice { source_name: String, figure: String },
    #[error(
        "the counts in {file} are not understood ({detail}); run `benches/guard`, which makes them"
    )]
    NotCounts { file: String, detail: String },
    #[error("{file} holds no figure; run `benches/guard`, which makes it")]
    None { file: String },
    #[error("{file} cannot be read ({detail})")]
    Unreadable { file: String, detail: String },
    #[error(
        "`rustc -vV` does not say what it is ({detail}); put the rustc that built the benches into PATH"
    )]
    Rustc { detail: String },
}

/// Names one ratio of a report: `hop block same-core: lager / iceoryx2/listener p50`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RatioName {
    what: String,
    pub(crate) mode: Mode,
    pub(crate) regime: Regime,
    label: String,
    to: String,
    quantile: Quantile,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantile {
    P50,
    P99,
}

impl RatioName {
    /// Whether one of the two rows can be slowed down without touching the other one's ratio.
    pub(crate) fn is_apart_from(&self, other: &Self) -> bool {
        let (label, beside) = (&self.label, &other.label);
        if (&self.what, self.regime) != (&other.what, other.regime) {
            return true;
        }
        let same_row = label == beside && self.mode == other.mode;
        !same_row && self.to != *beside && other.to != *label
    }
}

impl fmt::Display for RatioName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{} {} {}: {} / {} {}",
            self.what,
            self.mode,
            self.regime,
            self.label,
            self.to,
            match self.quantile {
                Quantile::P50 => "p50",
                Quantile::P99 => "p99",
            }
        )
    }
}

impl FromStr for RatioName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        // A label may have a space in it.
        let parts = text
            .split_once(": ")
            .and_then(|(row, compared)| Some((row, compared.split_once(" / ")?)))
            .and_then(|(row, (label, rest))| Some((row, label, rest.rsplit_once(' ')?)));
        let Some((row, label, (to, quantile))) = parts else {
            return Err("it does not have these parts".to_owned());
        };
        let [what, mode, regime] = row.split(' ').collect::<Vec<_>>()[..] else {
            return Err("before the colon there are not three words".to_owned());
        };
        Ok(Self {
            what: what.to_owned(),
            mode: mode.parse().map_err(|error| format!("{error}"))?,
            regime: regime.parse().map_err(|error| format!("{error}"))?,
            label: label.to_owned(),
            to: to.to_owned(),
            quantile: match quantile {
                "p50" => Quantile::P50,
                "p99" => Quantile::P99,
                other => return Err(format!("`{other}` is neither p50 nor p99")),
            },
        })
    }
}

impl Figures {
    /// The ratios of a report.
    pub(crate) fn of_report(source: &str, report: &Report) -> Result<Self, FiguresError> {
        let (mut figures, mut runs) = (BTreeMap::new(), BTreeMap::new());
        let mut times_ns = BTreeMap::new();
        for row in &report.rows {
            for ratio in &row.ratios {
                for (place, quantile, value, own_ns) in [
                    (0, Quantile::P50, ratio.p50, row.p50_ns),
                    (1, Quantile::P99, ratio.p99, row.p99_ns),
                ] {
                    let name = RatioName {
                        what: row.what.clone(),
                        mode: row.mode,
                        regime: row.regime,
                        label: row.label(),
                        to: ratio.to.clone(),
                        quantile,
                    }
                    .to_string();
                    let values = ratio.runs.iter().map(|run| run[place]).collect();
                    runs.insert(name.clone(), values);
                    times_ns.insert(name.clone(), own_ns as f64);
                    insert(source, &mut figures, name, value)?;
                }
            }
        }
        Ok(Self {
            source: source.to_owned(),
            built: None,
            figures,
            runs,
            times_ns,
            ..Self::default()
        })
    }

    /// The instruction counts that gungraun writes, one line of JSON for each bench.
    pub(crate) fn of_callgrind(file: &str, text: &str, built: Built) -> Result<Self, FiguresError> {
        let not_counts = |detail: String| FiguresError::NotCounts {
            file: file.to_owned(),
            detail,
        };
        let mut figures = BTreeMap::new();
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            let bench: Value =
                serde_json::from_str(line).map_err(|error| not_counts(error.to_string()))?;
            let name = match (bench["function_name"].as_str(), bench["id"].as_str()) {
                (Some(function), Some(id)) => format!("{function}/{}", id.replace('_', "-")),
                _ => return Err(not_counts("a bench without a name".to_owned())),
            };
            let count = bench["profiles"][0]["data"]["total"]["metrics"]["Ir"]["values"]["new"]
                .as_f64()
                .filter(|count| *count > 0.0)
                .ok_or_else(|| not_counts(format!("`{name}` has no instructions")))?;
            insert("instructions", &mut figures, name, count)?;
        }
        Self {
            source: "instructions".to_owned(),
            built: Some(built),
            figures,
            ..Self::default()
        }
        .not_empty(file)
    }

    /// Counts from a program of another workspace, in this type's own JSON.
    pub(crate) fn of_counts(file: &str, text: &str) -> Result<Self, FiguresError> {
        let figures: Self =
            serde_json::from_str(text).map_err(|error| FiguresError::NotCounts {
                file: file.to_owned(),
                detail: error.to_string(),
            })?;
        if figures.built.is_none() {
            return Err(FiguresError::NotCounts {
                file: file.to_owned(),
                detail: "it does not say what compiler built what was counted".to_owned(),
            });
        }
        figures.not_empty(file)
    }

    /// The cycles of the boards' images, of those figures that have a limit: the others are for the
    /// report of `lager bench chip`.
    pub(crate) fn of_traces(
        source: &str,
        traces: &[Trace],
        limited: impl Fn(&str) -> bool,
    ) -> Result<Self, FiguresError> {
        let mut figures = BTreeMap::new();
        for figure in traces.iter().flat_map(Trace::figures) {
            if limited(&figure.name) {
                insert(source, &mut figures, figure.name, figure.value)?;
            }
        }
        let built = traces.first().map(|trace| Built {
            rustc: trace.rustc.clone(),
            target: "avr-none".to_owned(),
        });
        Ok(Self {
            source: source.to_owned(),
            built,
            figures,
            ..Self::default()
        })
    }

    /// Whether this machine cannot measure that figure.
    pub(crate) fn cannot_be_measured(&self, figure: &str) -> bool {
        let what = figure.split(' ').next().unwrap_or_default();
        self.unmeasured.contains_key(what)
    }

    /// Puts the runs of two measurements of the same source together; each figure is the median of
    /// all of them.
    pub(crate) fn pooled_with(mut self, other: Self) -> Self {
        for (name, value) in other.figures {
            self.figures.entry(name).or_insert(value);
        }
        for (name, more) in other.runs {
            let runs = self.runs.entry(name.clone()).or_default();
            runs.extend(more);
            if let Some(middle) = median(runs.clone()) {
                self.figures.insert(name, middle);
            }
        }
        self
    }

    fn not_empty(self, file: &str) -> Result<Self, FiguresError> {
        if self.figures.is_empty() {
            return Err(FiguresError::None {
                file: file.to_owned(),
            });
        }
        Ok(self)
    }
}

fn insert(
    source: &str,
    figures: &mut BTreeMap<String, f64>,
    name: String,
    value: f64,
) -> Result<(), FiguresError> {
    match figures.insert(name.clone(), value) {
        None => Ok(()),
        Some(_) => Err(FiguresError::Twice {
            source_name: source.to_owned(),
            figure: name,
        }),
    }
}

impl Built {
    /// What `rustc -vV` says it is and builds for.
    pub(crate) fn by_rustc() -> Result<Self, FiguresError> {
        // Cargo names it for programs it starts, and otherwise it is the one in PATH.
        let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
        let output = std::process::Command::new(rustc)
            .arg("-vV")
            .output()
            .map_err(|error| FiguresError::Rustc {
                detail: error.to_string(),
            })?;
        Self::parse(&String::from_utf8_lossy(&output.stdout))
    }

    fn parse(text: &str) -> Result<Self, FiguresError> {
        let field = |name: &str| {
            text.lines()
                .find_map(|line| line.strip_prefix(name))
                .map(|value| value.trim().to_owned())
                .ok_or_else(|| FiguresError::Rustc {
                    detail: format!("no line `{name}`"),
                })
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

    fn report(rows: &str) -> Report {
        serde_json::from_str(&format!(r#"{{"machine":"m","rows":[{rows}]}}"#)).unwrap()
    }

    const ROW: &str = r#"{"name":"lager","what":"hop","mode":"block","regime":"same-core","n":9,
        "p50_ns":50,"p99_ns":60,"p999_ns":70,"ratio_to":"futex","ratio_p50":1.25,"ratio_p99":1.5,
        "ratios":[{"to":"futex","p50":1.25,"p99":1.5},{"to":"iceoryx2/listener","p50":0.5,"p99":0.6}]}"#;

    #[test]
    fn a_ratio_is_named_as_it_is_read() {
        for text in [
            "hop@10kHz adaptive no-halt: lager/x / iceoryx2/listener p99",
            "path@observed block plain: lager/64 observers / lager/alone p99",
        ] {
            assert_eq!(text.parse::<RatioName>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn every_comparison_of_a_report_is_a_figure() {
        let figures = Figures::of_report("hop", &report(ROW)).unwrap().figures;
        assert_eq!(figures.len(), 4);
        assert_eq!(figures["hop block same-core: lager / futex p50"], 1.25);
        assert_eq!(
            figures["hop block same-core: lager / iceoryx2/listener p99"],
            0.6
        );
    }

    #[test]
    fn two_rows_of_one_name_are_refused() {
        let twice = Figures::of_report("hop", &report(&format!("{ROW},{ROW}")));
        assert!(
            matches!(twice, Err(FiguresError::Twice { .. })),
            "{twice:?}"
        );
    }

    #[test]
    fn gungrauns_lines_are_counts() {
        let line = |id: &str, count: &str| {
            format!(
                r#"{{"function_name":"publish","id":"{id}","profiles":[{{"data":{{"total":{{"metrics":{{"Ir":{{"values":{{"new":{count}}}}}}}}}}}}}]}}"#
            )
        };
        let text = format!("{}\n{}\n", line("to_one", "910"), line("to_64", "3000"));
        let figures = Figures::of_callgrind("f", &text, built()).unwrap().figures;
        assert_eq!(figures["publish/to-one"], 910.0);
        assert_eq!(figures["publish/to-64"], 3000.0);
        for wrong in [
            String::new(),
            line("x", "null"),
            "{}".to_owned(),
            "panic".to_owned(),
        ] {
            assert!(
                Figures::of_callgrind("f", &wrong, built()).is_err(),
                "{wrong}"
            );
        }
    }

    #[test]
    fn another_programs_counts_say_what_built_them() {
        let text = r#"{"source":"cycles","built":{"rustc":"1.96.0","target":"avr-none"},"figures":{"line":640}}"#;
        let figures = Figures::of_counts("f", text).unwrap();
        assert_eq!(
            (figures.source.as_str(), figures.figures["line"]),
            ("cycles", 640.0)
        );
        let unknown = r#"{"source":"cycles","figures":{"line":640}}"#;
        assert!(Figures::of_counts("f", unknown).is_err());
    }

    #[test]
    fn of_two_measurements_the_median_of_all_runs_counts() {
        let of = |runs: &[f64]| Figures {
            source: "hop".to_owned(),
            built: None,
            figures: [("a".to_owned(), median(runs.to_vec()).unwrap())].into(),
            runs: [("a".to_owned(), runs.to_vec())].into(),
            ..Figures::default()
        };
        // One lucky run does not decide, and one unlucky one does not either.
        let pooled = of(&[1.3, 1.2, 1.4]).pooled_with(of(&[0.5, 1.25, 9.0]));
        assert_eq!(pooled.figures["a"], 1.275);
    }

    #[test]
    fn rustc_says_what_it_is() {
        let text =
            "rustc 1.95.0 (5 2026)\nbinary: rustc\nhost: t\nrelease: 1.95.0\nLLVM version: 22\n";
        assert_eq!(Built::parse(text).unwrap(), built());
        assert!(Built::parse("what?").is_err());
    }
}
