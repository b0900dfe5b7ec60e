//! The result of a measurement (rows with quantiles and ratios, as a table and as JSON), and the
//! options of a measurement.
//!
//! Nothing here measures or judges. The guard checks limits; a report does not.

use core::fmt;
use core::str::FromStr;
use core::time::Duration;

use clap::ValueEnum;
use lager_sample::Topic as _;
use lager_topics::SensorLine;
use lager_wake::Policy;
use serde::{Deserialize, Serialize};

use crate::rounds::{Rate, Run, Spread};
use crate::sample::SIZE;
use crate::stats::Quantiles;
use lager_machine::{Conditions, Cores};

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
    /// It looks every millisecond, as who only watches (`topic`).
    Poll,
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

/// What else the machine does meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Load {
    /// A process for each core that computes.
    Cpu,
    /// A process for each core that copies memory, and one that takes and gives it back.
    Memory,
    /// Two processes that write files and wait until the disk has them.
    Io,
    /// Timer interrupts: 20 000 a second.
    Irq,
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

shown_by_name!(Mode, Regime, Load);

impl Mode {
    /// The policy for a waiter of the typed ports.
    pub(crate) const fn policy(self) -> Policy {
        match self {
            Self::Spin => Policy::Spin,
            Self::Adaptive => Policy::ADAPTIVE,
            Self::Block | Self::Poll => Policy::Block,
        }
    }
}

/// How often samples are due.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// As fast as they come back.
    Full,
    /// So many times a second.
    Hz(f64),
}

impl Pace {
    /// The fastest and the slowest rate, in Hz.
    const RANGE: core::ops::RangeInclusive<f64> = 0.1..=1e6;

    /// The time from one sample to the next; zero is as fast as they come back.
    pub(crate) fn gap(self) -> Duration {
        match self {
            Self::Full => Duration::ZERO,
            Self::Hz(hz) => Duration::from_secs_f64(1.0 / hz),
        }
    }
}

impl fmt::Display for Pace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Full => write!(formatter, "full-rate"),
            Self::Hz(hz) if hz >= 1e3 => write!(formatter, "{}kHz", hz / 1e3),
            Self::Hz(hz) => write!(formatter, "{hz}Hz"),
        }
    }
}

impl FromStr for Pace {
    type Err = String;

    /// `full`, or a rate in Hz.
    fn from_str(text: &str) -> Result<Self, String> {
        let hz = text.parse().ok().filter(|hz| Self::RANGE.contains(hz));
        match (text, hz) {
            ("full", _) => Ok(Self::Full),
            (_, Some(hz)) => Ok(Self::Hz(hz)),
            _ => Err("give `full`, or samples a second from 0.1 to 1000000".to_owned()),
        }
    }
}

/// The options of a measurement: what to measure, and how often.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Runs, at least 1; the times of all runs add up, and a ratio is the median over them.
    pub runs: usize,
    /// Few samples, for a first look or a check that everything works.
    pub quick: bool,
    /// Samples of each round, if not the scenario's own number.
    pub samples: Option<usize>,
    /// The cores of the two processes, if not the first that this process may use.
    pub cores: Option<Cores>,
    /// How often a hop is due, if not as its groups have it.
    pub pace: Option<Pace>,
    /// The size of a hop's sample in bytes, if not 64: one of [`crate::SIZES`].
    pub size: Option<usize>,
    /// What else the machine does meanwhile.
    pub load: Option<Load>,
    /// A row beside so many observers, at most [`Options::OBSERVERS`].
    pub observers: Option<usize>,
    /// The modes to measure.
    pub modes: Vec<Mode>,
    /// The regimes to measure.
    pub regimes: Vec<Regime>,
}

impl Options {
    /// The places for observers of a topic of a measurement.
    pub const OBSERVERS: usize = SensorLine::QOS.observers;

    /// The size of a hop's sample in words, if its rows are those of any size.
    pub(crate) fn words(&self) -> Option<usize> {
        let asked = self.size.is_some() || self.observers.is_some();
        asked.then(|| self.size.unwrap_or(SIZE) / 8)
    }
}

impl Default for Options {
    /// Five runs of everything.
    fn default() -> Self {
        Self {
            runs: 5,
            quick: false,
            samples: None,
            cores: None,
            pace: None,
            size: None,
            load: None,
            observers: None,
            modes: Mode::value_variants().to_vec(),
            regimes: Regime::value_variants().to_vec(),
        }
    }
}

/// A row's service times divided by those of another row of the same run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// The label of the other row; see [`Row::label`].
    pub to: String,
    /// The median over the runs of this row's p50 divided by the other's.
    pub p50: f64,
    /// The same for the p99; `None` if no run has enough samples for it.
    pub p99: Option<f64>,
    /// Both ratios of each run.
    #[serde(default)]
    pub runs: Vec<(f64, Option<f64>)>,
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
    /// The times of all runs together: from when a sample was due where there is a plan, otherwise
    /// from when it was sent.
    #[serde(flatten)]
    pub times: Quantiles,
    /// The times from when a sample was sent, where there is a plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub service: Option<Quantiles>,
    /// How far the runs lie apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spread: Option<Spread>,
    /// The rate, where there is a plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<Rate>,
    /// Samples that came before they were sent, by the clock. They are in no percentile.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub disordered: u64,
    /// Samples that were overwritten before their reader had them.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub lost: u64,
    /// The ratios to other rows, the most important first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ratios: Vec<Ratio>,
    /// Processor time of the measured services per real time, in percent of one core.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_percent: Option<f64>,
    /// The runs, whose histograms [`crate::saved`] writes; a report for people has none.
    #[serde(skip)]
    pub runs: Vec<Run>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes it so")]
const fn is_zero(number: &u64) -> bool {
    *number == 0
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
            service: None,
            spread: None,
            rate: None,
            disordered: 0,
            lost: 0,
            ratios: Vec::new(),
            cpu_percent: None,
            runs: Vec::new(),
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
    /// What it was set to, and what else it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conditions: Option<Conditions>,
    /// The figures.
    pub rows: Vec<Row>,
}

impl fmt::Display for Report {
    /// A table of at most 100 columns.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        const HEAD: &str =
            "mode           n     p50     p90     p99   p99.9  p99.99 p99.999     max";
        writeln!(formatter, "{}", self.machine)?;
        if let Some(conditions) = &self.conditions {
            writeln!(formatter, "{conditions}")?;
        }
        let group = |row: &Row| format!("{}, {}", row.what, row.regime);
        for rows in self.rows.chunk_by(|one, next| group(one) == group(next)) {
            writeln!(formatter, "\n{:<24} {HEAD}", group(&rows[0]))?;
            rows.iter().try_for_each(|row| row.fmt_lines(formatter))?;
        }
        let few = self.rows.iter().any(|row| row.times.p99999_ns.is_none());
        if few {
            writeln!(formatter, "\n-  fewer than ten samples lie beyond it")?;
        }
        Ok(())
    }
}

impl Row {
    fn fmt_lines(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (label, mode) = (self.label(), self.mode.to_string());
        line(formatter, &format!("  {label}"), &mode, &self.times)?;
        if let Some(service) = self
            .service
            .filter(|service| shown(service) != shown(&self.times))
        {
            line(formatter, "    from its sending", "", &service)?;
        }
        let mut say = |remark: String| writeln!(formatter, "    {remark}");
        if let Some(spread) = self.spread {
            let between = |[low, high]: [u64; 2]| format!("{} to {}", time(low), time(high));
            let p99 = spread.p99_ns.map(between).map(|it| format!(", p99 {it}"));
            let p50 = between(spread.p50_ns);
            say(format!("runs: p50 {p50}{}", p99.unwrap_or_default()))?;
        }
        for ratio in &self.ratios {
            let p99 = ratio.p99.map(|p99| format!(" (p99 {})", times(p99)));
            let (p50, p99) = (times(ratio.p50), p99.unwrap_or_default());
            say(format!("{p50}{p99} times {}", ratio.to))?;
        }
        if let Some(percent) = self.cpu_percent {
            say(format!("{percent:.0} % of a core"))?;
        }
        if let Some(rate) = self.rate.filter(Rate::overload) {
            let (asked, reached) = (rate.asked_hz, rate.reached_hz);
            say(format!(
                "overload: {reached:.0} of {asked:.0} samples a second were sent, so these times \
                 are those of a backlog"
            ))?;
        }
        if self.lost > 0 {
            let many = self.lost;
            say(format!(
                "lost: {many} samples were overwritten before they were received"
            ))?;
        }
        if self.disordered > 0 {
            let many = self.disordered;
            say(format!(
                "clock disorder: {many} samples came before they were sent"
            ))?;
        }
        Ok(())
    }
}

/// The cells of a line.
fn shown(quantiles: &Quantiles) -> [String; 7] {
    let cell = |ns: Option<u64>| ns.map_or_else(|| "-".to_owned(), time);
    [
        cell(quantiles.p50_ns),
        cell(quantiles.p90_ns),
        cell(quantiles.p99_ns),
        cell(quantiles.p999_ns),
        cell(quantiles.p9999_ns),
        cell(quantiles.p99999_ns),
        cell((quantiles.n > 0).then_some(quantiles.max_ns)),
    ]
}

fn line(
    formatter: &mut fmt::Formatter<'_>,
    label: &str,
    mode: &str,
    quantiles: &Quantiles,
) -> fmt::Result {
    let cells = shown(quantiles).map(|cell| format!(" {cell:>7}")).concat();
    writeln!(formatter, "{label:<24} {mode:<8}{:>8}{cells}", quantiles.n)
}

/// A ratio needs at most three digits.
fn times(ratio: f64) -> String {
    match ratio {
        large if large >= 100.0 => format!("{large:.0}"),
        medium if medium >= 10.0 => format!("{medium:.1}"),
        small => format!("{small:.2}"),
    }
}

/// A time in at most seven characters.
pub(crate) fn time(ns: u64) -> String {
    let (value, unit) = match ns {
        ..1_000 => return format!("{ns} ns"),
        1_000..1_000_000 => (ns as f64 / 1e3, "us"),
        1_000_000..1_000_000_000 => (ns as f64 / 1e6, "ms"),
        _ => (ns as f64 / 1e9, "s"),
    };
    match value {
        small if small < 9.995 => format!("{small:.2} {unit}"),
        medium if medium < 99.95 => format!("{medium:.1} {unit}"),
        large => format!("{large:.0} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        let ratio = |to: &str, p50, p99| Ratio {
            to: to.to_owned(),
            p50,
            p99,
            runs: vec![(p50, p99)],
        };
        let times = Quantiles {
            n: 50_000,
            p50_ns: Some(9_999),
            p90_ns: Some(10_000),
            p99_ns: Some(10_100),
            p999_ns: Some(1_234_567),
            max_ns: 1_234_567_890,
            ..Quantiles::default()
        };
        let mut row = Row::new("hop", "lager", Mode::Block, Regime::NoHalt, times);
        row.ratios = vec![
            ratio("iceoryx2/event", 0.8, Some(1.6)),
            ratio("futex", 1.1, None),
        ];
        Report {
            machine: "a machine".to_owned(),
            conditions: None,
            rows: vec![row],
        }
    }

    #[test]
    fn json_has_the_agreed_fields() {
        let json = serde_json::to_value(report()).unwrap();
        let expected = serde_json::json!({
            "name": "lager", "what": "hop", "mode": "block", "regime": "no-halt", "n": 50_000,
            "p50_ns": 9_999, "p90_ns": 10_000, "p99_ns": 10_100, "p999_ns": 1_234_567,
            "p9999_ns": null, "p99999_ns": null, "max_ns": 1_234_567_890,
            "ratios": [
                {"to": "iceoryx2/event", "p50": 0.8, "p99": 1.6, "runs": [[0.8, 1.6]]},
                {"to": "futex", "p50": 1.1, "p99": null, "runs": [[1.1, null]]},
            ],
        });
        assert_eq!(json["machine"], "a machine");
        assert_eq!(json["rows"][0], expected);
    }

    #[test]
    fn the_table_fits_a_terminal_and_shows_every_ratio() {
        let mut report = report();
        report.rows[0].service = Some(Quantiles {
            max_ns: 5,
            ..report.rows[0].times
        });
        report.rows[0].rate = Some(Rate {
            asked_hz: 10_000.0,
            reached_hz: 5_000.0,
        });
        report.rows[0].disordered = 1;
        report.rows[0].lost = 2;
        let table = report.to_string();
        for cell in [
            " 10.0 us 10.0 us 10.1 us 1.23 ms       -       -  1.23 s",
            "0.80 (p99 1.60) times iceoryx2/event",
            "1.10 times futex",
            "from its sending",
            "overload: 5000 of 10000",
            "clock disorder: 1",
            "lost: 2",
            "-  fewer than ten samples",
        ] {
            assert!(table.contains(cell), "{cell}: {table}");
        }
        assert!(table.lines().all(|line| line.chars().count() <= 100));
    }

    #[test]
    fn a_pace_is_read_as_it_is_named() {
        for (text, name, gap_us) in [
            ("full", "full-rate", 0),
            ("10000", "10kHz", 100),
            ("50", "50Hz", 20_000),
            ("2.5e3", "2.5kHz", 400),
        ] {
            let pace: Pace = text.parse().unwrap();
            assert_eq!(
                (pace.to_string(), pace.gap().as_micros()),
                (name.to_owned(), gap_us)
            );
        }
        for wrong in ["", "0", "-1", "1e9", "nan", "fast"] {
            assert!(wrong.parse::<Pace>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_time_takes_at_most_seven_characters() {
        for ns in (0..15).flat_map(|power| [10_u64.pow(power), 10_u64.pow(power) * 9_994 / 1_000]) {
            let wide = time(ns).chars().count();
            assert!(wide <= 7 || ns >= 10_u64.pow(13), "{}", time(ns));
        }
        assert_eq!(time(999), "999 ns");
        assert_eq!(time(99_960), "100 us");
    }
}
