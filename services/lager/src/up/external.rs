//! The external computer of a robot that is up: whether it is started here, and where it listens.
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
//! port that is free. Everybody on this machine may drive from there, so it answers this machine
//! alone.
//!
//! The socket is opened here and handed to the station as its standard output, so the port stays
//! the same when a station dies, and a robot that connects meanwhile waits for its successor.
//!
//! Station and comm end after bridge and logic, and no process that moves the robot waits for them.
//! They publish nothing that says they live, so they write signs of life instead, and one that does
//! not is replaced. A robot that is driven through them stops after 150 ms of the station's silence;
//! any other goes on.

use std::fs;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::fs::FileTypeExt as _;

use anyhow::{Context, Result, bail};

use crate::config::{Config, StationSection};
use crate::goods;
use crate::reach;
use crate::runtime::RuntimeFolder;
use crate::station;

/// The choice, and what to tell people about it.
#[derive(Debug)]
pub struct External {
    /// Where a station of this robot's own listens.
    pub listener: Option<TcpListener>,
    /// What is told of it.
    pub told: String,
    /// What is told of the panel.
    pub panel: Option<String>,
    /// What is told of the gateway.
    pub gateway: Vec<String>,
}

/// Chooses, and puts into `config` what comm is to know.
///
/// # Errors
/// The place of the bus cannot be had.
pub fn choose(config: &mut Config, headless: bool) -> Result<External> {
    let mut external = station_for(config)?;
    let address = config.station.panel.take().filter(|_| !headless);
    if let Some(address) = address
        && external.listener.is_none()
    {
        external.panel = Some(without(address, external.panel));
        return Ok(external);
    }
    if headless || external.listener.is_none() {
        return Ok(external);
    }
    external.panel = Some(match panel(address) {
        Ok(address) => {
            config.station.panel = Some(address);
            format!("the panel is at http://{address}")
        }
        Err(error) => format!("there is no panel: {error:#}"),
    });
    Ok(external)
}

/// A panel is shown by a station, and this robot has none of its own: where the one is that there
/// is.
fn without(wanted: SocketAddr, other: Option<String>) -> String {
    let why = format!(
        "there is no panel at {wanted}: only a station of this robot's own would show one there (--listen ADDRESS starts one)"
    );
    match other {
        Some(other) => format!("{why}; {other}"),
        None => why,
    }
}

/// Where the panel is to answer.
fn panel(wanted: Option<SocketAddr>) -> Result<SocketAddr> {
    let Some(wanted) = wanted else {
        return station::usual_panel();
    };
    if !wanted.ip().is_loopback() {
        bail!(
            "{wanted} can be reached by others; `lager station --panel {wanted}` asks them for a token"
        );
    }
    let socket = TcpListener::bind(wanted).with_context(|| format!("{wanted} cannot be had"))?;
    Ok(socket.local_addr()?)
}

fn station_for(config: &mut Config) -> Result<External> {
    if !config.station.wanted {
        return Ok(External {
            listener: None,
            panel: None,
            gateway: Vec::new(),
            told: "there is no external computer; the warehouse is told here".into(),
        });
    }
    if let Some(address) = &config.station.address {
        return Ok(External {
            listener: None,
            panel: None,
            gateway: Vec::new(),
            told: format!("the external computer is the one at {address}"),
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
    // Who wants a GaG of this robot's own wants a station of its own.
    if config.station.gag.is_none()
        && let Some((robot, panel)) = neighbour(config)?
    {
        let address = StationSection::USUAL.to_owned();
        let told = format!("the external computer is that of robot `{robot}`, at {address}");
        config.station.address = Some(address);
        return Ok(External {
            listener: None,
            panel: panel.map(|panel| format!("the panel is at http://{panel}")),
            gateway: Vec::new(),
            told,
        });
    }
    let why = format!(", since {} cannot be had: {taken}", StationSection::USUAL);
    Ok(match TcpListener::bind("127.0.0.1:0") {
        Ok(listener) => own(config, listener, &why),
        Err(error) => none(config, &error.into()),
    })
}

/// There is no external computer.
fn none(config: &mut Config, why: &anyhow::Error) -> External {
    config.station.wanted = false;
    External {
        listener: None,
        panel: None,
        gateway: Vec::new(),
        told: format!("there is no external computer: {why:#}; the warehouse is told here"),
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

/// A robot of this user's on this bus that is up, has a station of its own at the usual address,
/// and drives in the same warehouse; and where its panel is.
fn neighbour(config: &Config) -> Result<Option<(String, Option<SocketAddr>)>> {
    let bus = config.bus()?;
    let place = bus.place()?;
    let warehouse = config.warehouse()?;
    let it = |name: &str| {
        let theirs = RuntimeFolder::running(&Config {
            name: name.to_owned(),
            ..config.clone()
        });
        let theirs = theirs.ok().flatten()?;
        let gag = match &theirs.station.gag {
            Some(gag) => Ok(gag.clone()),
            None => RuntimeFolder::gag(&theirs),
        };
        let serves = gag
            .and_then(|gag| Ok(fs::symlink_metadata(gag)?.file_type().is_socket()))
            .unwrap_or(false);
        let is_it = serves
            && theirs.station.address.as_deref() == Some(StationSection::USUAL)
            && theirs.warehouse().is_ok_and(|theirs| theirs == warehouse);
        is_it.then(|| (name.to_owned(), theirs.station.panel))
    };
    let up = place.up();
    let mut names = up.keys().map(lager_ports::RobotName::as_str);
    Ok(names.find_map(it))
}
