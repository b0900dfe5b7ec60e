//! `lager up`: the whole robot on this machine, as supervised processes that meet on the bus.
//!
//! This process owns no decision of the robot. It starts the services, keeps the last state of
//! each so that a restarted one goes on where the killed one was, sweeps what dead processes
//! leave on the bus, tells what the robot does, and plays the operator until a person does.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use lager_plant::Warehouse;
use lager_ports::{Bus, BusConfig, OpenError, Shutdown};
use lager_topics::Role;

use crate::cli::UpArgs;
use crate::config::{Body, ChipSection, Config};
use crate::exit;
use crate::hands::Hands;
use crate::keepers::Keepers;
use crate::map::bus_map;
use crate::operator::ScriptedOperator;
use crate::report::{Narrator, Outcome};
use crate::runtime::RuntimeFolder;
use crate::supervisor::Supervisor;

/// The pace of this process's own work in robot time, and at most this in real time. A service that
/// ends is not kept waiting for it.
const TICK: Duration = Duration::from_millis(40);
/// The pace while a service waits to be handed what is kept for it, in real time.
const HAND_OVER_TICK: Duration = Duration::from_millis(5);
/// How often nodes of other processes that died are swept from the bus; a service's is at once.
const SWEEP: Duration = Duration::from_secs(1);
/// How long an emulated body may take until it has a clock, in real time.
const BODY_START: Duration = Duration::from_secs(30);

/// Runs until Ctrl-C, or until the mission has ended when that was asked for.
pub fn run(mut config: Config, args: &UpArgs, shutdown: &Shutdown) -> Result<ExitCode> {
    apply(&mut config, args);
    config.validate()?;
    let warehouse = config.warehouse()?;
    let mission = mission(&warehouse, &args.mission)?;
    // A real robot does not move off by itself: there somebody has to ask for the script.
    let scripted = args.headless || config.body != Body::Serial;
    if !scripted && (args.exit_when_done || !args.mission.is_empty()) {
        bail!("on a real robot a mission needs --headless: there the script is the operator");
    }

    rehearse(&config)?;

    let folder = RuntimeFolder::create(&config)?;
    let _lock = folder.lock(&config.name)?;
    if config.body != Body::Serial {
        config.serial.sensor = folder.sensor_port();
        config.serial.steering = folder.steering_port();
    }
    match config.body {
        Body::Sim => config.chip.clock = None,
        Body::Chip => equip(&mut config, &folder)?,
        // The ports may be those of an emulator that somebody else runs.
        Body::Serial => {}
    }
    let file = folder.write_config(&config)?;

    let mut supervisor = Supervisor::new(file)?;
    if let Some(body) = config.body.service() {
        supervisor.start(body)?;
    }
    let bus = join(&config.bus()?, &mut supervisor, shutdown)?;
    let mut keepers = Keepers::new(&bus)?;
    let mut narrator = Narrator::new(&bus, args.json)?;
    let hands = Hands::new(&bus)?;
    hands.publish_map(&bus_map(&warehouse))?;

    supervisor.start("bridge")?;
    supervisor.start("logic")?;

    let started = Instant::now();
    let clock = bus.clock();
    let robot_start = clock.now();
    let mut operator = scripted.then(|| ScriptedOperator::new(mission, Hands::fresh_id()));
    let mut swept = started;
    let mut complaints = Complaints::default();
    while !shutdown.is_requested() {
        complaints.hear(keepers.remember());
        let ended = supervisor.poll(|service| complaints.hear(keepers.hand_over(service)));
        if !ended.is_empty() || swept.elapsed() >= SWEEP {
            // A killed service's last word goes with its node.
            complaints.hear(keepers.remember());
            bus.sweep();
            swept = Instant::now();
        }
        for ended in ended {
            narrator.note(&format!("the {} ended ({})", ended.service, ended.how));
        }
        complaints.hear(narrator.look(clock.now() - robot_start));
        hands.tick();
        if let Some(operator) = &mut operator {
            if let Some(act) = operator.step(clock.now(), narrator.seen()) {
                complaints.hear(hands.carry_out(act));
            }
            let over = operator.outcome().is_some() || supervisor.hopeless().is_some();
            if over && args.exit_when_done {
                break;
            }
        }
        supervisor.wait(match supervisor.has_newcomer() {
            true => HAND_OVER_TICK,
            false => clock.real(TICK).min(TICK),
        });
    }

    let hopeless = supervisor.hopeless();
    // The robot is stopped before anything else is looked at.
    supervisor.stop();
    complaints.hear(narrator.look(clock.now() - robot_start));
    let delivered = operator
        .as_ref()
        .map_or_else(Vec::new, |operator| operator.delivered().to_vec());
    let failure = match operator.as_ref().and_then(ScriptedOperator::outcome) {
        Some(Err(why)) => Some(why.to_owned()),
        None if args.exit_when_done => Some(match hopeless {
            Some(service) => format!("the {service} ends at every start"),
            None => "interrupted before the mission was delivered".into(),
        }),
        _ => delivered
            .iter()
            .find(|product| narrator.truly_delivered(**product) == Some(false))
            .map(|product| format!("product {product} does not lie at the delivery station")),
    };
    let outcome = Outcome {
        delivered,
        sim_seconds: (clock.now() - robot_start).as_secs_f64(),
        wall_seconds: started.elapsed().as_secs_f64(),
        frames: narrator.frames(),
        lost: narrator.lost(),
        restarts: supervisor.restarts(),
        failure,
    };
    narrator.finish(&outcome, args.json)?;
    bus.sweep();
    Ok(if outcome.failure.is_some() {
        exit::not_delivered()
    } else {
        ExitCode::SUCCESS
    })
}

/// Refuses before anything runs what the services would be refused, again and again, at every
/// start.
fn rehearse(config: &Config) -> Result<()> {
    let roles = [Role::Bridge, Role::Logic, Role::Simulator]
        .map(|role| (role, config.realtime.wanted(role)));
    config.refuse_starvation(&roles)?;
    for (_, wanted) in &roles {
        wanted.rehearse()?;
    }
    Ok(())
}

/// Chooses the places of an emulated body's files, and finds out whether it has all it needs.
fn equip(config: &mut Config, folder: &RuntimeFolder) -> Result<()> {
    let chip = &mut config.chip;
    let parts = chip.parts(config.serial.baud)?;
    *chip = ChipSection {
        emulator: Some(parts.emulator),
        sensor_elf: Some(parts.sensor_elf),
        steering_elf: Some(parts.steering_elf),
        eeprom: Some(match chip.eeprom.take() {
            Some(eeprom) => eeprom,
            None => folder.eeprom()?,
        }),
        clock: Some(folder.fresh_clock()?),
    };
    Ok(())
}

/// Joins the bus, as soon as the body has a clock to follow.
fn join(config: &BusConfig, supervisor: &mut Supervisor, shutdown: &Shutdown) -> Result<Bus> {
    let start = Instant::now();
    loop {
        match Bus::open(config, Role::Supervisor) {
            Err(OpenError::NoClock { .. } | OpenError::ForeignClock(_))
                if start.elapsed() < BODY_START && !shutdown.is_requested() => {}
            joined => return Ok(joined?),
        }
        if let Some(ended) = supervisor.poll(|_| {}).first() {
            bail!("the {} does not start ({})", ended.service, ended.how);
        }
        supervisor.wait(TICK);
    }
}

/// Errors of the bus that pass: the next attempt may succeed, and the robot must not end with
/// them.
#[derive(Default)]
struct Complaints(u32);

impl Complaints {
    /// Says what went wrong, but not for ever.
    fn hear(&mut self, result: Result<()>) {
        if let Err(error) = result {
            self.0 = self.0.wrapping_add(1);
            if self.0.is_power_of_two() {
                tracing::warn!(times = self.0, "{error:#}");
            }
        }
    }
}

/// The products to fetch: those asked for, or the warehouse's first.
pub fn mission(warehouse: &Warehouse, wanted: &[i32]) -> Result<Vec<i32>> {
    let known: Vec<i32> = warehouse.map_products().map(|(id, ..)| id).collect();
    if let Some(unknown) = wanted.iter().find(|id| !known.contains(id)) {
        bail!("the warehouse has no product {unknown}; it has {known:?}");
    }
    if wanted.is_empty() {
        return Ok(known.into_iter().take(1).collect());
    }
    Ok(wanted.to_vec())
}

/// Puts the command line's wishes over the configuration's.
fn apply(config: &mut Config, args: &UpArgs) {
    if let Some(body) = args.body {
        config.body = body;
    }
    if let Some(folder) = &args.images {
        config.body = Body::Chip;
        config.chip.sensor_elf = Some(folder.join("sensor.elf"));
        config.chip.steering_elf = Some(folder.join("steering.elf"));
    }
    if let Some(emulator) = &args.emulator {
        config.body = Body::Chip;
        config.chip.emulator = Some(emulator.clone());
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
    if let Some(baud) = args.baud {
        config.serial.baud = baud;
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
    args.realtime.apply(&mut config.realtime);
}
