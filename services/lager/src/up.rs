//! `lager up`: the whole robot on this machine, as supervised processes that meet on the bus.
//!
//! This file puts together what the robot starts with; `lager-supervisor` starts it and watches it.

mod external;

use std::path;
use std::process::ExitCode;

use anyhow::{Result, bail};
use lager_floor::ProductId;
use lager_home::Clock;
use lager_lines::Called;
use lager_operator::Ids;
use lager_orders::Pick;
use lager_plant::Warehouse;
use lager_supervisor::kept_orders::{Keeping, KeptFile, KeptOrders};
use lager_supervisor::mission::Mission;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_supervisor::signals::Signals;
use lager_supervisor::state_folder::{self, StateFolder, WarehouseCopy};
use lager_supervisor::{Plan, Renewed, Robot, Service, Terminal};
use lager_topics::Role;

use crate::cli::UpArgs;
use crate::config::{self, Body, ChipSection, Config, StationSection};
use crate::exit;
use crate::gateway;
use crate::station;
use crate::stop;
use crate::traces;
use external::External;

/// Runs until Ctrl-C, or with `--exit-when-done` until the mission has ended.
pub fn run(mut config: Config, args: &UpArgs) -> Result<ExitCode> {
    let signals = Signals::listen()?;
    apply(&mut config, args)?;
    let undescribed = config.clone();
    config.describe()?;
    config.validate()?;
    // Tools find these again in whatever folder and environment they run.
    config.state = Some(config.state_root()?);
    config.robot = config.robot.as_ref().map(path::absolute).transpose()?;
    let state = StateFolder::of_robot(&config.state_root()?, &config.name);
    let mut notes = choose_warehouse(&mut config, &state)?;
    let products = products(&config, args)?;
    if args.script {
        // Nobody may be in its way, so nobody is there to move the arm.
        config.logic.pick.get_or_insert(Pick::Auto);
    }
    rehearse(&config)?;

    let folder = RuntimeFolder::create(&config.bus()?)?;
    let mut lock = folder.lock()?;
    if config.body != Body::Serial {
        config.serial.sensor = Some(folder.sensor_port());
        config.serial.steering = Some(folder.steering_port());
    }
    match config.body {
        Body::Sim => {
            config.chip.clock = None;
            if config.chip.eeprom.is_none() {
                config.chip.eeprom = Some(folder.fresh_eeproms()?);
            }
        }
        Body::Chip => equip(&mut config, &folder)?,
        // The ports may belong to an emulator that somebody else runs.
        Body::Serial => {}
    }
    state.make()?;
    let _tidy = Tidy(&state);
    let warehouse = run_in_copy(&mut config, &state)?;
    config.station.queue = Some(match args.exit_when_done {
        true => folder.queue(),
        false => config.station.queue.take().unwrap_or_else(|| state.queue()),
    });
    let mut external = external::choose(&mut config, &mut lock, args.headless)?;
    if external.listener.is_none() {
        // Nobody here knows what somebody else's station keeps.
        (config.station.warehouse, config.station.queue) = (None, None);
    }
    external.gateway = gateway::promise(&config)?;
    let text = toml::to_string(&config)?;
    folder.write_config(&text)?;
    let mut kept: KeptOrders = state_folder::read_kept(&state.orders(), &mut notes)?;
    if args.exit_when_done && !kept.is_nothing() {
        // A script carries out only its own orders, and leaves the others to a later `up`.
        notes
            .push("the orders that wait from before stay for a later `up` without --script".into());
        kept = KeptOrders::default();
    }
    let mission = ordered(&config, &external, products, args, &mut kept)?;
    notes.extend(kept.sentence());
    notes.extend(how_it_starts(&config));

    stop::at_start(&config)?;
    let terminal = Terminal::new(args.json, traces::are_shown(&config.log))?;
    let talkers = [
        (external.listener.is_some(), Service::Station),
        (config.station.wanted, Service::Comm),
        (config.gateway.is_wanted(), Service::Gateway),
    ];
    let told = [first_line(&config, args)?, external.told].into_iter();
    let told = told.chain(external.panel).chain(external.gateway);
    let renewal = (!args.exit_when_done).then(|| renewal(undescribed, &config, &state));
    let plan = Plan {
        config: text,
        bus: config.bus()?,
        body: config.body.service(),
        talkers: talkers
            .into_iter()
            .filter_map(|(is_wanted, service)| is_wanted.then_some(service))
            .collect(),
        listener: external.listener,
        eeprom: config.chip.eeprom,
        warehouse,
        renewal,
        mission,
        keeping: match args.exit_when_done {
            true => Keeping::default(),
            false => Keeping::new(kept, KeptFile::new(state.orders())),
        },
        first_notes: told.chain(notes).collect(),
        exit_when_done: args.exit_when_done,
    };
    let mut robot = Robot::new(plan, lock, signals, terminal)?;
    let ran = robot.run();
    let delivered = robot.finish(args.json);
    ran?;
    Ok(match delivered? {
        true => ExitCode::SUCCESS,
        false => exit::not_delivered(),
    })
}

/// The first line: how the robot ends, and what a person who has just started it can try.
fn first_line(config: &Config, args: &UpArgs) -> Result<String> {
    if args.exit_when_done {
        return Ok("the robot ends with its mission, and with Ctrl-C before that".into());
    }
    let lager = match config.name == Config::default().name {
        true => "lager".to_owned(),
        false => format!("lager --name {}", config.name),
    };
    let panel = match config.station.panel {
        Some(_) => "open the panel in a browser, or ",
        None => "",
    };
    let warehouse = config.known_warehouse()?;
    let products = warehouse.map_or_else(Vec::new, |warehouse| warehouse.products);
    // The first one is fetched already where nobody says otherwise.
    let fetch = products.get(1).or(products.first());
    let fetch = fetch.map(|product| format!("`{lager} fetch {}`, ", product.id));
    Ok(format!(
        "Ctrl-C ends the robot; {panel}try in a second terminal: `{lager} top`, {}`{lager} stop`, `lager --help`",
        fetch.unwrap_or_default()
    ))
}

/// How real boards begin without a shell.
fn how_it_starts(config: &Config) -> Vec<String> {
    let mut notes = Vec::new();
    if config.body != Body::Serial {
        return notes;
    }
    if config.warehouse_name().is_none() {
        notes
            .push("the robot waits for a warehouse: set one up at the panel, which is kept".into());
    }
    let buttons = config.buttons.lines();
    if buttons.is_some_and(|buttons| buttons.reset.is_some() && buttons.reset_starts) {
        notes.push(
            "real boards start stopped: put the robot on the delivery node, looking into the warehouse, and press reset"
                .into(),
        );
    }
    notes
}

/// Removes from the state folder what the next `up` does not need.
struct Tidy<'a>(&'a StateFolder);

impl Drop for Tidy<'_> {
    fn drop(&mut self) {
        self.0.tidy();
    }
}

/// Runs the robot in a copy of its warehouse's file, so that a service that starts again finds the
/// same world. A built-in warehouse needs no copy, and neither does one that is not there yet.
fn run_in_copy(config: &mut Config, state: &StateFolder) -> Result<Option<WarehouseCopy>> {
    let name = config.warehouse_name();
    if name.is_none_or(|name| Warehouse::builtin(name).is_some()) {
        return Ok(None);
    }
    let copy = WarehouseCopy {
        folder: state.clone(),
        text: toml::to_string(&config.warehouse()?)?,
    };
    config.warehouse = Some(copy.write()?.display().to_string());
    Ok(Some(copy))
}

/// Finds out with what the robot starts again: the description that is saved and, if it is
/// simulated, the warehouse that its own station has saved. Real boards have learnt that already.
fn renewal(
    undescribed: Config,
    config: &Config,
    state: &StateFolder,
) -> Box<dyn Fn() -> Result<Renewed>> {
    let (config, state) = (config.clone(), state.clone());
    Box::new(move || {
        let mut config = config.described_anew(&undescribed)?;
        let kept = config.station.warehouse.as_ref();
        let has_another = config.body != Body::Serial && kept.is_some_and(|kept| kept.exists());
        if has_another {
            config = station::saved(&config)?;
        }
        let warehouse = run_in_copy(&mut config, &state)?;
        // The copy's, whatever somebody saves at this moment.
        let products = match has_another {
            true => Some(config.warehouse()?.products),
            false => None,
        };
        Ok(Renewed {
            config: toml::to_string(&config)?,
            warehouse,
            products: products.map(|all| all.iter().map(|product| product.id).collect()),
        })
    })
}

/// Chooses the warehouse, and where its changes are kept. Returns what people should know of it.
fn choose_warehouse(config: &mut Config, state: &StateFolder) -> Result<Vec<String>> {
    let name = config.warehouse_name().map(str::to_owned);
    let file = name
        .as_deref()
        .filter(|name| Warehouse::builtin(name).is_none());
    let keeps = &mut config.station.warehouse;
    if let Some(file) = file {
        if keeps.is_none() {
            *keeps = Some(std::path::absolute(file)?);
        }
        return Ok(Vec::new());
    }
    let builtin = name.as_deref();
    keeps.get_or_insert_with(|| state.warehouse(builtin));
    let (saved, note) = state.saved(builtin, |file| config::warehouse(file).map(drop));
    if let Some(saved) = saved {
        config.warehouse = Some(saved);
    }
    Ok(note.into_iter().collect())
}

/// The orders with which the robot starts, if `up` gives any. Real boards do not move off by
/// themselves: a person must ask for it with two flags.
fn products(config: &Config, args: &UpArgs) -> Result<Option<Vec<i32>>> {
    if config.station.wanted && config.station.address.is_some() {
        numbers_only(&args.mission)?;
    }
    let usage = |why: &str| exit::Usage(why.to_owned());
    let mission = || mission(&config.warehouse()?, &args.mission);
    if config.body != Body::Serial {
        let is_elsewhere = config.station.wanted && config.station.address.is_some();
        // The person who has the station gives orders there.
        return match (is_elsewhere && args.mission.is_empty(), args.exit_when_done) {
            (true, true) => bail!(usage(
                "--exit-when-done waits for the end of a mission; with the station of somebody else there is one with --mission"
            )),
            (true, false) => Ok(Some(Vec::new())),
            (false, _) => mission().map(Some),
        };
    }
    match (args.script, args.mission.is_empty()) {
        (true, false) => mission().map(Some),
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

/// Puts the orders into the queue of the robot's own station, or into the robot's own queue if it
/// has no station. Orders from before come first, in the robot's own queue. Without any other order
/// the robot fetches the first product of the warehouse. Real boards carry out what somebody
/// orders, and that is counted.
fn ordered(
    config: &Config,
    external: &External,
    mut products: Option<Vec<i32>>,
    args: &UpArgs,
    kept: &mut KeptOrders,
) -> Result<Mission> {
    // Orders for goods that are not there any more go. A robot without a warehouse keeps them all.
    if let Some(warehouse) = config.known_warehouse()? {
        let is_known = |id| warehouse.products.iter().any(|product| product.id == id);
        kept.orders.retain(|order| is_known(order.product));
    }
    if config.body != Body::Serial {
        // The world of a simulated robot is new.
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
            let first = Ids::default().fresh(Clock::monotonic_ns());
            let mut mission = Mission::of_robot(&products, first);
            mission.leave(|product| kept.has(product));
            mission
        }
    })
}

/// Refuses, before anything runs, what the machine would refuse to the services at every start.
fn rehearse(config: &Config) -> Result<()> {
    let roles = [Role::Bridge, Role::Logic, Role::Simulator]
        .map(|role| (role, config.realtime.wanted(role)));
    config.refuse_starvation(&roles)?;
    for (_, wanted) in &roles {
        wanted.rehearse()?;
    }
    Ok(())
}

/// Chooses the places of an emulated body's files, and checks that no file is missing.
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

/// The products to fetch: those of `--mission`, or the warehouse's first.
pub fn mission(warehouse: &Warehouse, wanted: &[Called]) -> Result<Vec<i32>> {
    let known = warehouse.products.iter();
    let known = known.map(|product| (product.id, product.name.as_deref()));
    let found = wanted.iter().map(|called| called.among(known.clone()));
    let found: Result<Vec<_>, _> = found.collect();
    let found = found.map_err(|unknown| exit::Usage(format!("--mission: {unknown}")))?;
    if wanted.len() > lager_station::Robot::MOST_PRODUCTS {
        bail!(exit::Usage(format!(
            "--mission: at most {} goods wait in a queue",
            lager_station::Robot::MOST_PRODUCTS
        )));
    }
    for (place, called) in wanted.iter().enumerate() {
        let is_it = |id: &ProductId| Some(id) == found.get(place);
        if found[..place].iter().any(is_it) {
            bail!(exit::Usage(format!(
                "--mission: goods {called} are named twice; there is one piece of goods for each number, so each is fetched once"
            )));
        }
    }
    if wanted.is_empty() {
        return Ok(known.take(1).map(|(id, _)| id).collect());
    }
    Ok(found.into_iter().map(ProductId::get).collect())
}

/// Refuses names for somebody else's station: it may use them for other goods.
fn numbers_only(wanted: &[Called]) -> Result<()> {
    let is_name = |called: &&Called| matches!(called, Called::Name(_));
    match wanted.iter().find(is_name) {
        Some(name) => bail!(exit::Usage(format!(
            "--mission: the external computer is not the robot's own, so it is not known here what {name} is; give the number"
        ))),
        None => Ok(()),
    }
}

/// Lets the flags of the command line replace values of the configuration.
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
    if args.sensor.is_some() {
        config.serial.sensor.clone_from(&args.sensor);
    }
    if args.steering.is_some() {
        config.serial.steering.clone_from(&args.steering);
    }
    if let Some(baud) = args.baud {
        config.serial.baud = baud;
    }
    if let Some(warehouse) = &args.warehouse {
        config.warehouse = Some(warehouse.clone());
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
        // Both flags are for a station that `up` starts.
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
    if let Some(endpoint) = &args.zenoh {
        config.gateway.zenoh.endpoint = Some(endpoint.clone());
    }
    args.realtime.apply(&mut config.realtime);
    Ok(())
}
