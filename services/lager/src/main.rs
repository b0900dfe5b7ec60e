//! The binary `lager`: parses the command line, reads the configuration, and hands over to the
//! one subcommand. Errors end here, as sentences with an exit code.

#![allow(
    unreachable_pub,
    reason = "in a binary, `pub` says what a module offers to the others"
)]

mod address;
mod attend;
mod bag;
mod bench;
mod cli;
mod comm;
mod config;
mod cut_short;
mod diagnose;
mod doctor;
mod emulator;
mod exit;
mod gag;
mod gateway;
mod goods;
mod hands;
mod keepers;
mod kept;
mod map;
mod meant;
mod mission;
mod outcome;
mod overload;
mod patience;
mod reach;
mod realtime;
mod report;
mod runtime;
mod services;
mod signals;
mod simulate;
mod stack;
mod state;
mod station;
mod steer;
mod stop;
mod supervisor;
mod terminal;
mod top;
mod topic;
mod up;
mod voice;
mod words;

use std::io::Write;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::FromArgMatches;
use lager_bridge::BridgeConfig;
use lager_logic::LogicConfig;
use lager_ports::{Bus, Shutdown, Watchdog};
use lager_simulator::SimulatorConfig;
use lager_topics::{Mode, Role};
use lager_wire::OperatorCommand;

use crate::cli::{
    Button, Cli, Command, GlobalArgs, MapChange, ModeName, ObstacleChange, QueueChange,
    ServiceArgs, TopicArgs, TopicCommand,
};
use crate::config::{ChipSection, Config};
use crate::patience::Patience;
use crate::runtime::RuntimeFolder;
use crate::services::Service;
use crate::steer::{Obstacle, Operator};
use crate::supervisor::Parent;
use crate::voice::Speaker;

fn main() -> ExitCode {
    voice::say_of_faults(Speaker::Tool);
    if let Err(error) = stack::must_suffice() {
        voice::say(&Speaker::Tool.line(&format!("{error:#}")));
        return exit::code(&error);
    }
    lager_benches::run_if_asked();
    let cli = Cli::from_arg_matches(&cli::help::command().get_matches())
        .unwrap_or_else(|error| error.exit());
    let mut speaker = Speaker::Tool;
    let mut looked_at = None;
    let is_supervised = as_whom(&cli.command).is_some_and(|(_, parent)| parent.is_some());
    let begun = signals::outlive_long_files().and_then(|()| configure(&cli.global));
    let ended = begun.and_then(|config| {
        looked_at = Some(config.clone());
        let own = own_voice(&cli.command, &config);
        voice::begin(own, &config.log)?;
        voice::say_of_faults(own);
        // `up` has no robot to speak for as long as it can end with an error.
        if !matches!(cli.command, Command::Up(_)) {
            speaker = own;
        }
        run(cli, config)
    });
    match ended {
        Ok(code) => code,
        Err(error) => {
            voice::say(&speaker.line(&format!("{error:#}")));
            if exit::may_have_a_cause(&error) {
                let causes = looked_at.iter().flat_map(diagnose::causes);
                let busy = patience::was_in_vain(&error)
                    .then(overload::cause)
                    .flatten();
                for cause in causes.chain(busy) {
                    voice::say(&speaker.line(&cause));
                }
            }
            match is_supervised {
                true => exit::code_of_service(&error),
                false => exit::code(&error),
            }
        }
    }
}

/// As whom this process speaks on the terminal.
fn own_voice(command: &Command, config: &Config) -> Speaker {
    match as_whom(command) {
        Some((who, parent)) => Speaker::service(who, parent, config),
        None => Speaker::Tool,
    }
}

/// The part of a robot that a command runs, and who has started it.
fn as_whom(command: &Command) -> Option<(&'static str, Option<Parent>)> {
    Some(match command {
        Command::Up(_) => ("up", None),
        Command::Attend(args) => ("up", args.parent),
        Command::Bridge(args) => ("bridge", args.parent),
        Command::Logic(args) => ("logic", args.parent),
        Command::Simulator(args) => ("simulator", args.parent),
        Command::Emulator(args) => ("emulator", args.parent),
        Command::Comm(args) => ("comm", args.service.parent),
        Command::Station(args) => ("station", args.parent),
        Command::Gateway(args) => ("gateway", args.service.parent),
        _ => return None,
    })
}

fn run(cli: Cli, mut config: Config) -> Result<ExitCode> {
    if let Command::Up(args) = cli.command {
        return up::run(config, &args);
    }
    let shutdown = Shutdown::new();
    signals::end_in_order(&shutdown)?;
    // Whatever follows is a tool, and ends at the first Ctrl-C.
    let patience = || Patience::new(&config, &shutdown);
    let operator = || {
        diagnose::must_be_up(&config)?;
        Operator::new(&config, patience()?)
    };
    let said = match cli.command {
        Command::Up(_) => unreachable!("it listens to signals in its own way"),
        Command::Simulate(args) => {
            patience()?;
            return simulate::run(&config, &args);
        }
        Command::Attend(args) => {
            attend::run(&config, args.parent, &shutdown)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Bridge(args) => {
            service(&config, Role::Bridge, &args, &shutdown, |bus, resume, _| {
                let bridge = BridgeConfig {
                    ports: [config.serial.sensor.clone(), config.serial.steering.clone()],
                    baud: config.serial.baud,
                    raw_line: config.serial.raw_line,
                    original_boards: config.serial.original_boards,
                    arm: config.arm,
                    buttons: config.buttons.lines(),
                    waiting: config.bus.policy(),
                    resume,
                };
                Ok(lager_bridge::run(bus, &bridge, &shutdown)?)
            })?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Logic(args) => {
            service(&config, Role::Logic, &args, &shutdown, |bus, resume, _| {
                let logic = LogicConfig {
                    resume,
                    ..config.navigator()
                };
                Ok(lager_logic::run(bus, &logic, &shutdown)?)
            })?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Simulator(args) => {
            service(
                &config,
                Role::Simulator,
                &args,
                &shutdown,
                |bus, resume, _| {
                    let simulator = SimulatorConfig {
                        warehouse: config.warehouse()?,
                        seed: config.simulator.seed,
                        obstacles: config.simulator.obstacles,
                        baud: config.serial.baud,
                        sensor_link: config.serial.sensor.clone(),
                        steering_link: config.serial.steering.clone(),
                        resume,
                    };
                    Ok(lager_simulator::run(bus, &simulator, &shutdown)?)
                },
            )?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Emulator(args) => {
            // The emulator is what the clock follows, so its own bus has another clock.
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
                |bus, resume, _| emulator::run(bus, &config, resume, &shutdown),
            )?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Comm(args) => {
            let (running, wanted) = comm::prepare(&config, &args)?;
            let args = &args.service;
            service(&running, Role::Comm, args, &shutdown, |bus, _, watchdog| {
                Ok(lager_comm::run(bus, &wanted, watchdog, &shutdown)?)
            })?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Station(args) => {
            station::run(&config, &args, &shutdown)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Gateway(args) => {
            let (running, wanted) = gateway::prepare(&config, &args)?;
            service(
                &running,
                Role::Gateway,
                &args.service,
                &shutdown,
                |bus, _, _| gateway::run(bus, &running, wanted, &shutdown),
            )?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Gag { socket } => {
            gag::run(&config, socket, &shutdown)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Topic(TopicArgs {
            command: TopicCommand::Schema { python },
            ..
        }) => {
            lager_monitor::write_python(&python)
                .with_context(|| format!("cannot write the layouts into {}", python.display()))?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Topic(args) => {
            topic::run(&config, args, cli.global.name.is_none(), &patience()?)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Top(args) => {
            top::run(&config, &args, &patience()?)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Completions { shell } => return Ok(topic::completions(shell)),
        Command::Bag(args) => return bag::run(&config, args, &shutdown),
        Command::Bench(args) => {
            // It has a bus of its own and gives up by itself; on Ctrl-C it takes the time to sweep.
            cut_short::say_so()?;
            bench::run(&args)?
        }
        Command::Doctor {
            fix,
            json,
            realtime,
        } => {
            realtime.apply(&mut config.realtime);
            Patience::new(&config, &shutdown)?;
            return doctor::run(&config, fix, json);
        }
        Command::Config { iceoryx2: true } => config.bus()?.iceoryx2_toml()?.trim_end().to_owned(),
        Command::Config { iceoryx2: false } => {
            // What `up` would refuse is no configuration to go by.
            config.warehouse()?;
            config.documented().trim_end().to_owned()
        }
        // Before anything is asked of the bus, which need not be there.
        Command::Stop
        | Command::Drive {
            command: OperatorCommand::Stop,
            ..
        } => {
            patience()?;
            stop::run(&config)?
        }
        Command::Drive { command, seconds } => operator()?.drive(command, seconds)?,
        Command::Arm { command } => operator()?.arm(command)?,
        Command::Resume => {
            // As it is when the person says so: one that comes later is not released.
            let before = stop::current(&config)?;
            operator()?.resume(&config, before)?
        }
        Command::Mode { mode } => operator()?.mode(match mode {
            ModeName::Manual => Mode::Manual,
            ModeName::Autonomous => Mode::Autonomous,
        })?,
        Command::Fetch { product } => operator()?.fetch(&product)?,
        Command::Cancel { id } => operator()?.cancel(id)?,
        Command::Map { change: None } => operator()?.map()?,
        Command::Map {
            change: Some(MapChange::Back { product }),
        } => operator()?.back(product.as_ref())?,
        Command::Queue { change } => {
            let operator = operator()?;
            match change {
                None => operator.orders()?,
                Some(QueueChange::Add { product }) => operator.order(&product)?,
                Some(QueueChange::Cancel { id }) => operator.cancel(id)?,
                Some(QueueChange::Up { id }) => operator.move_up(id)?,
                Some(QueueChange::Clear) => operator.clear_queue()?,
            }
        }
        Command::Pick { by } => operator()?.pick(by.into())?,
        Command::Picked { force } => operator()?.picked(force)?,
        Command::Reset => operator()?.reset()?,
        Command::Press {
            button: Button::Reset,
        } => operator()?.reset()?,
        Command::Press {
            button: Button::Switch,
        } => operator()?.switch()?,
        Command::Place { place } => operator()?.place(place)?,
        Command::Obstacle { change } => {
            let operator = operator()?;
            match change {
                None => operator.obstacles()?,
                Some(ObstacleChange::Put { way }) => operator.obstacle(Obstacle::Put(way))?,
                Some(ObstacleChange::Take { way }) => operator.obstacle(Obstacle::Take(way))?,
            }
        }
        Command::Gains { p, d } => operator()?.gains(p, d)?,
        Command::Calibrate => operator()?.calibrate()?,
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
    if global.bus.is_some() {
        config.bus.folder.clone_from(&global.bus);
    }
    if let Some(state) = &global.state {
        config.state = Some(std::path::absolute(state)?);
    }
    if global.log.is_some() {
        config.log.file.clone_from(&global.log);
    }
    config.log.json |= global.log_json;
    config.validate()?;
    Ok(config)
}

/// Runs one service in this process until it is told to end.
fn service(
    config: &Config,
    role: Role,
    args: &ServiceArgs,
    shutdown: &Shutdown,
    run: impl FnOnce(&Bus, bool, &Watchdog) -> Result<()>,
) -> Result<()> {
    let span = tracing::info_span!("service", service = %role, robot = %config.name);
    let _service = span.entered();
    let start = tracing::info_span!("start").entered();
    // Before the first thread: all of them inherit it.
    let mut wanted = config.realtime.wanted(role);
    args.apply(&mut wanted);
    wanted.apply()?;
    config.refuse_starvation(&[(role, wanted)])?;
    if let Some(parent) = args.parent {
        supervisor::adopt(parent, shutdown)?;
    }
    let bus = config.bus()?;
    // Two of a kind would both steer; a supervised successor may meet its predecessor's end.
    let _lock = bus.place()?.lock(&bus.robot, role)?;
    // The attendant listens whether it lives: for what it publishes, or for these signs.
    let watchdog = match role {
        Role::Comm => {
            comm::watch(shutdown)?.showing(RuntimeFolder::live_as(config, Service::Comm)?)
        }
        _ => Watchdog::default(),
    };
    let bus = watchdog.over("joining the bus", || Bus::open(&bus, role))?;
    drop(start);
    let result = run(&bus, args.resume, &watchdog);
    // A killed supervisor left its node behind; the last process to go sweeps it.
    watchdog.over("sweeping the bus", || bus.sweep());
    result
}
