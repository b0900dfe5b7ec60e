//! `lager station`: the external computer in this process, until it is told to end.
//!
//! Alone it listens where it is told. As a child of `lager up` its standard output is the socket at
//! which robots connect, and what it keeps lies in the robot's folder.

use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpListener};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use lager_lines::Name;
use lager_panel::{Panel, PanelError, Tokens};
use lager_ports::Shutdown;
use lager_station::{Listen, Queues, Server, ServerConfig, save};

use crate::cli::StationArgs;
use crate::config::{Config, StationSection};
use crate::goods;
use crate::reach;
use crate::runtime::RuntimeFolder;
use crate::services::Service;
use crate::supervisor;

/// What a station calls itself towards robots.
const NAME: &str = "station";

/// Where a GaG connects unless somebody says otherwise, in the folder of the bus.
const GAG: &str = "gag";

/// The longest path of a socket, in bytes.
const LONGEST_SOCKET: usize = 107;

/// Runs it.
///
/// # Errors
/// An address, a socket or the warehouse cannot be had; the sentence says what to do.
pub fn run(config: &Config, args: &StationArgs, shutdown: &Shutdown) -> Result<()> {
    let (server, panel) = match args.parent {
        Some(parent) => {
            supervisor::adopt(parent, shutdown)?;
            let mut server = Server::open(supervised(config)?)?;
            let life = RuntimeFolder::live_as(config, Service::Station)?;
            server.each_turn(move || life.goes_on());
            let panel = config.station.panel.and_then(|address| {
                // Robots are served, whoever looks.
                let panel = Panel::open(address, None, server.handle());
                panel.inspect_err(|error| tracing::warn!("{error}")).ok()
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
    server.run(&shutdown.flag())?;
    Ok(())
}

/// As somebody has started it.
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
    let server = Server::open(ServerConfig {
        name: name()?,
        listen: Listen::At(args.listen),
        gag: Some(gag.clone()),
        warehouse: args.warehouse.clone(),
        fetch: orders.collect(),
    })?;
    crate::say(&format!(
        "robots connect to {}, a GaG to {}; {}",
        reach::listed(server.address()?, |at| at.to_string()),
        gag.display(),
        warehouse(args.warehouse.as_deref()),
    ))?;
    let panel = match args.no_panel {
        true => None,
        false => Some(panel(args.panel, &server)?),
    };
    Ok((server, panel))
}

/// The panel of a station that runs by itself, and where it is.
fn panel(address: Option<SocketAddr>, server: &Server) -> Result<Panel> {
    let address = match address {
        Some(address) => address,
        None => usual_panel()?,
    };
    if address.ip().is_loopback() {
        let panel = Panel::open(address, None, server.handle())?;
        crate::say(&format!("the panel is at http://{}", panel.address()?))?;
        return Ok(panel);
    }
    let tokens = Tokens::random()?;
    let panel = Panel::open(address, Some(tokens.clone()), server.handle())?;
    let at = |token: &str| {
        let page = |at| format!("http://{at}/?token={token}");
        Ok::<_, PanelError>(reach::listed(
            panel.address().map_err(PanelError::Run)?,
            page,
        ))
    };
    crate::say(&format!(
        "the panel is at {} for who drives, and at {} for who looks and stops",
        at(&tokens.driver)?,
        at(&tokens.viewer)?
    ))?;
    Ok(panel)
}

/// Where a panel answers on this machine if nobody says: the usual address, or a port that is free.
///
/// # Errors
/// There is no port.
pub fn usual_panel() -> Result<SocketAddr> {
    // It is opened again in a moment: a panel whose port is lost in between is told.
    let socket = TcpListener::bind(StationSection::USUAL_PANEL)
        .or_else(|_| TcpListener::bind("127.0.0.1:0"))?;
    Ok(socket.local_addr()?)
}

/// Writes what the station that `lager up` starts begins with: the robot's warehouse, and what the
/// robot is to fetch.
///
/// # Errors
/// The robot's folder does not take it.
pub fn prepare(config: &Config, products: &[i32]) -> Result<()> {
    let kept = RuntimeFolder::warehouse(config)?;
    save(&kept, &goods::configured(config)?)?;
    let queue = BTreeMap::from([(config.name.clone(), products.to_vec())]);
    Queues(queue).save(&Queues::beside(&kept))?;
    Ok(())
}

/// As `lager up` has started it: with what was prepared, or what the one before it has saved.
fn supervised(config: &Config) -> Result<ServerConfig> {
    let robots = std::io::stdout().as_fd().try_clone_to_owned()?;
    let kept = RuntimeFolder::warehouse(config)?;
    if !kept.exists() {
        // The robot's folder was removed.
        prepare(config, &[])?;
    }
    let gag = match &config.station.gag {
        Some(gag) => gag.clone(),
        None => RuntimeFolder::gag(config)?,
    };
    let fits = fits(&gag);
    if let Err(why) = &fits {
        tracing::warn!("no GaG can connect: {why}");
    }
    Ok(ServerConfig {
        name: name()?,
        listen: Listen::On(TcpListener::from(robots)),
        gag: fits.is_ok().then_some(gag),
        warehouse: Some(kept),
        fetch: Vec::new(),
    })
}

/// Refuses a path that no socket can have.
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

/// Where a GaG connects to a station that nobody has told another place.
///
/// # Errors
/// The place of the bus cannot be had.
pub fn default_gag(config: &Config) -> Result<PathBuf> {
    Ok(config.bus()?.place()?.folder().join(GAG))
}

/// What is known of the warehouse, as the end of a sentence.
fn warehouse(path: Option<&Path>) -> String {
    match path {
        None => "a GaG describes the warehouse, which is not saved".into(),
        Some(path) if path.exists() => format!("the warehouse is {}", path.display()),
        Some(path) => format!(
            "there is no {} yet: a GaG describes the warehouse, which is saved there",
            path.display()
        ),
    }
}
