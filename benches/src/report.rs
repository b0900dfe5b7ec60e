//! The result of a measurement (rows with quantiles and ratios, as a table and as JSON), and the
//! options of a measurement.
//!
//! Nothing here measures or judges. The guard checks limits; a report does not.

use core::fmt;

use clap::ValueEnum;
use lager_wake::Policy;
use serde::{Deserialize, Serialize};

use crate::stats::Quantiles;

/// How the receiver waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// It looks without pause.
    Spin,
    /// It looks while samples come fast, and sleeps otherwise.
    Adaptive,
    /// It sleeps until it is woken.
    Block,
}

/// How the two processes share the processor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Regime {
    /// A core each. An idle core may halt, and a sleeping receiver needs time to leave the halt.
    Plain,
    /// Both on one core: the time of the software alone.
    SameCore,
    /// A core each, and a process that runs only when nothing else does keeps it from halting.
    NoHalt,
}

/// Shows a value by its name on the command line, in the limits and in JSON.
macro_rules! shown_by_name {
    ($($choice:ty),*) => {$(
        impl core::fmt::Display for $choice {
            fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                let name = clap::ValueEnum::to_possible_value(self).expect("none is hidden");
                formatter.pad(name.get_name())
            }
        }
    )*};
}
pub(crate) use shown_by_name;

shown_by_name!(Mode, Regime);

impl Mode {
    /// The policy for a waiter of the typed ports.
    pub(crate) const fn policy(self) -> Policy {
        match self {
            Self::Spin => Policy::Spin,
            Self::Adaptive => Policy::ADAPTIVE,
            Self::Block => Policy::Block,
        }
    }
}

/// The options of a measurement: what to measure, and how often.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Runs, at least 1; every figure is the median over them.
    pub runs: usize,
    /// Few samples, for a first look or a check that everything works.
    pub quick: bool,
    /// The modes to measure.
    pub modes: Vec<Mode>,
    /// The regimes to measure.
    pub regimes: Vec<Regime>,
}

impl Default for Options {
    /// Five runs of everything.
    fn default() -> Self {
        Self {
            runs: 5,
            quick: false,
            modes: Mode::value_variants().to_vec(),
            regimes: Regime::value_variants().to_vec(),
        }
    }
}

/// A row's times divided by those of another row of the same run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// The label of the other row; see [`Row::label`].
    pub to: String,
    /// The median over the runs of this row's p50 divided by the other's.
    pub p50: f64,
    /// The same for the p99.
    pub p99: f64,
    /// Both ratios of each run.
    #[serde(default)]
    pub runs: Vec<[f64; 2]>,
}

/// The figures of one carrier in one mode and regime.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The carrier of the samples: `lager`, `iceoryx2`, `cacheline`, `futex`, `eventfd`, `pipe`,
    /// `uds`, `tcp`, `zenoh`, or `floor` for a chain of several.
    pub name: String,
    /// The variant of the carrier, if there are several: `header`, `bare`, `defaults`, …
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub variant: String,
    /// The measurement: `hop`, `hop@10kHz`, `path`, `publish-64`, `ring-64`, …
    pub what: String,
    /// How the receiver waited.
    pub mode: Mode,
    /// How the two processes shared the processor.
    pub regime: Regime,
    /// The number of samples of all runs, and each figure's median over the runs.
    #[serde(flatten)]
    pub times: Quantiles,
    /// The ratios to other rows, the most important first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ratios: Vec<Ratio>,
    /// Processor time of the measured services per real time, in percent of one core.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_percent: Option<f64>,
}

impl Row {
    /// A row without ratios.
    pub(crate) fn new(
        what: &str,
        label: &str,
        mode: Mode,
        regime: Regime,
        times: Quantiles,
    ) -> Self {
        let (name, variant) = label.split_once('/').unwrap_or((label, ""));
        Self {
            name: name.to_owned(),
            variant: variant.to_owned(),
            what: what.to_owned(),
            mode,
            regime,
            times,
            ratios: Vec::new(),
            cpu_percent: None,
        }
    }

    /// The name by which other rows of the same `what` and regime refer to this one: `name`, or
    /// `name/variant`.
    #[must_use]
    pub fn label(&self) -> String {
        if self.variant.is_empty() {
            self.name.clone()
        } else {
            format!("{}/{}", self.name, self.variant)
        }
    }
}

/// The result of a measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The machine in one line.
    pub machine: String,
    /// The figures.
    pub rows: Vec<Row>,
}

impl fmt::Display for Report {
    /// A table of at most 100 columns; times in ns below 10 µs, in ms above 10 ms.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        const HEAD: &str = "mode           n       p50       p99     p99.9  ratios p50 (p99)";
        writeln!(formatter, "{}", self.machine)?;
        let group = |row: &Row| format!("{}, {}", row.what, row.regime);
        for rows in self.rows.chunk_by(|one, next| group(one) == group(next)) {
            writeln!(formatter, "\n{:<22} {HEAD}", group(&rows[0]))?;
            rows.iter().try_for_each(|row| row.fmt_line(formatter))?;
        }
        Ok(())
    }
}

impl Row {
    fn fmt_line(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (label, mode, n) = (self.label(), self.mode, self.times.n);
        write!(formatter, "  {label:<20} {mode:<8} {n:>7}")?;
        for ns in [self.times.p50_ns, self.times.p99_ns, self.times.p999_ns] {
            write!(formatter, " {:>9}", time(ns))?;
        }
        let ratios = self.ratios.iter().map(|ratio| {
            let (p50, p99) = (times(ratio.p50), times(ratio.p99));
            format!("{p50} ({p99}) {}", ratio.to)
        });
        let processor = self
            .cpu_percent
            .map(|percent| format!("{percent:.0} % of a core"));
        // One remark in each line keeps the table within its width.
        for (index, remark) in ratios.chain(processor).enumerate() {
            if index > 0 {
                write!(formatter, "\n{:69}", "")?;
            }
            write!(formatter, "  {remark}")?;
        }
        writeln!(formatter)
    }
}

/// A ratio needs at most three digits.
fn times(ratio: f64) -> String {
    match ratio {
        large if large >= 100.0 => format!("{large:.0}"),
        medium if medium >= 10.0 => format!("{medium:.1}"),
        small => format!("{small:.2}"),
    }
}

fn time(ns: u64) -> String {
    match ns {
        ..10_000 => format!("{ns} ns"),
        10_000..10_000_000 => format!("{:.1} us", ns as f64 / 1e3),
        _ => format!("{:.1} ms", ns as f64 / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        let ratio = |to: &str, p50| Ratio {
            to: to.to_owned(),
            p50,
            p99: 2.0 * p50,
            runs: vec![[p50, 2.0 * p50]],
        };
        let times = Quantiles {
            n: 50_000,
            p50_ns: 9_999,
            p99_ns: 10_000,
            p999_ns: 1_234_567,
        };
        let mut row = Row::new("hop", "lager", Mode::Block, Regime::NoHalt, times);
        row.ratios = vec![ratio("iceoryx2/event", 0.8), ratio("futex", 1.1)];
        Report {
            machine: "a machine".to_owned(),
            rows: vec![row],
        }
    }

    #[test]
    fn json_has_the_agreed_fields() {
        let json = serde_json::to_value(report()).unwrap();
        let expected = serde_json::json!({
            "name": "lager", "what": "hop", "mode": "block", "regime": "no-halt", "n": 50_000,
            "p50_ns": 9_999, "p99_ns": 10_000, "p999_ns": 1_234_567,
            "ratios": [
                {"to": "iceoryx2/event", "p50": 0.8, "p99": 1.6, "runs": [[0.8, 1.6]]},
                {"to": "futex", "p50": 1.1, "p99": 2.2, "runs": [[1.1, 2.2]]},
            ],
        });
        assert_eq!(json["machine"], "a machine");
        assert_eq!(json["rows"][0], expected);
    }

    #[test]
    fn the_table_fits_a_terminal_and_shows_every_ratio() {
        let table = report().to_string();
        assert!(
            table.contains("9999 ns") && table.contains("1234.6 us"),
            "{table}"
        );
        assert!(table.contains("0.80 (1.60) iceoryx2/event"), "{table}");
        assert!(table.contains("1.10 (2.20) futex"), "{table}");
        assert!(table.lines().all(|line| line.chars().count() <= 100));
    }
}
