//! Where a reader gets its port from: one that somebody has named, or the one at which its board
//! speaks.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use lager_home::Clock;
use lager_wire::Callsign;

use crate::config::Ports;
use crate::serial::find::{self, NotFound};
use crate::serial::{OpenPortError, SerialPort};

/// The longest pause between attempts, in real time. Those that look for a board open ports of others
/// for a moment, so they are rarer; a device that comes ends the pause.
const LONGEST_PAUSE: Duration = Duration::from_millis(250);
const LONGEST_SEARCH_PAUSE: Duration = Duration::from_secs(4);

/// How long a board that was found may be silent, in robot time, before it is looked for again.
const GIVES_UP: Duration = Duration::from_secs(5);

/// Why there is no port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NoPort {
    /// The one that was named cannot be opened.
    #[error(transparent)]
    Named(#[from] OpenPortError),
    /// No board was found.
    #[error(transparent)]
    Found(#[from] NotFound),
}

/// Where a reader gets its port from.
#[derive(Clone, Copy)]
pub(crate) enum Source<'a> {
    /// Somebody has named it.
    Named(&'a Path),
    /// It is one of the devices in `folder`: the one at which the board `role` speaks.
    Found {
        folder: &'a Path,
        role: Callsign,
        /// The readers look one after the other, so that none has a port that the other looks for.
        turn: &'a Mutex<()>,
    },
}

impl<'a> Source<'a> {
    /// The source of the port at `place`, 0 or 1.
    pub(crate) fn new(ports: &'a Ports, place: usize, turn: &'a Mutex<()>) -> Self {
        match ports {
            Ports::Named(paths) => Self::Named(&paths[place]),
            Ports::Found(folder) => Self::Found {
                folder,
                role: [Callsign::Sensor, Callsign::Steering][place],
                turn,
            },
        }
    }

    /// Opens the port; looks for it first if nobody has named it, while `goes_on`.
    pub(crate) fn open(
        &self,
        baud: u32,
        clock: &Clock,
        goes_on: impl Fn() -> bool,
    ) -> Result<SerialPort, NoPort> {
        match *self {
            Self::Named(path) => Ok(SerialPort::open(path, baud)?),
            Self::Found { folder, role, turn } => {
                let _turn = turn.lock().unwrap_or_else(PoisonError::into_inner);
                let mut devices = find::listen(folder, baud, clock, goes_on);
                Ok(find::take(folder, &mut devices, role)?)
            }
        }
    }

    /// Whether the port has to be looked for again after its board has been silent for this long.
    pub(crate) fn gives_up(&self, silent: Duration) -> bool {
        matches!(self, Self::Found { .. }) && silent >= GIVES_UP
    }

    /// The devices one of which may be the port.
    pub(crate) fn devices(&self) -> Vec<PathBuf> {
        match self {
            Self::Named(_) => Vec::new(),
            Self::Found { folder, .. } => find::devices(folder),
        }
    }

    pub(crate) const fn longest_pause(&self) -> Duration {
        match self {
            Self::Named(_) => LONGEST_PAUSE,
            Self::Found { .. } => LONGEST_SEARCH_PAUSE,
        }
    }
}
