//! `lager up`: the whole robot on this machine, as supervised processes that meet on the bus.
//!
//! This process owns no decision of the robot. It starts the services, keeps the last state of
//! each so that a restarted one goes on where the killed one was, sweeps what dead processes
//! leave on the bus, tells what the robot does, and plays the operator until a person does.

use std::ffi::OsString;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use lager_ports::{Bus, Keeper, Shutdown};
use lager_topics::{LinkHealth, NavStatus, Role, TruthPose};

use crate::cli::UpArgs;
use crate::config::{Body, Config};
use crate::exit;
use crate::hands::Hands;
use crate::map::bus_map;
use crate::operator::{Progress, ScriptedOperator};
use crate::report::{Narrator, Outcome};
use crate::runtime::RuntimeFolder;
use crate::supervisor::Supervisor;

/// The pace of this process's own work.
const TICK: Duration = Duration::from_millis(10);
/// How often dead nodes are swept from the bus.
const SWEEP: Duration = Duration::from_millis(250);

/// Runs until Ctrl-C, or until the mission has ended when that was asked for.
pub fn run(mut config: Config, args: &UpArgs, shutdown: &Shutdown) -> Result<ExitCode> {
    apply(&mut config, args);
    config.validate()?;
    let warehouse = config.warehouse()?;
    let mission = mission(&warehouse, &args.mission)?;

    let folder = RuntimeFolder::create(&config)?;
    let _lock = folder.lock(&config.name)?;
    if config.body == Body::Sim {
        config.serial.sensor = folder.sensor_port();
        config.serial.steering = folder.steering_port();
    }
    let file = folder.write_config(&config)?;

    let bus = Bus::open(&config.bus()?, Role::Supervisor)?;
    let mut keepers = Keepers::new(&bus)?;
    let mut narrator = Narrator::new(&bus, args.json)?;
    let mut hands = Hands::new(&bus)?;
    hands.publish_map(&bus_map(&warehouse))?;

    let mut supervisor = Supervisor::new(file)?;
    if config.body == Body::Sim {
        supervisor.start("simulator", Vec::new())?;
    }
    supervisor.start("bridge", Vec::<OsString>::new())?;
    supervisor.start("logic", Vec::new())?;

    let started = Instant::now();
    let robot_start = bus.clock().now();
    let mut operator = ScriptedOperator::new(mission, hands.fresh_id());
    let mut swept = started;
    let mut failure = None;
    while !shutdown.is_requested() {
        keepers.remember()?;
        for ended in supervisor.poll(|service| keepers.hand_over(service))? {
            narrator.note(&format!("the {} ended ({})", ended.service, ended.how));
        }
        keepers.tick()?;
        if swept.elapsed() >= SWEEP {
            bus.sweep();
            swept = Instant::now();
        }

        let now = bus.clock().now();
        narrator.look(now)?;
        if let Progress::Act(act) = operator.step(now, &narrator.seen()) {
            hands.carry_out(act)?;
        }
        hands.tick()?;
        match operator.outcome() {
            Some(Ok(())) if args.exit_when_done => break,
            Some(Err(why)) if args.exit_when_done => {
                failure = Some(why.to_owned());
                break;
            }
            _ => {}
        }
        std::thread::sleep(TICK);
    }

    let outcome = Outcome {
        delivered: operator.delivered().to_vec(),
        sim_seconds: (bus.clock().now() - robot_start).as_secs_f64(),
        wall_seconds: started.elapsed().as_secs_f64(),
        restarts: supervisor.restarts(),
        failure,
    };
    supervisor.stop();
    narrator.look(bus.clock().now())?;
    narrator.finish(&outcome)?;
    bus.sweep();
    Ok(match &outcome.failure {
        Some(_) => exit::NOT_DELIVERED,
        None => ExitCode::SUCCESS,
    })
}

/// Puts the command line's wishes over the configuration's.
fn apply(config: &mut Config, args: &UpArgs) {
    if let Some(body) = args.body {
        config.body = body;
    }
    if args.sensor.is_some() || args.steering.is_some() {
        config.body = Body::Serial;
    }
    if let Some(port) = &args.sensor {
        config.serial.sensor.clone_from(port);
    }
    if let Some(port) = &args.steering {
        config.serial.steering.clone_from(port);
    }
    if let Some(warehouse) = &args.warehouse {
        config.warehouse.clone_from(warehouse);
    }
    if let Some(seed) = args.seed {
        config.simulator.seed = seed;
    }
    if let Some(speed) = args.speed {
        config.speed = speed;
    }
}
