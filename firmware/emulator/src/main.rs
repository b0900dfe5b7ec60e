//! The emulator's command line; it only reads options and starts the parts.

use core::num::NonZeroI32;
use std::io::{self, BufRead};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, channel};

use clap::Parser;
use lager_emulator::chip::{Image, ImageError};
use lager_emulator::measure::measure;
use lager_emulator::rig::{Images, RigOptions};
use lager_emulator::shell::{EmulatorConfig, run};
use lager_plant::{Build, Hand, Make, Warehouse, WorldState};
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};

/// The robot's two boards as chips: the real firmware images in simavr, wired to each other and
/// to a warehouse, behind two serial ports.
#[derive(Debug, Parser)]
#[command(
    name = "lager-emulator",
    version,
    after_help = "Examples:
  lager-emulator --sensor-elf sensor.elf --steering-elf steering.elf \\
      --sensor-link /tmp/sensor --steering-link /tmp/steering
  lager up --sensor /tmp/sensor --steering /tmp/steering      drives what that emulates
  lager-emulator --sensor-elf sensor.elf --steering-elf steering.elf --trace

Exit codes: 0 done, 1 failed, 2 wrong usage."
)]
struct Cli {
    /// The sensor board's image, an ELF file
    #[arg(long, value_name = "FILE")]
    sensor_elf: PathBuf,
    /// The steering board's image, an ELF file
    #[arg(long, value_name = "FILE")]
    steering_elf: PathBuf,
    /// The sensor board's bootloader, an ELF file; with it the board can get another image
    #[arg(long, value_name = "FILE")]
    sensor_loader: Option<PathBuf>,
    /// The steering board's bootloader, an ELF file
    #[arg(long, value_name = "FILE")]
    steering_loader: Option<PathBuf>,
    /// Path at which the sensor board's serial port appears
    #[arg(long, value_name = "PATH", required_unless_present = "trace")]
    sensor_link: Option<PathBuf>,
    /// Path at which the steering board's serial port appears
    #[arg(long, value_name = "PATH", required_unless_present = "trace")]
    steering_link: Option<PathBuf>,
    /// A built-in warehouse (small, curved, large), or the fields of a warehouse file as JSON
    #[arg(long, value_name = "NAME|FILE", default_value = "small")]
    warehouse: String,
    /// Seed of every imperfection of robot and world
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Seed of how the robot is built; without it, as drawn
    #[arg(long, value_name = "SEED")]
    built: Option<u64>,
    /// Baud rate of both lines; it must be that of the images
    #[arg(long, default_value_t = 500_000)]
    baud: u32,
    /// Chip time divided by real time; more than the machine can do means as fast as it can
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    speed: f64,
    /// Publishes the chips' time in this file, a shared page (src/clock.rs describes it)
    #[arg(long, value_name = "FILE")]
    clock: Option<PathBuf>,
    /// Keeps both boards' EEPROM, and so their settings, in this folder
    #[arg(long, value_name = "FOLDER")]
    eeprom: Option<PathBuf>,
    /// So many things appear on edges at random, and disappear again
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=64))]
    obstacles: u32,
    /// Writes the true state of robot and goods to standard output, 50 lines of JSON a second. Also
    /// carries out and answers each line on standard input: {"place": {"x": 0, "y": 0, "heading":
    /// 0}} in mm and rad, {"put": {"from": [0, 0], "to": [1, 0]}}, or "take" in place of "put"
    #[arg(long)]
    truth: bool,
    /// Goes on with a world: reads one line on standard input, the `world` of a line from --truth
    #[arg(long)]
    resume: bool,
    /// Ends together with its parent process, which must have this id
    #[arg(long, value_name = "PID")]
    parent: Option<i32>,
    /// Instead of serving ports: measures the images in cycles and prints the result as JSON
    #[arg(long, conflicts_with_all = ["clock", "eeprom", "truth", "resume"])]
    trace: bool,
}

fn main() -> ExitCode {
    match serve(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("lager-emulator: {error}");
            ExitCode::FAILURE
        }
    }
}

fn serve(cli: Cli) -> Result<(), Box<dyn std::error::Error>> {
    if let Some(parent) = cli.parent {
        end_with(parent)?;
    }
    let warehouse = warehouse(&cli.warehouse)?;
    let images = Images {
        sensor: image(&cli.sensor_elf, cli.sensor_loader.as_deref())?,
        steering: image(&cli.steering_elf, cli.steering_loader.as_deref())?,
    };
    let rig = RigOptions {
        warehouse,
        seed: cli.seed,
        // Measurements use the robot as drawn, so that figures can be compared.
        make: match cli.sensor_link {
            Some(_) => Make::Varied,
            None => Make::Nominal,
        },
        build: cli.built.map_or_else(Build::default, Build::drawn),
        baud: cli.baud,
    };
    let (Some(sensor_link), Some(steering_link), false) =
        (cli.sensor_link, cli.steering_link, cli.trace)
    else {
        let report = measure(&images, &rig)?;
        println!("{}", serde_json::to_string_pretty(&report)?);
        return Ok(());
    };
    let config = EmulatorConfig {
        rig,
        sensor_link,
        steering_link,
        speed: cli.speed,
        clock: cli.clock,
        eeprom: cli.eeprom,
        truth: cli.truth,
        resume: cli.resume.then(kept).transpose()?,
        obstacles: cli.obstacles,
        hands: cli.truth.then(hands),
    };
    let shutdown = Arc::new(AtomicBool::new(false));
    for signal in [
        signal_hook::consts::SIGINT,
        signal_hook::consts::SIGTERM,
        signal_hook::consts::SIGHUP,
    ] {
        signal_hook::flag::register(signal, Arc::clone(&shutdown))?;
    }
    // Without this a limit on file sizes (`ulimit -f`) would kill the process; now writing fails.
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())?;
    run(&images, config, &shutdown)?;
    Ok(())
}

/// Ends this process with its parent: the kernel sends SIGTERM when the parent ends, for any
/// reason.
fn end_with(parent: i32) -> Result<(), Box<dyn std::error::Error>> {
    set_parent_process_death_signal(Some(Signal::TERM))?;
    if getppid().map(Pid::as_raw_nonzero).map(NonZeroI32::get) != Some(parent) {
        return Err(format!("the parent (process {parent}) is gone").into());
    }
    Ok(())
}

/// A board's image, with its bootloader if it has one.
fn image(application: &Path, loader: Option<&Path>) -> Result<Image, ImageError> {
    let application = Image::read(application)?;
    match loader {
        Some(loader) => Ok(Image::read(loader)?.with(&application)),
        None => Ok(application),
    }
}

fn warehouse(text: &str) -> Result<Warehouse, String> {
    Warehouse::builtin(text).map_or_else(
        || {
            serde_json::from_str(text).map_err(|error| {
                format!(
                    "`{text}` is neither a built-in warehouse ({}) nor the JSON of one ({error})",
                    Warehouse::BUILTIN.join(", ")
                )
            })
        },
        Ok,
    )
}

fn kept() -> Result<WorldState, String> {
    let mut line = String::new();
    io::stdin()
        .lock()
        .read_line(&mut line)
        .map_err(|error| format!("cannot read the world from standard input: {error}"))?;
    serde_json::from_str(&line)
        .map_err(|error| format!("the line on standard input is not a world: {error}"))
}

/// Reads a person's actions from standard input, one a line, in a thread that ends with the input.
fn hands() -> Receiver<Hand> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in io::stdin().lines().map_while(Result::ok) {
            match serde_json::from_str(&line) {
                Ok(hand) if sender.send(hand).is_err() => return,
                Ok(_) => {}
                Err(error) => {
                    eprintln!("lager-emulator: `{line}` is not an action on the world: {error}");
                }
            }
        }
    });
    receiver
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|speed: &f64| speed.is_finite() && *speed > 0.0)
        .ok_or_else(|| "give a number above 0, such as 1 or 0.5".into())
}
