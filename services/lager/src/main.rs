//! The binary `lager`: parses the command line, reads the configuration, and hands over to the
//! one subcommand. Errors end here, as sentences with an exit code.

#![allow(
    unreachable_pub,
    reason = "in a binary, `pub` says what a module offers to the others"
)]

mod address;
mod afar;
mod bag;
mod bench;
mod board;
mod cli;
mod comm;
mod commission;
mod config;
mod diagnose;
mod doctor;
mod emulator;
mod exit;
mod gag;
mod gateway;
mod goods;
mod hint;
mod keys;
mod meant;
mod overload;
mod reach;
mod realtime;
mod report;
mod ros2;
mod shell;
mod sigbus;
mod simulate;
mod simulated_lines;
mod stack;
mod station;
mod steer;
mod stop;
mod time_limit;
mod top;
mod topic;
mod traces;
mod up;

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::FromArgMatches;
use lager_bridge::BridgeConfig;
use lager_logic::LogicConfig;
use lager_ports::Bus;
use lager_simulator::SimulatorConfig;
use lager_supervisor::Parent;
use lager_supervisor::Service;
use lager_supervisor::attendant::{self, AttendantConfig};
use lager_supervisor::children::adopt;
use lager_supervisor::console;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_supervisor::signals;
use lager_topics::{Role, StopCause};
use lager_wake::{Shutdown, Watchdog};
use lager_wire::OperatorCommand;

use crate::cli::{Cli, Command, ServiceArgs, TopicArgs, TopicCommand};
use crate::config::{Body, ChipSection, Config};
use crate::steer::Operator;
use crate::time_limit::TimeLimit;
use crate::traces::Speaker;

fn main() -> ExitCode {
    traces::say_of_faults(Speaker::Tool);
    if let Err(error) = stack::must_suffice() {
        console::complain(&Speaker::Tool.line(&format!("{error:#}")));
        return exit::code(&error);
    }
    let cli = Cli::from_arg_matches(&cli::help::command().get_matches())
        .unwrap_or_else(|error| error.exit());
    let mut speaker = Speaker::Tool;
    let mut looked_at = None;
    let is_supervised = as_whom(&cli.command).is_some_and(|(_, parent)| parent.is_some());
    let begun = signals::outlive_long_files().and_then(|()| configure(&cli));
    let ended = begun.and_then(|config| {
        looked_at = Some(config.clone());
        let own = own_voice(&cli.command, &config);
        traces::begin(own, &config.log)?;
        traces::say_of_faults(own);
        // While `up` can still end with an error, it has no robot to speak for.
        if !matches!(cli.command, Command::Up(_)) {
            speaker = own;
        }
        run(cli, config)
    });
    match ended {
        Ok(code) => code,
        Err(error) => {
            console::complain(&speaker.line(&hint::helped(&error)));
            if exit::may_have_a_cause(&error) {
                let causes = looked_at.iter().flat_map(diagnose::causes);
                let busy = time_limit::was_in_vain(&error)
                    .then(overload::cause)
                    .flatten();
                for cause in causes.chain(busy) {
                    console::complain(&speaker.line(&cause));
                }
            }
            match is_supervised {
                true => exit::code_of_service(&error),
                false => exit::code(&error),
            }
        }
    }
}

/// Whose name this process uses on the terminal.
fn own_voice(command: &Command, config: &Config) -> Speaker {
    match as_whom(command) {
        Some((who, parent)) => Speaker::service(who, parent, config),
        None => Speaker::Tool,
    }
}

/// The robot's service that a command runs, and the process that started it.
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
    // All other commands are tools, and end at the first Ctrl-C.
    let patience = || TimeLimit::new(&config, &shutdown);
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
            attend(&config, args.parent, &shutdown)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Bridge(args) => {
            service(&config, Role::Bridge, &args, &shutdown, |bus, resume, _| {
                let bridge = BridgeConfig {
                    ports: config.serial.ports(),
                    baud: config.serial.baud,
                    raw_line: config.serial.tells_raw_line(),
                    original_boards: config.serial.original_boards,
                    robot: config.robot(),
                    buttons: config.buttons.lines(),
                    waiting: config.bus.policy(),
                    resume,
                };
                let ran = match config.body {
                    Body::Serial => lager_bridge::run(bus, &bridge, &shutdown),
                    // The buttons of a simulated robot are in its world.
                    Body::Sim | Body::Chip => {
                        let lines = simulated_lines::World(bus);
                        lager_bridge::run_with(bus, &bridge, &lines, &shutdown)
                    }
                };
                Ok(ran?)
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
                    let [sensor_link, steering_link] = config.serial.links()?;
                    let simulator = SimulatorConfig {
                        warehouse: config.simulated_warehouse()?,
                        seed: config.simulator.seed,
                        build: config.simulator.build(),
                        obstacles: config.simulator.obstacles,
                        baud: config.serial.baud,
                        sensor_link,
                        steering_link,
                        eeprom: config.chip.eeprom.clone(),
                        resume,
                    };
                    Ok(lager_simulator::run(bus, &simulator, &shutdown)?)
                },
            )?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Emulator(args) => {
            // The emulator makes the time that the clock shows, so its own bus needs another clock.
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
        Command::Gateway(args) if args.ros2 => {
            return Err(ros2::become_it(&config, &args, &cli.global)?);
        }
        Command::Gateway(args) if args.router.is_some() => {
            gateway::route(&config, &args, &shutdown)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Gateway(args) if args.remote.is_some() => {
            gateway::run_from_afar(&config, &args, &shutdown)?;
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
        Command::Keys(args) => keys::run(&args)?,
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
        Command::Completions { shell } => return Ok(shell::completions(shell)),
        Command::Manual { folder } => {
            shell::manual(&folder)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Bag(args) => return bag::run(&config, args, &shutdown),
        Command::Bench { arguments } => {
            return Err(bench::become_it(&arguments, &config.bus()?));
        }
        Command::Board(args) => {
            board::run(&config, &args, &shutdown)?;
            return Ok(ExitCode::SUCCESS);
        }
        Command::Commission(args) => return commission::run(&config, &args, &shutdown),
        Command::Doctor {
            fix,
            json,
            realtime,
        } => {
            realtime.apply(&mut config.realtime);
            TimeLimit::new(&config, &shutdown)?;
            return doctor::run(&config, fix, json);
        }
        Command::Report(args) => report::run(&config, &args)?,
        Command::Config { iceoryx2: true, .. } => {
            config.bus()?.iceoryx2_toml()?.trim_end().to_owned()
        }
        Command::Config { robot: true, .. } => config.described().trim_end().to_owned(),
        Command::Config { .. } => {
            // Do not show a configuration that `up` would refuse.
            config.known_warehouse()?;
            config.documented().trim_end().to_owned()
        }
        // Before any call into the bus, which may not exist.
        Command::Stop
        | Command::Drive {
            command: OperatorCommand::Stop,
            ..
        } => {
            patience()?;
            stop::run(&config, StopCause::Ordered)?
        }
        Command::Drive {
            command,
            speed,
            seconds,
        } => operator()?.steer(cli::at_speed(command, speed)?, seconds)?,
        Command::Resume => {
            // Take the stop of this moment: a later stop must not be released.
            let before = stop::current(&config)?;
            operator()?.resume(&config, before)?
        }
        Command::Ordered(ordered) => operator()?.order(&ordered)?,
    };
    console::print(&said)?;
    Ok(ExitCode::SUCCESS)
}

/// The configuration file, with the flags of every subcommand on top.
fn configure(cli: &Cli) -> Result<Config> {
    let global = &cli.global;
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
    // A service has it from the `up` that started it, and `up` looks once it knows the body. A
    // command that stops the robot needs no file.
    let is_handed = global.config.as_deref() == Some(Path::new("-"));
    if !is_handed && needs_description(&cli.command) {
        config.describe()?;
    }
    config.validate()?;
    Ok(config)
}

/// Whether a command must know how the robot is built.
fn needs_description(command: &Command) -> bool {
    matches!(
        command,
        Command::Bridge(_)
            | Command::Logic(_)
            | Command::Simulate(_)
            | Command::Config { .. }
            | Command::Doctor { .. }
            | Command::Report(_)
    )
}

/// Runs the attendant of the `up` that is `parent`.
fn attend(config: &Config, parent: Option<Parent>, shutdown: &Shutdown) -> Result<()> {
    let here = match config.station.wanted {
        true => None,
        false => config.known_warehouse()?,
    };
    let told = here.map(|warehouse| warehouse.told()).transpose()?;
    let warehouse =
        told.map(|(side, grid, products)| lager_topics::WarehouseMap::new(side, grid, &products));
    let attended = AttendantConfig {
        bus: config.bus()?,
        is_real: config.body == Body::Serial,
        warehouse,
    };
    attendant::run(&attended, parent, shutdown)
}

/// Runs one service in this process until somebody ends it.
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
    // Before the first thread, so that all threads inherit it.
    let mut wanted = config.realtime.wanted(role);
    args.apply(&mut wanted);
    wanted.apply()?;
    config.refuse_starvation(&[(role, wanted)])?;
    if let Some(parent) = args.parent {
        adopt(parent, shutdown)?;
    }
    let bus = config.bus()?;
    // Two of a kind would both steer. A new service may have to wait for the end of the old one.
    let _lock = bus.home()?.lock(&bus.unit, role)?;
    // The attendant checks whether the service lives, by its samples or by these signs.
    let watchdog = match role {
        Role::Comm => comm::watch(shutdown)?.showing(RuntimeFolder::live_as(&bus, Service::Comm)?),
        _ => Watchdog::default(),
    };
    let bus = watchdog.over("joining the bus", || Bus::open(&bus, role))?;
    drop(start);
    let result = run(&bus, args.resume, &watchdog);
    // A killed supervisor left its node on the bus; the last process removes it.
    watchdog.over("sweeping the bus", || bus.sweep());
    result
}
