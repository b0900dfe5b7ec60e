//! The binary `lager`: parses the command line, reads the configuration, and hands over to the
//! one subcommand. Errors end here, as sentences with an exit code.

#![allow(
    unreachable_pub,
    reason = "in a binary, `pub` says what a module offers to the others"
)]

mod bench;
mod cli;
mod config;
mod doctor;
mod emulator;
mod exit;
mod hands;
mod keepers;
mod map;
mod operator;
mod realtime;
mod report;
mod runtime;
mod simulate;
mod steer;
mod supervisor;
mod up;

use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result};
use clap::Parser;
use lager_bridge::BridgeConfig;
use lager_logic::LogicConfig;
use lager_ports::{Bus, Shutdown};
use lager_simulator::SimulatorConfig;
use lager_topics::{Mode, Role};

use crate::cli::{Cli, Command, GlobalArgs, ModeName, ServiceArgs, TopicArgs, TopicCommand};
use crate::config::{ChipSection, Config};
use crate::steer::Operator;

fn main() -> ExitCode {
    lager_benches::parts::play_if_asked();
    let cli = Cli::parse();
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_default_env()
                .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("warn")),
        )
        .init();
    match run(cli) {
        Ok(code) => code,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "lager: {error:#}");
            if error.is::<runtime::NameTaken>() {
                exit::name_taken()
            } else if error.is::<realtime::RealtimeError>() {
                exit::not_granted()
            } else {
                exit::FAILED
            }
        }
    }
}

fn run(cli: Cli) -> Result<ExitCode> {
    let mut config = configure(&cli.global)?;
    let shutdown = Shutdown::new();
    stop_on_signals(&shutdown)?;
    let said = match cli.command {
        Command::Up(args) => return up::run(config, &args, &shutdown),
        Command::Simulate(args) => return simulate::run(&config, &args),
        Command::Bridge(args) => {
            service(&config, Role::Bridge, &args, &shutdown, |bus, resume| {
                let bridge = BridgeConfig {
                    ports: [config.serial.sensor.clone(), config.serial.steering.clone()],
                    baud: config.serial.baud,
                    raw_line: config.serial.raw_line,
                    waiting: config.bus.policy(),
                    resume,
                };
                Ok(lager_bridge::run(bus, &bridge, &shutdown)?)
            })?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Logic(args) => {
            service(&config, Role::Logic, &args, &shutdown, |bus, resume| {
                let logic = LogicConfig {
                    resume,
                    ..config.navigator()
                };
                Ok(lager_logic::run(bus, &logic, &shutdown)?)
            })?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Simulator(args) => {
            service(&config, Role::Simulator, &args, &shutdown, |bus, resume| {
                let simulator = SimulatorConfig {
                    warehouse: config.warehouse()?,
                    seed: config.simulator.seed,
                    baud: config.serial.baud,
                    sensor_link: config.serial.sensor.clone(),
                    steering_link: config.serial.steering.clone(),
                    resume,
                };
                Ok(lager_simulator::run(bus, &simulator, &shutdown)?)
            })?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Emulator(args) => {
            // It is what the clock follows, so its own bus has another.
            let resting = Config {
                chip: ChipSection {
                    clock: None,
                    ..config.chip.clone()
                },
                ..config.clone()
            };
            service(
                &resting,
                Role::Simulator,
                &args,
                &shutdown,
                |bus, resume| emulator::run(bus, &config, resume, &shutdown),
            )?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Topic(args) => {
            topic(&config, args, &shutdown)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Bench(args) => bench::run(&args)?,
        Command::Doctor { fix, realtime } => {
            realtime.apply(&mut config.realtime);
            return doctor::run(&config, fix);
        }
        Command::Config => config.documented().trim_end().to_owned(),
        Command::Drive { command, seconds } => {
            Operator::new(&config)?.drive(&command, seconds, &shutdown)?
        }
        Command::Arm { command } => Operator::new(&config)?.arm(&command, &shutdown)?,
        Command::Stop => Operator::new(&config)?.stop()?,
        Command::Resume => Operator::new(&config)?.resume()?,
        Command::Mode { mode } => Operator::new(&config)?.mode(match mode {
            ModeName::Manual => Mode::Manual,
            ModeName::Autonomous => Mode::Autonomous,
        })?,
        Command::Fetch { product } => Operator::new(&config)?.fetch(product)?,
        Command::Picked => Operator::new(&config)?.picked()?,
        Command::Reset => Operator::new(&config)?.reset()?,
        Command::Gains { p, d } => Operator::new(&config)?.gains(p, d)?,
        Command::Calibrate => Operator::new(&config)?.calibrate()?,
    };
    say(&said)?;
    Ok(ExitCode::SUCCESS)
}

/// A line on standard output. A reader that has gone, as after `| head`, is no error.
fn say(line: &str) -> Result<()> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// The configuration file with the flags of every subcommand on top.
fn configure(global: &GlobalArgs) -> Result<Config> {
    let mut config = Config::load(global.config.as_deref())?;
    if let Some(name) = &global.name {
        config.name.clone_from(name);
    }
    if global.bus_prefix.is_some() {
        config.bus.prefix.clone_from(&global.bus_prefix);
    }
    if global.bus_root.is_some() {
        config.bus.root.clone_from(&global.bus_root);
    }
    config.validate()?;
    Ok(config)
}

/// Ctrl-C, SIGTERM and a closed terminal ask for an orderly end.
fn stop_on_signals(shutdown: &Shutdown) -> Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let flag: Arc<AtomicBool> = shutdown.flag();
    // A second Ctrl-C ends the process at once, should the orderly end hang.
    signal_hook::flag::register_conditional_shutdown(SIGINT, 130, Arc::clone(&flag))
        .context("cannot listen to signals")?;
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&flag))
            .context("cannot listen to signals")?;
    }
    Ok(())
}

/// Runs one service in this process until it is told to end.
fn service(
    config: &Config,
    role: Role,
    args: &ServiceArgs,
    shutdown: &Shutdown,
    run: impl FnOnce(&Bus, bool) -> Result<()>,
) -> Result<()> {
    // Before the first thread: all of them inherit it.
    let mut wanted = config.realtime.wanted(role);
    args.apply(&mut wanted);
    wanted.apply()?;
    config.refuse_starvation(&[(role, wanted)])?;
    if let Some(parent) = args.parent {
        supervisor::adopt(parent, shutdown)?;
    }
    let bus = Bus::open(&config.bus()?, role)?;
    let result = run(&bus, args.resume);
    // A supervisor that was killed left its node behind; the last to go sweeps it.
    bus.sweep();
    result
}

/// The topic tools, on standard output.
fn topic(config: &Config, args: TopicArgs, shutdown: &Shutdown) -> Result<()> {
    let bus = Bus::open(&config.bus()?, Role::Observer)?;
    let out = &mut std::io::BufWriter::new(std::io::stdout().lock());
    let json = args.json;
    let shown = match args.command {
        TopicCommand::List => lager_monitor::list(&bus, json, out),
        TopicCommand::Info { topic } => lager_monitor::info(&bus, &topic, json, out),
        TopicCommand::Echo { topic, count } => {
            lager_monitor::echo(&bus, &topic, count, json, shutdown, out)
        }
        TopicCommand::Hz { topic, count } => {
            lager_monitor::hz(&bus, &topic, count, json, shutdown, out)
        }
    };
    match shown.and_then(|()| Ok(out.flush()?)) {
        Err(error) if error.is_closed_output() => Ok(()),
        shown => Ok(shown?),
    }
}
