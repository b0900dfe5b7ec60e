//! The external computer of a robot that is up: whether `up` starts it, and where it listens.
//!
//! ```text
//!   --no-station            none: `up` tells the robot its warehouse
//!   --station HOST:PORT     that one
//!   --listen HOST:PORT      one of this robot's own, there
//!   127.0.0.1:7420 is free  one of this robot's own, there
//!   it is taken             by this user's station for the same warehouse: that one
//!                           by anything else: one of this robot's own, at a port that is free
//!   no port can be had, or no line can tell the warehouse: none
//! ```
//! A station of its own shows a panel, unless the robot is headless: at 127.0.0.1:7410, or at a
//! port that is free, to whoever has the token in the address that `up` prints.
//!
//! A robot and a station of its own prove to each other that they know a secret: the one in the
//! robot's folder, which only this user can read, or the one in `--secret`. If another robot joins
//! that station, it learns where this secret lies. Without `--secret` the robot believes a station
//! of somebody else.
//!
//! `up` opens the socket and hands it to the station as its standard output. So the port stays the
//! same when a station dies, and a robot that connects meanwhile waits for the next station.
//!
//! Station and comm end after bridge and logic, and no process that moves the robot waits for them.
//! They publish nothing that shows that they live, so they write signs of life; `up` replaces one
//! that does not. A robot that somebody drives through them stops after 150 ms of the station's
//! silence. A robot that drives by itself goes on.

use std::fs;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::fs::FileTypeExt as _;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use lager_comm::secrets_at;
use lager_lines::Name;
use lager_panel::Tokens;
use lager_supervisor::runtime_folder::{NameLock, RuntimeFolder};

use crate::config::{Config, StationSection};
use crate::goods;
use crate::reach;
use crate::station;

/// The choice, and what to tell people about it.
#[derive(Debug)]
pub struct External {
    /// Where a station of this robot's own listens.
    pub listener: Option<TcpListener>,
    /// What to tell people of it.
    pub told: String,
    /// What to tell people of the panel.
    pub panel: Option<String>,
    /// What to tell people of the gateway.
    pub gateway: Vec<String>,
}

/// Chooses, and puts into `config` what comm needs.
///
/// # Errors
/// The folder of the bus or the secret's file cannot be read.
pub fn choose(config: &mut Config, lock: &mut NameLock, headless: bool) -> Result<External> {
    if let Some(file) = &mut config.comm.secret {
        *file = std::path::absolute(&*file)?;
        let name = Name::new(config.name.clone());
        let is_there = secrets_at(file)?.of(&name?).is_some();
        if config.station.wanted && !is_there {
            bail!(
                "{} holds no secret of robot {}",
                file.display(),
                config.name
            );
        }
    }
    let mut external = station_for(config)?;
    let tokens = match &external.listener {
        Some(_) => {
            let secret = lock.make_secret()?;
            if config.comm.secret.is_none() {
                config.comm.secret = Some(RuntimeFolder::secret(&config.bus()?)?);
            }
            Some(Tokens::of(&secret))
        }
        None => None,
    };
    let address = config.station.panel.take().filter(|_| !headless);
    if let Some(address) = address
        && external.listener.is_none()
    {
        external.panel = Some(without(address, external.panel));
        return Ok(external);
    }
    let Some(tokens) = tokens.filter(|_| !headless) else {
        return Ok(external);
    };
    external.panel = Some(match panel(address) {
        Ok(address) => {
            config.station.panel = Some(address);
            format!(
                "the panel is at {}",
                station::page_at(address, &tokens.driver)
            )
        }
        Err(error) => format!("there is no panel: {error:#}"),
    });
    Ok(external)
}

/// Only a station shows a panel, and this robot starts none. Says where the panel of the other
/// station is.
fn without(wanted: SocketAddr, other: Option<String>) -> String {
    let why = format!(
        "there is no panel at {wanted}: only a station of this robot's own would show one there (--listen ADDRESS starts one)"
    );
    match other {
        Some(other) => format!("{why}; {other}"),
        None => why,
    }
}

/// Where the panel answers.
fn panel(wanted: Option<SocketAddr>) -> Result<SocketAddr> {
    let Some(wanted) = wanted else {
        return station::usual_panel();
    };
    if !wanted.ip().is_loopback() {
        bail!(
            "{wanted} can be reached by others; `lager station --panel {wanted}` asks them for a token"
        );
    }
    let socket = TcpListener::bind(wanted).with_context(|| format!("{wanted} is not free"))?;
    Ok(socket.local_addr()?)
}

fn station_for(config: &mut Config) -> Result<External> {
    if !config.station.wanted {
        return Ok(External {
            listener: None,
            panel: None,
            gateway: Vec::new(),
            told: format!("there is no external computer; {}", told_here(config)),
        });
    }
    if let Some(address) = config.station.address.clone() {
        if config.comm.secret.is_none() {
            config.comm.secret = secret_for(config, &address)?;
        }
        let believed = match config.comm.secret {
            Some(_) => "",
            None => "; the robot believes whoever answers there (--secret FILE asks for a proof)",
        };
        return Ok(External {
            listener: None,
            panel: None,
            gateway: Vec::new(),
            told: format!("the external computer is the one at {address}{believed}"),
        });
    }
    if let Some(gag) = &config.station.gag {
        station::fits(gag).context("no GaG can connect; --gag takes another path")?;
    }
    if let Err(error) = goods::configured(config) {
        if config.station.listen.is_some() || config.station.gag.is_some() {
            return Err(error);
        }
        return Ok(none(config, &error));
    }
    if let Some(wanted) = config.station.listen {
        let listener = TcpListener::bind(wanted).with_context(|| {
            format!("robots cannot connect to {wanted}; --listen takes another address")
        })?;
        return Ok(own(config, listener, ""));
    }
    let taken = match TcpListener::bind(StationSection::USUAL) {
        Ok(listener) => return Ok(own(config, listener, "")),
        Err(error) => error,
    };
    // A user who wants a GaG of this robot also wants a station of this robot.
    if config.station.gag.is_none()
        && let Some(theirs) = neighbour(config)?
    {
        let address = StationSection::USUAL.to_owned();
        let robot = &theirs.name;
        let told = format!("the external computer is that of robot `{robot}`, at {address}");
        config.station.address = Some(address);
        config.comm.secret.clone_from(&theirs.comm.secret);
        let panel = theirs.station.panel.zip(station::tokens(&theirs).ok());
        let panel = panel.map(|(at, tokens)| station::page_at(at, &tokens.driver));
        return Ok(External {
            listener: None,
            panel: panel.map(|panel| format!("the panel is at {panel}")),
            gateway: Vec::new(),
            told,
        });
    }
    let why = format!(", since {} is not free: {taken}", StationSection::USUAL);
    Ok(match TcpListener::bind("127.0.0.1:0") {
        Ok(listener) => own(config, listener, &why),
        Err(error) => none(config, &error.into()),
    })
}

/// Where the robot's warehouse comes from without an external computer.
fn told_here(config: &Config) -> &'static str {
    match config.warehouse_name() {
        Some(_) => "the warehouse is told here",
        None => "nobody tells the robot its warehouse: --warehouse FILE names one",
    }
}

/// There is no external computer.
fn none(config: &mut Config, why: &anyhow::Error) -> External {
    config.station.wanted = false;
    External {
        listener: None,
        panel: None,
        gateway: Vec::new(),
        told: format!(
            "there is no external computer: {why:#}; {}",
            told_here(config)
        ),
    }
}

fn own(config: &mut Config, listener: TcpListener, why: &str) -> External {
    let address = listener.local_addr();
    let at = address.as_ref();
    let at = at.map_or_else(
        |_| StationSection::USUAL.to_owned(),
        |at| reach::listed(*at, |at| at.to_string()),
    );
    let told = format!("the external computer listens at {at}{why}");
    let address = address.map(|address| address.to_string());
    config.station.address = Some(address.unwrap_or_else(|_| StationSection::USUAL.to_owned()));
    External {
        listener: Some(listener),
        panel: None,
        gateway: Vec::new(),
        told,
    }
}

/// A robot of this user on this bus that is up, was started with the same warehouse, and has a
/// station of its own at the usual address.
fn neighbour(config: &Config) -> Result<Option<Config>> {
    let warehouse = config.known_warehouse()?;
    let is_it = |theirs: &Config| {
        let gag = match &theirs.station.gag {
            Some(gag) => Ok(gag.clone()),
            None => theirs.bus().and_then(|bus| RuntimeFolder::gag(&bus)),
        };
        let serves = gag
            .and_then(|gag| Ok(fs::symlink_metadata(gag)?.file_type().is_socket()))
            .unwrap_or(false);
        serves
            && theirs.station.address.as_deref() == Some(StationSection::USUAL)
            && theirs
                .known_warehouse()
                .is_ok_and(|theirs| theirs == warehouse)
    };
    Ok(others(config)?.into_iter().find(is_it))
}

/// The file of the secret with which another robot on this bus talks to the station at `address`.
fn secret_for(config: &Config, address: &str) -> Result<Option<PathBuf>> {
    let talks = |theirs: &Config| theirs.station.address.as_deref() == Some(address);
    let mut others = others(config)?.into_iter();
    Ok(others.find(talks).and_then(|theirs| theirs.comm.secret))
}

/// The robots on this bus that are up, with the configurations of their starts.
fn others(config: &Config) -> Result<Vec<Config>> {
    let bus = config.bus()?;
    let up = bus.home()?.up();
    let names = up.keys().map(lager_home::UnitName::as_str);
    let others = names
        .filter(|name| *name != config.name)
        .filter_map(|name| {
            let theirs = Config {
                name: name.to_owned(),
                ..config.clone()
            };
            theirs.of_running_robot().ok().flatten()
        });
    Ok(others.collect())
}
