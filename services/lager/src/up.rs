//! `lager up`: the whole robot on this machine, as supervised processes that meet on the bus.
//!
//! This process takes no decision for the robot. It opens, maps and sweeps nothing on the bus, so
//! nothing there can hold it up or end it. It starts the services, restarts them, answers signals,
//! and shows what it is told. Its child, the attendant (`attend.rs`), does what needs the bus.

mod attendant;
mod external;
mod figures;
mod resets;
mod robot;
mod stage;

use std::process::ExitCode;

use anyhow::{Result, bail};
use lager_lines::{Called, ProductId};
use lager_plant::Warehouse;
use lager_topics::Role;

use crate::cli::UpArgs;
use crate::config::{Body, ChipSection, Config, PickBy, StationSection};
use crate::exit;
use crate::gateway;
use crate::hands::Hands;
use crate::kept::{Keeping, Kept, KeptFile};
use crate::mission::Mission;
use crate::runtime::RuntimeFolder;
use crate::signals::Signals;
use crate::state::{self, StateFolder, World};
use crate::station;
use crate::stop;
use crate::terminal::Terminal;
use crate::voice;
use external::External;
use robot::Robot;

/// Runs until Ctrl-C, or until the mission has ended when that was asked for.
pub fn run(mut config: Config, args: &UpArgs) -> Result<ExitCode> {
    let signals = Signals::listen()?;
    apply(&mut config, args)?;
    config.validate()?;
    let state = StateFolder::of_robot(&config)?;
    let mut notes = choose_warehouse(&mut config, &state)?;
    let products = products(&config, args)?;
    if args.script {
        // Nobody is to be in its way, so nobody is there who would move the arm.
        config.logic.pick.get_or_insert(PickBy::Auto);
    }
    rehearse(&config)?;

    let folder = RuntimeFolder::create(&config)?;
    let mut lock = folder.lock()?;
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
    state.make()?;
    let _tidy = Tidy(&state);
    let world = run_in_copy(&mut config, &state)?;
    config.station.queue = Some(match args.exit_when_done {
        true => folder.queue(),
        false => config.station.queue.take().unwrap_or_else(|| state.queue()),
    });
    let mut external = external::choose(&mut config, &mut lock, args.headless)?;
    if external.listener.is_none() {
        // What somebody else keeps is not known here.
        (config.station.warehouse, config.station.queue) = (None, None);
    }
    external.gateway = gateway::promise(&config)?;
    folder.write_config(&config)?;
    let mut kept: Kept = state::read_kept(&state.orders(), &mut notes)?;
    if args.exit_when_done && !kept.is_nothing() {
        // A script does what it is told, and leaves the rest to whoever drives next.
        notes
            .push("the orders that wait from before are left for an `up` that is no script".into());
        kept = Kept::default();
    }
    let mission = ordered(&config, &external, products, args, &mut kept)?;
    notes.extend(kept.sentence());

    stop::at_start(&config)?;
    let terminal = Terminal::new(args.json, voice::are_traced(&config.log))?;
    let mut robot = Robot::new(config, lock, external, mission, signals, terminal)?;
    (robot.first_notes, robot.world) = (notes, world);
    if !args.exit_when_done {
        robot.keeping = Keeping::new(kept, KeptFile::new(state.orders()));
    }
    let ran = robot.run(args.exit_when_done);
    let outcome = robot.finish(args.exit_when_done, args.json);
    ran?;
    Ok(if outcome?.failure.is_some() {
        exit::not_delivered()
    } else {
        ExitCode::SUCCESS
    })
}

/// Leaves nothing in the state folder that is of no use to the next `up`.
struct Tidy<'a>(&'a StateFolder);

impl Drop for Tidy<'_> {
    fn drop(&mut self) {
        self.0.tidy();
    }
}

/// Has the robot run in a copy of its warehouse's file, so that a process that is started again
/// finds the world as it is now. A built-in one needs none.
fn run_in_copy(config: &mut Config, state: &StateFolder) -> Result<Option<World>> {
    if Warehouse::builtin(&config.warehouse).is_some() {
        return Ok(None);
    }
    let world = World {
        folder: state.clone(),
        warehouse: config.warehouse()?,
    };
    config.warehouse = world.write()?.display().to_string();
    Ok(Some(world))
}

/// Chooses the warehouse, and where its changes are kept; what to tell people of it.
fn choose_warehouse(config: &mut Config, state: &StateFolder) -> Result<Vec<String>> {
    if config.station.warehouse.is_none() {
        config.station.warehouse = Some(state.warehouse(&config.warehouse)?);
    }
    let (saved, note) = state.saved(&config.warehouse);
    if let Some(saved) = saved {
        config.warehouse = saved;
    }
    Ok(note.into_iter().collect())
}

/// What the robot is to fetch from the start, if anybody is to see to that. Real boards do not move
/// off by themselves: there somebody has to ask for it twice.
fn products(config: &Config, args: &UpArgs) -> Result<Option<Vec<i32>>> {
    let warehouse = config.warehouse()?;
    if config.station.wanted && config.station.address.is_some() {
        numbers_only(&args.mission)?;
    }
    let mission = mission(&warehouse, &args.mission)?;
    let usage = |why: &str| exit::Usage(why.to_owned());
    if config.body != Body::Serial {
        let is_elsewhere = config.station.wanted && config.station.address.is_some();
        // Whoever has the station orders there.
        return match (is_elsewhere && args.mission.is_empty(), args.exit_when_done) {
            (true, true) => bail!(usage(
                "--exit-when-done waits for the end of a mission; with the station of somebody else there is one with --mission"
            )),
            (true, false) => Ok(Some(Vec::new())),
            (false, _) => Ok(Some(mission)),
        };
    }
    match (args.script, args.mission.is_empty()) {
        (true, false) => Ok(Some(mission)),
        (true, true) => {
            bail!(usage(
                "on real boards --script needs --mission: say what it is to fetch"
            ))
        }
        (false, false) => bail!(usage(
            "on real boards --mission needs --script: then the robot drives by itself, and nobody may be in its way"
        )),
        (false, true) if args.exit_when_done => bail!(usage(
            "--exit-when-done waits for the end of a mission; on real boards there is one with --script and --mission"
        )),
        (false, true) => Ok(None),
    }
}

/// Puts what is to be fetched into the queue of the robot's own station. Where there is none, the
/// robot's own queue is given it. What waits from before goes first, in the robot's own queue; the
/// first product of the warehouse is fetched only if nothing else is to be. Real boards carry out
/// what somebody orders, and that is counted.
fn ordered(
    config: &Config,
    external: &External,
    mut products: Option<Vec<i32>>,
    args: &UpArgs,
    kept: &mut Kept,
) -> Result<Mission> {
    let known: Vec<i32> = config
        .warehouse()?
        .products
        .iter()
        .map(|it| it.id)
        .collect();
    kept.orders.retain(|order| known.contains(&order.product));
    if config.body != Body::Serial {
        // Its world is a new one.
        kept.gone.clear();
    }
    let is_own = external.listener.is_some();
    let waited = match is_own && !args.exit_when_done {
        true => station::waits(config)?,
        false => Vec::new(),
    };
    let mut waiting = kept.add(&waited);
    if args.mission.is_empty() && !kept.orders.is_empty() {
        products = products.map(|_| Vec::new());
    }
    let wanted = products.clone().unwrap_or_default();
    waiting.extend(wanted.iter().filter(|product| !kept.has(**product)));
    if is_own {
        station::prepare(config, &waiting)?;
    }
    Ok(match products {
        None => Mission::of_others(),
        Some(products) if is_own => Mission::of_station(&products),
        Some(products) => {
            let mut mission = Mission::of_robot(&products, Hands::fresh_id());
            mission.leave(|product| kept.has(product));
            mission
        }
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

/// The products to fetch: those asked for, or the warehouse's first.
pub fn mission(warehouse: &Warehouse, wanted: &[Called]) -> Result<Vec<i32>> {
    let known = warehouse.products.iter();
    let known = known.map(|product| (product.id, product.name.as_deref()));
    let found = wanted.iter().map(|called| called.among(known.clone()));
    let found: Result<Vec<_>, _> = found.collect();
    let found = found.map_err(|unknown| exit::Usage(format!("--mission: {unknown}")))?;
    if wanted.len() > lager_station::Robot::MOST_PRODUCTS {
        bail!(exit::Usage(format!(
            "--mission: at most {} products wait in a queue",
            lager_station::Robot::MOST_PRODUCTS
        )));
    }
    for (place, called) in wanted.iter().enumerate() {
        let is_it = |id: &ProductId| Some(id) == found.get(place);
        if found[..place].iter().any(is_it) {
            bail!(exit::Usage(format!(
                "--mission: product {called} is named twice; there is one piece of goods for each number, so each is fetched once"
            )));
        }
    }
    if wanted.is_empty() {
        return Ok(known.take(1).map(|(id, _)| id).collect());
    }
    Ok(found.into_iter().map(ProductId::get).collect())
}

/// Somebody else's station may call other goods so.
fn numbers_only(wanted: &[Called]) -> Result<()> {
    let is_name = |called: &&Called| matches!(called, Called::Name(_));
    match wanted.iter().find(is_name) {
        Some(name) => bail!(exit::Usage(format!(
            "--mission: the external computer is not the robot's own, so it is not known here what {name} is; give the number"
        ))),
        None => Ok(()),
    }
}

/// Puts the command line's wishes over the configuration's.
fn apply(config: &mut Config, args: &UpArgs) -> Result<()> {
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
        if let Some(Body::Sim | Body::Chip) = args.body {
            let refused = "--sensor and --steering are the ports of real boards, and the --body asked for has its own; leave one of them out";
            bail!(exit::Usage(refused.into()));
        }
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
    if let Some(obstacles) = args.obstacles {
        config.simulator.obstacles = obstacles;
    }
    if let Some(speed) = args.speed {
        config.speed = speed;
    }
    if args.no_station {
        config.station.wanted = false;
    }
    if let Some(address) = &args.station {
        config.station = StationSection {
            address: Some(address.clone()),
            ..StationSection::default()
        };
    }
    if args.listen.is_some() || args.gag.is_some() {
        // Both are those of a station that is started here.
        config.station.wanted = true;
        config.station.address = None;
    }
    if let Some(listen) = args.listen {
        config.station.listen = Some(listen);
    }
    if let Some(gag) = &args.gag {
        config.station.gag = Some(std::path::absolute(gag)?);
    }
    if let Some(secret) = &args.secret {
        config.comm.secret = Some(secret.clone());
    }
    if let Some(panel) = args.panel {
        config.station.panel = Some(panel);
    }
    config.gateway.metrics = args.metrics.or(config.gateway.metrics);
    config.gateway.foxglove = args.foxglove.or(config.gateway.foxglove);
    args.realtime.apply(&mut config.realtime);
    Ok(())
}
