//! What the boards' images do, in cycles: the emulator's `--trace`, run as a process and read.
//!
//! Apart from the other scenarios, because nothing is timed here: cycles are exact and the same on
//! every machine, except for the real-time factor. The guard holds each figure to 5 %. The emulator
//! runs as a process of its own, because simavr's licence stays in `firmware/emulator`.

use core::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};

use crate::error::BenchError;
use crate::machine;
use crate::report::{Mode, Regime, Report, Row};
use crate::stats::Quantiles;

/// The baud rates of the lines to the Pi that there are images for: the default and the original's.
pub const BAUDS: [u32; 2] = [500_000, 9_600];

/// What runs the chips, and the images in them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Programs {
    /// The executable `lager-emulator`.
    pub emulator: PathBuf,
    /// The sensor board's image.
    pub sensor_elf: PathBuf,
    /// The steering board's image.
    pub steering_elf: PathBuf,
}

impl Programs {
    /// Those that `.ci/firmware` leaves in a source tree for a baud rate.
    #[must_use]
    pub fn in_tree(root: &Path, baud: u32) -> Self {
        let images = root.join("firmware/avr/target/images");
        let images = if baud == 9_600 {
            images.join("9600")
        } else {
            images
        };
        Self {
            emulator: root.join("firmware/emulator/target/release/lager-emulator"),
            sensor_elf: images.join("sensor.elf"),
            steering_elf: images.join("steering.elf"),
        }
    }
}

/// Times in cycles over all phases tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// The shortest.
    pub best: u64,
    /// The middle one.
    pub median: u64,
    /// What 99 of 100 keep.
    pub p99: u64,
    /// The longest.
    pub worst: u64,
}

/// A board's interrupts while the robot drives, in cycles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interrupts {
    /// How long they were watched.
    pub cycles: u64,
    /// Of these, in interrupts.
    pub in_interrupts: u64,
    /// The longest time from an interrupt's flag to its first instruction.
    pub worst_latency: u64,
}

/// One board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Board {
    /// Bytes of flash the image fills.
    pub flash_bytes: u64,
    /// Share of time the core is awake, 0 to 1.
    pub awake_share: f64,
    /// Its interrupts.
    pub interrupts: Interrupts,
}

/// What the emulator says of the images for one baud rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// The chips' clock.
    pub frequency_hz: u64,
    /// The lines' baud rate.
    pub baud: u32,
    /// The version of rustc that built the images.
    pub rustc: String,
    /// Phases of the boards' loops tried.
    pub phases: u64,
    /// From the tape's jump to another duty.
    pub tape_to_duty: Span,
    /// From the tape's jump to the first start bit of the packet that tells.
    pub tape_to_uart: Span,
    /// The sensor board.
    pub sensor: Board,
    /// The steering board.
    pub steering: Board,
    /// Chip time in processor time while the robot drives.
    pub real_time_factor: f64,
}

/// One exact figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// `tape-to-duty@500kBd/worst`, ...
    pub name: String,
    /// How much.
    pub value: f64,
    /// Of what: `cycles`, `cycles/s`, `bytes`, `%`, `x`.
    pub unit: String,
}

impl Trace {
    /// Everything but the rows, the counted ones exactly.
    #[must_use]
    pub fn figures(&self) -> Vec<Figure> {
        let at = baud_name(self.baud);
        let mut figures = Vec::new();
        let mut add = |name: String, value: f64, unit: &str| {
            figures.push(Figure {
                name,
                value,
                unit: unit.to_owned(),
            });
        };
        for (what, span) in [
            ("tape-to-duty", &self.tape_to_duty),
            ("tape-to-uart", &self.tape_to_uart),
        ] {
            let what = format!("{what}@{at}");
            add(format!("{what}/best"), span.best as f64, "cycles");
            add(format!("{what}/median"), span.median as f64, "cycles");
            add(format!("{what}/worst"), span.worst as f64, "cycles");
        }
        for (name, board) in [("sensor", &self.sensor), ("steering", &self.steering)] {
            let Interrupts {
                cycles,
                in_interrupts,
                worst_latency,
            } = board.interrupts;
            let share = in_interrupts as f64 / cycles as f64;
            let in_a_second = (share * self.frequency_hz as f64).round();
            let of = |what: &str| format!("{what}@{at}/{name}");
            add(of("interrupt-latency"), worst_latency as f64, "cycles");
            add(of("interrupts"), in_a_second, "cycles/s");
            add(of("interrupt-share"), 100.0 * share, "%");
            add(of("awake"), 100.0 * board.awake_share, "%");
            add(of("flash"), board.flash_bytes as f64, "bytes");
        }
        add(format!("real-time@{at}"), self.real_time_factor, "x");
        figures
    }

    fn rows(&self) -> [Row; 2] {
        let row = |what: &str, span: &Span| {
            let times = Quantiles {
                n: self.phases,
                p50_ns: self.nanoseconds(span.median),
                p99_ns: self.nanoseconds(span.p99),
                p999_ns: self.nanoseconds(span.worst),
            };
            let what = format!("{what}@{}", baud_name(self.baud));
            // The boards sleep until an interrupt wakes them; nobody's core matters.
            Row {
                name: "chip".to_owned(),
                ..Row::of(&what, Mode::Block, Regime::Plain, Some(times))
            }
        };
        [
            row("tape-to-duty", &self.tape_to_duty),
            row("tape-to-uart", &self.tape_to_uart),
        ]
    }

    fn nanoseconds(&self, cycles: u64) -> u64 {
        cycles * 1_000_000_000 / self.frequency_hz
    }
}

fn baud_name(baud: u32) -> String {
    if baud.is_multiple_of(1_000) {
        format!("{}kBd", baud / 1_000)
    } else {
        format!("{baud}Bd")
    }
}

/// The rows of the other scenarios' reports, in ns, and the exact figures. p99.9 of a row is its
/// longest time: there are fewer than a thousand phases.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChipReport {
    /// As the other scenarios have it.
    #[serde(flatten)]
    pub report: Report,
    /// What was counted, and the real-time factor.
    pub figures: Vec<Figure>,
}

impl ChipReport {
    /// The report on traces.
    #[must_use]
    pub fn of(traces: &[Trace]) -> Self {
        Self {
            report: Report {
                machine: machine::describe(),
                rows: traces.iter().flat_map(Trace::rows).collect(),
            },
            figures: traces.iter().flat_map(Trace::figures).collect(),
        }
    }

    /// The report as one line of JSON.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("names and numbers are always JSON")
    }
}

impl fmt::Display for ChipReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{}", self.report)?;
        for figure in &self.figures {
            let digits = if figure.value.fract() == 0.0 { 0 } else { 2 };
            writeln!(
                formatter,
                "  {:<36} {:>9.digits$} {}",
                figure.name, figure.value, figure.unit
            )?;
        }
        Ok(())
    }
}

/// Measures each baud rate's images, beside each other: chip time does not mind.
///
/// # Errors
/// A program is missing, or the emulator says why there are no figures.
pub fn measure(programs: [(u32, Programs); BAUDS.len()]) -> Result<Vec<Trace>, BenchError> {
    programs
        .map(|(baud, programs)| std::thread::spawn(move || trace(&programs, baud)))
        .into_iter()
        .map(|trace| trace.join().expect("nothing here panics"))
        .collect()
}

fn trace(programs: &Programs, baud: u32) -> Result<Trace, BenchError> {
    for file in [
        &programs.emulator,
        &programs.sensor_elf,
        &programs.steering_elf,
    ] {
        if !file.exists() {
            return Err(BenchError::NotBuilt(file.clone()));
        }
    }
    let failed = |detail: String| BenchError::Emulator {
        emulator: programs.emulator.clone(),
        detail,
    };
    let output = Command::new(&programs.emulator)
        .arg("--trace")
        .arg("--sensor-elf")
        .arg(&programs.sensor_elf)
        .arg("--steering-elf")
        .arg(&programs.steering_elf)
        .args(["--baud", &baud.to_string()])
        .output()
        .map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(failed(said.trim().to_owned()));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| failed(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn traced() -> Trace {
        let board = r#"{"flash_bytes":11294,"awake_share":0.9,"ignored":1,
            "interrupts":{"cycles":32000000,"in_interrupts":10000000,"worst_latency":112}}"#;
        let span = r#"{"best":6000,"median":10000,"p99":14000,"worst":16000}"#;
        let text = format!(
            r#"{{"frequency_hz":16000000,"baud":500000,"rustc":"1.96.0","phases":300,
            "tape_to_duty":{span},"tape_to_uart":{span},"sensor":{board},"steering":{board},
            "real_time_factor":2.125}}"#
        );
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn cycles_become_nanoseconds_and_stay_figures() {
        let report = ChipReport::of(&[traced()]);
        let row = &report.report.rows[0];
        assert_eq!(row.what, "tape-to-duty@500kBd");
        assert_eq!(
            (row.n, row.p50_ns, row.p99_ns, row.p999_ns),
            (300, 625_000, 875_000, 1_000_000)
        );
        let value = |name: &str| {
            let found = report.figures.iter().find(|figure| figure.name == name);
            found.map(|figure| figure.value)
        };
        assert_eq!(value("tape-to-uart@500kBd/worst"), Some(16_000.0));
        assert_eq!(value("interrupts@500kBd/sensor"), Some(5_000_000.0));
        assert_eq!(value("interrupt-share@500kBd/steering"), Some(31.25));
        assert_eq!(value("real-time@500kBd"), Some(2.125));
    }

    #[test]
    fn table_and_json_have_rows_and_figures() {
        let report = ChipReport::of(&[traced()]);
        let table = report.to_string();
        for part in ["1000.0 us", "16000 cycles", "31.25 %", "2.12 x"] {
            assert!(table.contains(part), "{table}");
        }
        let read: ChipReport = serde_json::from_str(&report.to_json()).unwrap();
        assert_eq!(read, report);
    }

    #[test]
    fn what_is_not_built_is_said_with_the_way_to_build_it() {
        let programs = BAUDS.map(|baud| (baud, Programs::in_tree(Path::new("/nowhere"), baud)));
        let said = measure(programs).unwrap_err().to_string();
        assert!(said.contains("/nowhere/firmware/emulator"), "{said}");
        assert!(said.contains(".ci/firmware"), "{said}");
    }
}
