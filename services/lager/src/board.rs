//! `lager board`: gives the boards their images, restarts them, and sets up their chips.
//!
//! The protocol is `lager-loader`'s. This module finds images, ports and boards. `hold` sees to it
//! that nobody else has the boards meanwhile, and the ports are opened as the bridge does, for this
//! process alone. So it never shares a line with somebody who steers.
//!
//! **Safe state**: a board that leaves its program has its motors off, in its bootloader too, and a
//! board whose update breaks off stays there.

mod flash;
mod hold;
mod line;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use lager_bridge::serial::find::{self, NotFound};
use lager_bridge::serial::{OpenPortError, holders};
use lager_home::{Clock, ClockSource};
use lager_loader::{Found, Image, Runs, UpdateError};
use lager_supervisor::console;
use lager_wake::Shutdown;
use lager_wire::{BUILD, Callsign, Version};

use crate::cli::{BoardArgs, BoardCommand, PortArgs, ResetArgs, UpdateArgs};
use crate::config::{Body, Config};
use crate::exit::{Interrupted, Usage};
use hold::Hold;
pub use hold::take_robot;
pub use line::BoardLine;

/// How often the progress of an update is told, in percent.
const TOLD_EVERY: usize = 25;

/// Runs one of the commands.
pub fn run(config: &Config, args: &BoardArgs, shutdown: &Shutdown) -> Result<()> {
    let done = match &args.command {
        BoardCommand::Update(args) => update(config, args, shutdown),
        BoardCommand::Reset(args) => reset(config, args, shutdown),
        BoardCommand::Flash(args) => flash::run(config, args),
    };
    match done {
        Err(_) if shutdown.is_requested() => Err(Interrupted).context(
            "a board whose update broke off waits in its bootloader until `lager board update` \
             goes on with it",
        ),
        done => done,
    }
}

/// A board at its port.
struct AtPort {
    path: PathBuf,
    line: BoardLine,
    found: Found,
}

/// An image and its file.
struct ImageFile {
    path: PathBuf,
    image: Image,
}

fn update(config: &Config, args: &UpdateArgs, shutdown: &Shutdown) -> Result<()> {
    let images = images(config, args)?;
    let ports = ports_of(config, &args.ports)?;
    let hold = Hold::get(config)?;
    let ports = || ports.map_or_else(|| hold.find(config, args.ports.baud, shutdown), Ok);
    let done = ports().and_then(|ports| update_at(config, args, (ports, &images), &hold, shutdown));
    hold.explained(done)?;
    hold.end()
}

fn update_at(
    config: &Config,
    args: &UpdateArgs,
    (ports, images): (Vec<PathBuf>, &[ImageFile]),
    hold: &Hold,
    shutdown: &Shutdown,
) -> Result<()> {
    let mut boards = Vec::new();
    for path in ports {
        let mut line = hold.open(config, &path, args.ports.baud, shutdown)?;
        let found = lager_loader::find(&mut line);
        let found = found.with_context(|| at(&path))?;
        console::print(&format!(
            "{} board at {}: {}",
            found.role,
            path.display(),
            before(&found)
        ))?;
        boards.push(AtPort { path, line, found });
    }
    // Everything that does not fit is found before anything is written.
    if let [one, other] = boards.as_slice()
        && one.found.role == other.found.role
    {
        bail!(
            "{} and {} both have a {} board; nothing was written",
            one.path.display(),
            other.path.display(),
            one.found.role
        );
    }
    if !args.image.is_empty() {
        for ImageFile { path, image } in images {
            if boards.iter().all(|board| board.found.role != image.role()) {
                let error = UpdateError::OtherBoard {
                    image: image.role(),
                    board: boards[0].found.role,
                };
                return Err(error).context(path.display().to_string());
            }
        }
    }
    for board in &boards {
        if let Runs::Application(up) = board.found.runs
            && up.version == Version::Original
        {
            return Err(UpdateError::Original(board.found.role)).context(at(&board.path));
        }
    }
    for board in &mut boards {
        let role = board.found.role;
        let image = images.iter().find(|one| one.image.role() == role);
        let Some(ImageFile { path, image }) = image else {
            continue;
        };
        write(board, image, path)?;
    }
    Ok(())
}

/// Gives a board its image, and says so.
fn write(board: &mut AtPort, image: &Image, path: &Path) -> Result<()> {
    let (who, build) = (image.role(), image.build());
    console::print(&format!(
        "{who} board: writes build {build} of {}",
        path.display()
    ))?;
    let mut next = TOLD_EVERY;
    let told = |percent| {
        while percent >= next {
            // Whoever has closed the output must not break off the update.
            let _ = console::print(&format!("{who} board: {next} % written"));
            next += TOLD_EVERY;
        }
    };
    let up = lager_loader::update(&mut board.line, image, told);
    let up = up.with_context(|| {
        format!(
            "{} (the {who} board; `lager board update` again goes on with it)",
            at(&board.path)
        )
    })?;
    console::print(&format!(
        "{who} board: was {}, runs build {} now, verified",
        before(&board.found),
        up.build
    ))?;
    if up.build != BUILD {
        console::print(&format!(
            "{who} board: build {} does not fit this program, which goes with build {BUILD}; \
             `lager board update` without --image writes the one that fits",
            up.build
        ))?;
    }
    Ok(())
}

fn reset(config: &Config, args: &ResetArgs, shutdown: &Shutdown) -> Result<()> {
    let ports = ports_of(config, &args.ports)?;
    let hold = Hold::get(config)?;
    let ports = || ports.map_or_else(|| hold.find(config, args.ports.baud, shutdown), Ok);
    let done = ports().and_then(|ports| reset_at(config, args, ports, &hold, shutdown));
    hold.explained(done)?;
    hold.end()
}

fn reset_at(
    config: &Config,
    args: &ResetArgs,
    ports: Vec<PathBuf>,
    hold: &Hold,
    shutdown: &Shutdown,
) -> Result<()> {
    let role = args.board.callsign();
    let mut others = Vec::new();
    for path in ports {
        let mut line = hold.open(config, &path, args.ports.baud, shutdown)?;
        match lager_loader::restart(&mut line, role) {
            Ok(up) => {
                return console::print(&format!(
                    "the {} board at {} has started again, with build {}",
                    role,
                    path.display(),
                    up.build
                ));
            }
            Err(error @ (UpdateError::OtherRole { .. } | UpdateError::NobodyAnswers)) => {
                others.push(format!("{}: {error}", path.display()));
            }
            Err(error) => return Err(error).context(at(&path)),
        }
    }
    bail!("no {role} board was found: {}", others.join("; "))
}

/// The images to write, each read and checked.
fn images(config: &Config, args: &UpdateArgs) -> Result<Vec<ImageFile>> {
    let baud = args.ports.baud.unwrap_or(config.serial.baud);
    let mut images = Vec::new();
    if args.image.is_empty() {
        for role in [Callsign::Sensor, Callsign::Steering] {
            let file = format!("{role}.hex");
            let path = config.chip.hex(&file, baud).map_err(|why| anyhow!(why))?;
            let read = read(&path)?;
            if read.image.role() != role {
                bail!(
                    "{} is the image of the {} board; build the images again, or install the \
                     package again",
                    path.display(),
                    read.image.role()
                );
            }
            images.push(read);
        }
        return Ok(images);
    }
    for path in &args.image {
        let read = read(path)?;
        let role = read.image.role();
        if images
            .iter()
            .any(|other: &ImageFile| other.image.role() == role)
        {
            return Err(Usage(format!("both images are for the {role} board")).into());
        }
        images.push(read);
    }
    Ok(images)
}

fn read(path: &Path) -> Result<ImageFile> {
    let file = || path.display().to_string();
    let text = fs::read(path).with_context(file)?;
    let image = Image::from_hex(&String::from_utf8_lossy(&text)).with_context(file)?;
    Ok(ImageFile {
        path: path.to_owned(),
        image,
    })
}

/// The ports that may have boards; `None` if they have to be found.
fn ports_of(config: &Config, args: &PortArgs) -> Result<Option<Vec<PathBuf>>> {
    let ports = match args.port.as_slice() {
        [] if config.body != Body::Serial => {
            return Err(Usage(
                "the robot of this configuration is simulated, so it has no boards; name the port \
                 of each board with --port, or write body = \"serial\" into the configuration"
                    .into(),
            )
            .into());
        }
        [] => match config.serial.named() {
            Some(ports) => ports.to_vec(),
            None => return Ok(None),
        },
        [_] | [_, _] => args.port.clone(),
        _ => return Err(Usage("a robot has two boards; give two ports at most".into()).into()),
    };
    if let [one, other] = ports.as_slice()
        && fs::canonicalize(one).ok() == Some(fs::canonicalize(other).unwrap_or_default())
    {
        return Err(Usage(format!(
            "{} and {} are the same port",
            one.display(),
            other.display()
        ))
        .into());
    }
    Ok(Some(ports))
}

/// Finds the port of each board, or says why it was not found. A silent port may be that of a board in
/// its bootloader ([`find::both`]).
///
/// # Errors
/// The boards' clock cannot be read.
pub fn find(
    config: &Config,
    baud: Option<u32>,
    shutdown: &Shutdown,
) -> Result<[Result<PathBuf, NotFound>; 2]> {
    let folder = &config.serial.devices;
    let baud = baud.unwrap_or(config.serial.baud);
    let devices = find::listen(folder, baud, &clock(config)?, || !shutdown.is_requested());
    Ok(find::both(folder, devices))
}

/// The boards' time: the chips of an emulator that somebody runs at the ports have one of their own.
fn clock(config: &Config) -> Result<Clock> {
    let source = ClockSource::new(1.0, config.chip.clock.as_deref())?;
    Ok(Clock::new(&source))
}

/// Opens a port, and says who has it if it is in use.
pub fn open(
    config: &Config,
    path: &Path,
    baud: Option<u32>,
    shutdown: &Shutdown,
) -> Result<BoardLine> {
    let clock = clock(config)?;
    let baud = baud.unwrap_or(config.serial.baud);
    BoardLine::open(path, baud, clock, shutdown).map_err(|error| {
        let is_busy = matches!(error, OpenPortError::Busy { .. });
        let error = anyhow::Error::from(error);
        if !is_busy {
            return error;
        }
        let others = holders::others(&[&path.to_owned()], &[]);
        let said: Vec<String> = others.iter().map(holders::Other::said).collect();
        match said.is_empty() {
            true => error.context(
                "if the robot's service has it, give this command as the user of the service \
                 (`sudo -u lager lager board ...`): then the robot lends its ports",
            ),
            false => error.context(said.join("; ")),
        }
    })
}

fn at(path: &Path) -> String {
    path.display().to_string()
}

/// What a board was found with.
fn before(found: &Found) -> String {
    match found.runs {
        Runs::Application(up) if up.version == Version::Original => "its original program".into(),
        Runs::Application(up) => format!("build {}", up.build),
        Runs::Loader(Some(build)) => format!("build {build}, in its bootloader"),
        Runs::Loader(None) => "in its bootloader without a whole image".into(),
    }
}
