//! What a measurement yields: rows with quantiles and ratios, as a table and as JSON.
//!
//! Nothing is measured or decided here; a goal is held by the guard, not by a report.

use core::fmt;

use lager_ports::Policy;
use serde::{Deserialize, Serialize};

use crate::names::named;
use crate::stats::Quantiles;

named! {
    /// How the receiver waits.
    pub enum Mode {
        /// It looks without pause.
        Spin = "spin",
        /// It looks while samples come fast and sleeps when they do not.
        Adaptive = "adaptive",
        /// It sleeps until it is woken.
        Block = "block",
    }
}

named! {
    /// Under which circumstances the two processes run.
    pub enum Regime {
        /// A core each, and an idle core may halt: a sleeping receiver pays for leaving the halt.
        Plain = "plain",
        /// Both on one core: the cost of the software alone.
        SameCore = "same-core",
        /// A core each, kept from halting by a process that runs only when nothing else does.
        NoHalt = "no-halt",
    }
}

impl Mode {
    /// What a waiter of the typed ports is told.
    pub(crate) const fn policy(self) -> Policy {
        match self {
            Self::Spin => Policy::Spin,
            Self::Adaptive => Policy::ADAPTIVE,
            Self::Block => Policy::Block,
        }
    }
}

/// What to measure, and how thoroughly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Runs, at least 1; every figure is the median over them.
    pub runs: usize,
    /// Few samples, for a first look or a check that all works.
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
            modes: Mode::ALL.to_vec(),
            regimes: Regime::ALL.to_vec(),
        }
    }
}

/// One figure beside another of the same run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// The label of the row it is compared with; see [`Row::label`].
    pub to: String,
    /// The median over the runs of this row's p50 divided by the other's.
    pub p50: f64,
    /// The same of the p99.
    pub p99: f64,
    /// Both of each run, in turn.
    #[serde(default)]
    pub runs: Vec<[f64; 2]>,
}

/// What one contender showed in one mode and regime. Times are in ns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// What carried the samples: `lager`, `iceoryx2`, `cacheline`, `futex`, `eventfd`, `pipe`,
    /// `uds`, `tcp`, `zenoh`, or `floor` for a chain of several.
    pub name: String,
    /// Which kind of it, if there are several: `header`, `bare`, `defaults`, …
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub variant: String,
    /// What was timed: `hop`, `hop@10kHz`, `path`, `publish-64`, `ring-64`, …
    pub what: String,
    /// How the receiver waited.
    pub mode: Mode,
    /// Under which circumstances.
    pub regime: Regime,
    /// Samples of all runs.
    pub n: u64,
    /// The median over the runs of each run's median.
    pub p50_ns: u64,
    /// The median over the runs of the time that 99 % of a run's samples kept.
    pub p99_ns: u64,
    /// The median over the runs of the time that 99.9 % of a run's samples kept.
    pub p999_ns: u64,
    /// What [`Row::ratio_p50`] and [`Row::ratio_p99`] compare with; empty if nothing does.
    pub ratio_to: String,
    /// The first of [`Row::ratios`]; 1 if there is none.
    pub ratio_p50: f64,
    /// The first of [`Row::ratios`]; 1 if there is none.
    pub ratio_p99: f64,
    /// Every comparison, the first one included.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ratios: Vec<Ratio>,
    /// Processor time of the measured services per real time, in percent of one core.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_percent: Option<f64>,
}

impl Row {
    /// A row without a name and without ratios; of no samples all its figures are 0.
    pub(crate) fn of(what: &str, mode: Mode, regime: Regime, times: Option<Quantiles>) -> Self {
        let told = |figure: fn(&Quantiles) -> u64| times.as_ref().map_or(0, figure);
        Self {
            name: String::new(),
            variant: String::new(),
            what: what.to_owned(),
            mode,
            regime,
            n: told(|times| times.n),
            p50_ns: told(|times| times.p50_ns),
            p99_ns: told(|times| times.p99_ns),
            p999_ns: told(|times| times.p999_ns),
            ratio_to: String::new(),
            ratio_p50: 1.0,
            ratio_p99: 1.0,
            ratios: Vec::new(),
            cpu_percent: None,
        }
    }

    /// The name by which other rows of the same `what` and regime compare themselves with
    /// this one: `name`, or `name/variant`.
    #[must_use]
    pub fn label(&self) -> String {
        if self.variant.is_empty() {
            self.name.clone()
        } else {
            format!("{}/{}", self.name, self.variant)
        }
    }
}

/// What a measurement yields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The machine in one line.
    pub machine: String,
    /// The figures.
    pub rows: Vec<Row>,
}

impl Report {
    /// The report as one line of JSON.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("names and numbers are always JSON")
    }
}

impl fmt::Display for Report {
    /// A table of at most 100 columns; times in ns below 10 µs, in ms above 10 ms.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{}", self.machine)?;
        let mut last = None;
        for row in &self.rows {
            let group = (row.what.as_str(), row.regime);
            if last != Some(group) {
                last = Some(group);
                writeln!(
                    formatter,
                    "\n{:<22} {:<8} {:>7} {:>9} {:>9} {:>9}  ratios p50 (p99)",
                    format!("{}, {}", row.what, row.regime),
                    "mode",
                    "n",
                    "p50",
                    "p99",
                    "p99.9"
                )?;
            }
            row.fmt_line(formatter)?;
        }
        Ok(())
    }
}

impl Row {
    fn fmt_line(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "  {:<20} {:<8} {:>7} {:>9} {:>9} {:>9}",
            self.label(),
            self.mode,
            self.n,
            time(self.p50_ns),
            time(self.p99_ns),
            time(self.p999_ns)
        )?;
        let ratios = self.ratios.iter().map(|ratio| {
            let (p50, p99) = (times(ratio.p50), times(ratio.p99));
            format!("{p50} ({p99}) {}", ratio.to)
        });
        let processor = self
            .cpu_percent
            .map(|percent| format!("{percent:.0} % of a core"));
        // One remark to a line keeps the table within its width.
        for (index, remark) in ratios.chain(processor).enumerate() {
            if index > 0 {
                write!(formatter, "\n{:69}", "")?;
            }
            write!(formatter, "  {remark}")?;
        }
        writeln!(formatter)
    }
}

/// Three digits or more of a ratio say nothing more behind the point.
fn times(ratio: f64) -> String {
    match ratio {
        large if large >= 100.0 => format!("{large:.0}"),
        medium if medium >= 10.0 => format!("{medium:.1}"),
        small => format!("{small:.2}"),
    }
}

fn time(ns: u64) -> String {
    if ns < 10_000 {
        format!("{ns} ns")
    } else if ns < 10_000_000 {
        format!("{:.1} us", ns as f64 / 1e3)
    } else {
        format!("{:.1} ms", ns as f64 / 1e6)
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
        Report {
            machine: "a machine".to_owned(),
            rows: vec![Row {
                name: "lager".to_owned(),
                variant: String::new(),
                what: "hop".to_owned(),
                mode: Mode::Block,
                regime: Regime::NoHalt,
                n: 50_000,
                p50_ns: 9_999,
                p99_ns: 10_000,
                p999_ns: 1_234_567,
                ratio_to: "iceoryx2/event".to_owned(),
                ratio_p50: 0.8,
                ratio_p99: 1.6,
                ratios: vec![ratio("iceoryx2/event", 0.8), ratio("futex", 1.1)],
                cpu_percent: None,
            }],
        }
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for mode in Mode::ALL {
            assert_eq!(mode.to_string().parse(), Ok(mode));
            assert_eq!(serde_json::to_value(mode).unwrap(), mode.as_str());
        }
        for regime in Regime::ALL {
            assert_eq!(regime.to_string().parse(), Ok(regime));
            assert_eq!(serde_json::to_value(regime).unwrap(), regime.as_str());
        }
        let error = "fast".parse::<Mode>().unwrap_err().to_string();
        assert!(error.contains("spin, adaptive or block"), "{error}");
    }

    #[test]
    fn json_has_the_agreed_fields() {
        let json: serde_json::Value = serde_json::from_str(&report().to_json()).unwrap();
        let expected = serde_json::json!({
            "name": "lager", "what": "hop", "mode": "block", "regime": "no-halt", "n": 50_000,
            "p50_ns": 9_999, "p99_ns": 10_000, "p999_ns": 1_234_567,
            "ratio_to": "iceoryx2/event", "ratio_p50": 0.8, "ratio_p99": 1.6,
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
