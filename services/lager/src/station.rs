//! `lager station`: runs the external computer in this process, until somebody ends it.
//!
//! Started alone it listens where its user says. Started by `lager up`, its standard output is the
//! socket for robots. `state_folder.rs` of the supervisor says where it keeps the warehouse and the
//! orders.

use std::net::{SocketAddr, TcpListener};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use lager_comm::secrets_at;
use lager_home::LONGEST_SOCKET;
use lager_lines::Name;
use lager_lines::secret::Secrets;
use lager_orders::{Code, Reason};
use lager_panel::{Panel, Tokens, World};
use lager_plant::Warehouse;
use lager_station::files::Hold;
use lager_station::{History, Listen, Queues, Server, ServerConfig};
use lager_supervisor::children::adopt;
use lager_supervisor::console;
use lager_supervisor::runtime_folder::{GAG, RuntimeFolder};
use lager_supervisor::state_folder::StateFolder;
use lager_supervisor::{Service, ServiceManager};
use lager_wake::Shutdown;

use crate::cli::StationArgs;
use crate::config::{Body, Config, StationSection};
use crate::goods;
use crate::reach;

/// The station's name towards robots.
const NAME: &str = "station";

/// Runs it.
///
/// # Errors
/// An address, a socket or the warehouse is not available; the sentence says what to do.
pub fn run(config: &Config, args: &StationArgs, shutdown: &Shutdown) -> Result<()> {
    let (mut server, panel) = match args.parent {
        Some(parent) => {
            adopt(parent, shutdown)?;
            let mut server = Server::open(supervised(config)?)?;
            let life = RuntimeFolder::live_as(&config.bus()?, Service::Station)?;
            server.each_turn(move || life.goes_on());
            let panel = config.station.panel.and_then(|address| {
                // The station serves robots, whoever looks at the panel.
                let panel = tokens(config).and_then(|tokens| {
                    let panel = Panel::open(address, tokens, server.handle())?;
                    Ok(match config.body {
                        Body::Serial => panel,
                        Body::Sim | Body::Chip => panel.with_world(world(config)?),
                    })
                });
                panel.inspect_err(|error| tracing::warn!("{error:#}")).ok()
            });
            (server, panel)
        }
        None => alone(config, args)?,
    };
    if let Some(panel) = panel {
        let end = shutdown.flag();
        let run = move || {
            if let Err(error) = panel.run(&end) {
                tracing::warn!("{error}");
            }
        };
        std::thread::Builder::new()
            .name("panel".into())
            .spawn(run)?;
    }
    // `up` tells the service manager of its own station.
    let manager = match args.parent {
        Some(_) => None,
        None => Some(announce(&mut server)?),
    };
    let served = server.run(&shutdown.flag());
    if let Some(manager) = manager {
        manager.stopping();
    }
    Ok(served?)
}

/// Tells the service manager that the station is ready, and from then on that it goes on.
fn announce(server: &mut Server) -> Result<ServiceManager> {
    let mut manager = ServiceManager::of_this_process()?;
    manager.ready();
    let robots = reach::listed(server.address()?, |at| at.to_string());
    manager.status(&format!("robots connect to {robots}"));
    let mut fed = manager.clone();
    server.each_turn(move || fed.goes_on());
    Ok(manager)
}

/// The configuration with the warehouse that the station has saved, if a world can be made of it.
///
/// # Errors
/// There is none.
pub fn saved(config: &Config) -> Result<Config> {
    let file = config.station.warehouse.as_ref();
    let file = file.context("the station keeps no warehouse")?;
    let config = Config {
        warehouse: Some(file.display().to_string()),
        ..config.clone()
    };
    config.warehouse()?;
    Ok(config)
}

/// The simulated world of the robot that `up` runs beside this station.
fn world(config: &Config) -> Result<World> {
    let robot = Name::new(config.name.clone())?;
    let config = config.clone();
    let renew = move || -> Result<()> {
        saved(&config)?;
        RuntimeFolder::ask_to_start_again(&config.bus()?)
    };
    Ok(World::new(robot, move || {
        renew().map_err(|error| Reason::new(Code::FloorUnfit, &[&format!("{error:#}")]))
    }))
}

/// Started by a person.
fn alone(config: &Config, args: &StationArgs) -> Result<(Server, Option<Panel>)> {
    let gag = match &args.gag {
        Some(path) => path.clone(),
        None => default_gag(config)?,
    };
    let orders = args.fetch.iter();
    let orders = orders.flat_map(|fetch| {
        fetch
            .products
            .iter()
            .map(|it| (fetch.robot.clone(), it.clone()))
    });
    let (path, otherwise) = own_warehouse(config, args.warehouse.as_deref())?;
    let told = warehouse(&path, args.warehouse.as_deref(), otherwise.is_some());
    let server = Server::open(ServerConfig {
        name: name()?,
        listen: Listen::At(args.listen),
        secrets: match &args.robots_secret {
            Some(file) => secrets_at(file)?,
            None => Secrets::default(),
        },
        gag: Some(gag.clone()),
        queues: Some(Queues::beside(&path)),
        history: (!args.no_history).then(|| History::beside(&path)),
        warehouse: Some(path),
        otherwise,
        fetch: orders.collect(),
    })?;
    console::print(&format!(
        "robots connect to {}, a GaG to {}; {told}; {}",
        reach::listed(server.address()?, |at| at.to_string()),
        gag.display(),
        match args.robots_secret {
            Some(_) => "robots prove who they are",
            None =>
                "the station believes every robot's name; with --robots-secret FILE robots prove their names",
        },
    ))?;
    let panel = match args.no_panel {
        true => None,
        false => Some(panel(args.panel, &server)?),
    };
    Ok((server, panel))
}

/// The panel of a station that runs by itself, and its addresses.
fn panel(address: Option<SocketAddr>, server: &Server) -> Result<Panel> {
    let address = match address {
        Some(address) => address,
        None => usual_panel()?,
    };
    let tokens = Tokens::random()?;
    let panel = Panel::open(address, tokens.clone(), server.handle())?;
    let at = panel.address()?;
    console::print(&format!(
        "the panel is at {} for who drives, and at {} for who looks and stops",
        page_at(at, &tokens.driver),
        page_at(at, &tokens.viewer)
    ))?;
    Ok(panel)
}

/// The tokens of the panel of the robot's own station. They come from the secret in the robot's
/// folder, so they stay the same while `up` runs, even if the station is replaced.
///
/// # Errors
/// There is no such secret.
pub fn tokens(config: &Config) -> Result<Tokens> {
    let secrets = secrets_at(&RuntimeFolder::secret(&config.bus()?)?)?;
    Ok(Tokens::of(
        secrets
            .of_all()
            .context("the robot's folder has no secret")?,
    ))
}

/// The address of a page that lets in whoever has `token`.
pub fn page_at(address: SocketAddr, token: &str) -> String {
    reach::listed(address, |at| format!("http://{at}/?token={token}"))
}

/// Where a panel answers on this machine by default: at the usual address, or at a free port.
///
/// # Errors
/// There is no port.
pub fn usual_panel() -> Result<SocketAddr> {
    // The panel opens it again in a moment, and reports it if the port is lost in between.
    let socket = TcpListener::bind(StationSection::USUAL_PANEL)
        .or_else(|_| TcpListener::bind("127.0.0.1:0"))?;
    Ok(socket.local_addr()?)
}

/// The orders that an earlier station of this robot had not given it yet.
///
/// # Errors
/// The file exists and cannot be read.
pub fn waits(config: &Config) -> Result<Vec<i32>> {
    let Some(queue) = &config.station.queue else {
        return Ok(Vec::new());
    };
    let mut queues = Queues::load(queue)?;
    Ok(queues.0.remove(&config.name).unwrap_or_default())
}

/// Writes the queues with which the station of `lager up` begins: the orders of this robot, and
/// those of other robots of the same station.
///
/// # Errors
/// The disk refuses the file, or another station keeps the same warehouse.
pub fn prepare(config: &Config, products: &[i32]) -> Result<()> {
    let section = &config.station;
    if let Some(warehouse) = &section.warehouse {
        // The station takes the lock for good; here the user still sees the error.
        Hold::of(warehouse)?;
    }
    let Some(queue) = &section.queue else {
        return Ok(());
    };
    let mut queues = Queues::load(queue)?;
    let name = config.name.clone();
    match products {
        [] => queues.0.remove(&name),
        products => queues.0.insert(name, products.to_vec()),
    };
    queues.save(queue)?;
    Ok(())
}

/// Started by `lager up`: begins with the prepared queues, or with those that the station before
/// saved.
fn supervised(config: &Config) -> Result<ServerConfig> {
    let robots = std::io::stdout().as_fd().try_clone_to_owned()?;
    let gag = match &config.station.gag {
        Some(gag) => gag.clone(),
        None => RuntimeFolder::gag(&config.bus()?)?,
    };
    let fits = fits(&gag);
    if let Err(why) = &fits {
        tracing::warn!("no GaG can connect: {why}");
    }
    Ok(ServerConfig {
        name: name()?,
        listen: Listen::On(TcpListener::from(robots)),
        secrets: match &config.comm.secret {
            Some(file) => secrets_at(file)?,
            None => bail!("a station that `up` has started is told no secret of its robot"),
        },
        gag: fits.is_ok().then_some(gag),
        warehouse: config.station.warehouse.clone(),
        otherwise: goods::configured(config)?,
        queues: config.station.queue.clone(),
        history: match config.station.history {
            true => Some(StateFolder::of_robot(&config.state_root()?, &config.name).history()),
            false => None,
        },
        fetch: Vec::new(),
    })
}

/// The warehouse of a station that runs by itself: its file, and the warehouse to use while there
/// is no file.
fn own_warehouse(config: &Config, named: Option<&str>) -> Result<(PathBuf, Option<Warehouse>)> {
    let Some(name) = named else {
        let folder = StateFolder::of_station(&config.state_root()?)?;
        return Ok((folder.warehouse(None), None));
    };
    let builtin = Warehouse::builtin(name);
    let path = match builtin {
        Some(_) => StateFolder::of_station(&config.state_root()?)?.warehouse(Some(name)),
        None => PathBuf::from(name),
    };
    Ok((path, builtin))
}

/// Refuses a path that is too long for a socket.
///
/// # Errors
/// It is too long.
pub fn fits(gag: &Path) -> Result<()> {
    let length = gag.as_os_str().len();
    if length > LONGEST_SOCKET {
        bail!(
            "{} has {length} bytes, and the path of a socket has {LONGEST_SOCKET} at most",
            gag.display()
        );
    }
    Ok(())
}

fn name() -> Result<Name> {
    Name::new(NAME).context("the station's name")
}

/// Where a GaG connects to a station by default.
///
/// # Errors
/// The folder of the bus cannot be found.
pub fn default_gag(config: &Config) -> Result<PathBuf> {
    Ok(config.bus()?.home()?.folder().join(GAG))
}

/// What the station knows of the warehouse, as the end of a sentence.
fn warehouse(path: &Path, named: Option<&str>, is_built_in: bool) -> String {
    let at = path.display();
    match (path.exists(), named.filter(|_| is_built_in)) {
        (true, None) => format!("the warehouse is {at}"),
        (true, Some(name)) => {
            format!("the warehouse is {at}, where the built-in `{name}` was saved with changes")
        }
        (false, Some(name)) => {
            format!("the warehouse is the built-in `{name}`, whose changes are saved in {at}")
        }
        (false, None) => format!(
            "there is no {at} yet: a GaG or the panel describes the warehouse, which is saved there"
        ),
    }
}
