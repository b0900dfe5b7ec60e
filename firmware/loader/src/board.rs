//! Which board is at a line, what it runs, and how it is told to reset.

use core::ops::ControlFlow;
use core::time::Duration;

use lager_wire::link::{HostEvent, HostLink, HostTransmitter, Up};
use lager_wire::{Callsign, PACKET_LENGTH, Payload, ResetCause, ResetOrder, Setting, Version};

use crate::client::{Client, LoaderError};
use crate::error::UpdateError;
use crate::header::{Header, PAGE};
use crate::line::Line;

/// How long a loader that already waits may take to answer.
const LOADER_ANSWERS: Duration = Duration::from_millis(300);
/// From a reset to the loader's or the application's first answer: the chip's start takes 65 ms, the
/// loader may wait for 2.5 s, and a machine under load is late.
pub(crate) const STARTS: Duration = Duration::from_secs(5);
/// How often the Pi asks a board.
const LOOKS_EVERY: Duration = Duration::from_millis(20);

/// A board that answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Found {
    /// Which one it is.
    pub role: Callsign,
    /// What it does.
    pub runs: Runs,
}

/// What a board runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Runs {
    /// Its application, with what that has told.
    Application(Up),
    /// Its loader. The build number is that of its image, if it has a whole one.
    Loader(Option<u16>),
}

/// Looks which board is at `line`.
///
/// # Errors
/// No board answers, or the line is gone.
pub fn find<L: Line>(line: &mut L) -> Result<Found, UpdateError> {
    Ok(connect_or_find(line)?.0)
}

/// Restarts the board with this role. Returns when it answers again.
///
/// # Errors
/// It is the other board, an original one, or one without a whole image.
pub fn restart<L: Line>(line: &mut L, role: Callsign) -> Result<Up, UpdateError> {
    let (found, transmitter) = connect_or_find(line)?;
    if found.role != role {
        return Err(UpdateError::OtherRole {
            asked: role,
            board: found.role,
        });
    }
    let is_running = transmitter.is_some();
    match (found.runs, transmitter) {
        (_, Some(mut transmitter)) => order(line, &mut transmitter, role, ResetOrder::Restart)?,
        (Runs::Loader(None), None) => return Err(UpdateError::NoImage(role)),
        // If nothing answers, it has started its image meanwhile.
        (_, None) => {
            if let Some(client) = Client::find(line, LOADER_ANSWERS)? {
                client.start()?;
            }
        }
    }
    let until = line.now() + STARTS;
    while let Some(left) = until.checked_sub(line.now()) {
        // A board can still answer before it resets.
        if let Some(up) = ask(line, left)?
            && (!is_running || (up.fresh && up.reset == ResetCause::Ordered))
        {
            return Ok(up);
        }
    }
    Err(UpdateError::NotReset(role))
}

/// Asks the board at `line` which image it runs, by a handshake. `None`: no application answers.
///
/// # Errors
/// The line is gone.
pub fn ask<L: Line>(line: &mut L, within: Duration) -> Result<Option<Up>, UpdateError> {
    connect(line, &mut HostTransmitter::new(), within)
}

/// Looks which board is at `line`. A running application comes with a transmitter for orders to it.
pub(crate) fn connect_or_find<L: Line>(
    line: &mut L,
) -> Result<(Found, Option<HostTransmitter>), UpdateError> {
    if let Some(mut client) = Client::find(line, LOADER_ANSWERS)? {
        let build = match client.is_whole()? {
            true => build(&client.read_page(0)?),
            false => None,
        };
        let found = Found {
            role: client.role(),
            runs: Runs::Loader(build),
        };
        return Ok((found, None));
    }
    let mut transmitter = HostTransmitter::new();
    let up = connect(line, &mut transmitter, STARTS)?.ok_or(UpdateError::NobodyAnswers)?;
    let found = Found {
        role: up.callsign,
        runs: Runs::Application(up),
    };
    Ok((found, Some(transmitter)))
}

/// The build number in an image's first page.
fn build(page: &[u8; PAGE]) -> Option<u16> {
    let header = page.get(Header::AT as usize..)?.first_chunk()?;
    Header::read(header).map(|header| header.build)
}

/// Tells a board to reset.
pub(crate) fn order<L: Line>(
    line: &mut L,
    transmitter: &mut HostTransmitter,
    board: Callsign,
    order: ResetOrder,
) -> Result<(), UpdateError> {
    let packet = transmitter.encode(Payload::Reset(order));
    let packet = packet.ok_or(UpdateError::Original(board))?;
    Ok(line.send(&packet).map_err(LoaderError::from)?)
}

fn connect<L: Line>(
    line: &mut L,
    transmitter: &mut HostTransmitter,
    within: Duration,
) -> Result<Option<Up>, UpdateError> {
    converse(line, transmitter, within, |_, news| match news {
        News::Up(up) => ControlFlow::Break(up),
        News::Packet(_) => ControlFlow::Continue(None),
    })
}

/// Keeps the link to the application at `line` for this time and hands over everything that it says.
/// Whenever the link comes up it gets `settings`, each when it has answered the one before.
///
/// # Errors
/// The line is gone.
pub fn listen<L: Line>(
    line: &mut L,
    within: Duration,
    settings: &[Setting],
    mut heard: impl FnMut(Payload),
) -> Result<(), UpdateError> {
    let mut transmitter = HostTransmitter::new();
    let mut left = [].iter();
    let ended = converse(line, &mut transmitter, within, |transmitter, news| {
        match news {
            News::Up(_) => left = settings.iter(),
            News::Packet(payload) => {
                heard(payload);
                if !matches!(payload, Payload::SettingReply(_)) {
                    return ControlFlow::<(), _>::Continue(None);
                }
            }
        }
        let next = left.next().copied().map(Payload::Setting);
        ControlFlow::Continue(next.and_then(|next| transmitter.encode(next)))
    });
    ended.map(|_| ())
}

/// What a board's application says.
enum News {
    Up(Up),
    Packet(Payload),
}

/// Shakes hands with the application at `line` and tells `news` what comes, until that breaks off.
/// It may answer with a packet for the board. `None`: the time is over.
fn converse<L: Line, T>(
    line: &mut L,
    transmitter: &mut HostTransmitter,
    within: Duration,
    mut news: impl FnMut(&mut HostTransmitter, News) -> ControlFlow<T, Option<[u8; PACKET_LENGTH]>>,
) -> Result<Option<T>, UpdateError> {
    let mut link = HostLink::new();
    let until = line.now() + within;
    while line.now() < until {
        let byte = line.receive(LOOKS_EVERY).map_err(LoaderError::from)?;
        let now = line.now();
        let mut event = byte.and_then(|byte| link.push(byte, now));
        if event.is_none() {
            event = link.poll(now);
        }
        let told = match event {
            Some(HostEvent::SendSyn) => {
                line.send(&transmitter.syn()).map_err(LoaderError::from)?;
                None
            }
            Some(HostEvent::SendAck { up }) => {
                let version = up.map_or_else(|| link.version(), |up| Some(up.version));
                let ack = transmitter.ack(version.unwrap_or(Version::One));
                line.send(&ack).map_err(LoaderError::from)?;
                up.map(News::Up)
            }
            Some(HostEvent::Up(up)) => {
                transmitter.adopt(up.version);
                Some(News::Up(up))
            }
            Some(HostEvent::Packet(packet)) => Some(News::Packet(packet.payload)),
            Some(HostEvent::Silent) | None => None,
        };
        match told.map(|told| news(transmitter, told)) {
            Some(ControlFlow::Break(end)) => return Ok(Some(end)),
            Some(ControlFlow::Continue(Some(packet))) => {
                line.send(&packet).map_err(LoaderError::from)?;
            }
            Some(ControlFlow::Continue(None)) | None => {}
        }
    }
    Ok(None)
}
