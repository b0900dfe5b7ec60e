//! Counts the cycles of the boards' images: runs the emulator with `--trace` as a process and reads
//! its figures.
//!
//! It is no scenario like the others, because it times nothing: cycles are exact and the same on
//! every machine, except for the real-time factor. The guard allows each figure 5 %. The emulator
//! is another process, so that simavr's licence applies to `firmware/emulator` only.

use core::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::BenchError;
use lager_machine::Machine;

/// The baud rates for which there are images: the default one and the original boards'.
pub const BAUDS: [u32; 2] = [500_000, 9_600];

/// The emulator, and the images for its chips.
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
    /// The programs that `.ci/firmware` leaves in a source tree for a baud rate.
    #[must_use]
    pub fn in_tree(root: &Path, baud: u32) -> Self {
        let folder = if baud == 9_600 { "9600" } else { "" };
        let images = root.join("firmware/avr/target/images").join(folder);
        Self {
            emulator: root.join("firmware/emulator/target/release/lager-emulator"),
            sensor_elf: images.join("sensor.elf"),
            steering_elf: images.join("steering.elf"),
        }
    }
}

/// One exact figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Its name: `tape-to-duty@500kBd/worst`, ...
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit: `cycles`, `cycles/s`, `bytes`, `%`, `x`.
    pub unit: String,
    /// The same time in ms of the chips' clock, for a figure in cycles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ms: Option<f64>,
}

/// The emulator's output for the images of one baud rate.
struct Trace(Value);

impl Trace {
    fn number(&self, place: &str) -> Result<f64, String> {
        let number = self.0.pointer(place).and_then(Value::as_f64);
        number.ok_or_else(|| format!("it does not say {place}"))
    }

    fn figures(&self) -> Result<Vec<Figure>, String> {
        let (baud, hertz) = (self.number("/baud")? as u32, self.number("/frequency_hz")?);
        let at = match baud % 1_000 {
            0 => format!("{}kBd", baud / 1_000),
            _ => format!("{baud}Bd"),
        };
        let figure = |what: &str, of: &str, value: f64, unit: &str| Figure {
            name: format!("{what}@{at}{of}"),
            value,
            unit: unit.to_owned(),
            ms: (unit == "cycles").then_some(value / hertz * 1e3),
        };
        let mut figures = Vec::new();
        // Over all phases tried: from the tape's jump to the first other duty, and to the first
        // start bit of the line packet.
        for (what, place) in [
            ("tape-to-duty", "/tape_to_duty"),
            ("tape-to-uart", "/tape_to_uart"),
        ] {
            for of in ["/best", "/median", "/worst"] {
                let cycles = self.number(&format!("{place}{of}"))?;
                figures.push(figure(what, of, cycles, "cycles"));
            }
        }
        // These are counted while the robot drives.
        for board in ["/sensor", "/steering"] {
            let number = |place: &str| self.number(&format!("{board}{place}"));
            // The longest time from an interrupt's flag to its first instruction.
            let latency = number("/interrupts/worst_latency")?;
            let share = number("/interrupts/in_interrupts")? / number("/interrupts/cycles")?;
            let (awake, flash) = (number("/awake_share")?, number("/flash_bytes")?);
            figures.extend([
                figure("interrupt-latency", board, latency, "cycles"),
                figure("interrupts", board, (share * hertz).round(), "cycles/s"),
                figure("interrupt-share", board, 100.0 * share, "%"),
                figure("awake", board, 100.0 * awake, "%"),
                figure("flash", board, flash, "bytes"),
            ]);
        }
        let real_time = self.number("/real_time_factor")?;
        figures.push(figure("real-time", "", real_time, "x"));
        Ok(figures)
    }
}

/// The report of `lager bench chip`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChipReport {
    /// The machine in one line.
    pub machine: String,
    /// The exact figures, and the real-time factor.
    pub figures: Vec<Figure>,
    /// The version of rustc that built the images.
    pub rustc: String,
}

impl fmt::Display for ChipReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{}\n", self.machine)?;
        for figure in &self.figures {
            let (name, value, unit) = (&figure.name, figure.value, &figure.unit);
            let digits = if value.fract() == 0.0 { 0 } else { 2 };
            let ms = figure.ms.map(|ms| format!(", {ms:.2} ms"));
            let ms = ms.unwrap_or_default();
            writeln!(formatter, "  {name:<36} {value:>9.digits$} {unit}{ms}")?;
        }
        Ok(())
    }
}

/// Measures the images of all baud rates at the same time, which does not change chip time.
///
/// # Errors
/// A program is missing, or the emulator gave no figures and says why.
pub fn measure(programs: [(u32, Programs); BAUDS.len()]) -> Result<ChipReport, BenchError> {
    let emulator = programs[0].1.emulator.clone();
    let failed = |why| BenchError::Emulator(emulator.clone(), why);
    let traced = programs
        .map(|(baud, programs)| std::thread::spawn(move || trace(&programs, baud)))
        .map(|trace| trace.join().expect("nothing here panics"));
    let mut report = ChipReport {
        machine: Machine::here().to_string(),
        figures: Vec::new(),
        rustc: String::new(),
    };
    for trace in traced {
        let trace = trace?;
        report.figures.extend(trace.figures().map_err(failed)?);
        report.rustc = trace.0["rustc"].as_str().unwrap_or_default().to_owned();
    }
    Ok(report)
}

fn trace(programs: &Programs, baud: u32) -> Result<Trace, BenchError> {
    let emulator = &programs.emulator;
    let files = [emulator, &programs.sensor_elf, &programs.steering_elf];
    if let Some(missing) = files.iter().find(|file| !file.exists()) {
        return Err(BenchError::NotBuilt(missing.to_path_buf()));
    }
    let failed = |why| BenchError::Emulator(emulator.clone(), why);
    let output = Command::new(emulator)
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
    let trace = serde_json::from_slice(&output.stdout);
    Ok(Trace(trace.map_err(|error| failed(error.to_string()))?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_emulator_says_becomes_figures_and_a_table() {
        let board = r#"{"flash_bytes":11294,"awake_share":0.9,
            "interrupts":{"cycles":32000000,"in_interrupts":10000000,"worst_latency":112}}"#;
        let span = r#"{"best":6000,"median":10000,"p99":14000,"worst":16000}"#;
        let text = format!(
            r#"{{"frequency_hz":16000000,"baud":500000,"tape_to_duty":{span},"tape_to_uart":{span},
            "sensor":{board},"steering":{board},"real_time_factor":2.125}}"#
        );
        let trace = Trace(serde_json::from_str(&text).unwrap());
        let report = ChipReport {
            machine: "a machine".to_owned(),
            figures: trace.figures().unwrap(),
            rustc: String::new(),
        };
        let value = |name: &str| {
            let found = report.figures.iter().find(|figure| figure.name == name);
            found.map(|figure| figure.value)
        };
        assert_eq!(value("tape-to-uart@500kBd/worst"), Some(16_000.0));
        assert_eq!(value("interrupts@500kBd/sensor"), Some(5_000_000.0));
        assert_eq!(value("interrupt-share@500kBd/steering"), Some(31.25));
        assert_eq!(value("real-time@500kBd"), Some(2.125));
        let table = report.to_string();
        for part in ["16000 cycles, 1.00 ms", "31.25 %", "2.12 x"] {
            assert!(table.contains(part), "{table}");
        }
        let nothing = Trace(Value::Null).figures();
        assert_eq!(nothing, Err("it does not say /baud".to_owned()));
    }

    #[test]
    fn what_is_not_built_is_said_with_the_way_to_build_it() {
        let programs = BAUDS.map(|baud| (baud, Programs::in_tree(Path::new("/nowhere"), baud)));
        let said = measure(programs).unwrap_err().to_string();
        assert!(said.contains("/nowhere/firmware/emulator"), "{said}");
        assert!(said.contains(".ci/firmware"), "{said}");
    }
}
