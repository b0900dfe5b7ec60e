//! The messages between supervisor and attendant.
//!
//! A pair of sockets connects the two; the attendant's end is its standard output. A message is a
//! packet with one value in JSON:
//!
//! ```text
//!   supervisor                                        attendant
//!       │  begin (start, mission, orders to give back …)  │
//!       │ ───────────────────────────────────────────────>│ sweeps the bus
//!       │ <───────────────────────────────────────── swept│
//!       │  (starts the body)                              │ joins the bus
//!       │ <───────────── pulse, from then on 5 times a second, ready = 1 once it has joined
//!       │  started (bridge, its process) …                │ listens for it
//!       │ <──── notes, the mission's progress, the orders to keep, silence, damage
//!       │  hand-over (bridge)                             │ publishes what is kept
//!       │ <─────────────────────────── handed-over (bridge)
//!       │  SIGTERM                                        │
//!       │ <──────────────────────────────────── last words│ sweeps, ends
//! ```
//! The supervisor never waits. If it cannot send a message at once, or does not hear an answer in
//! time, it starts another attendant.

use std::io::{Error, ErrorKind, Result};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::process::Stdio;
use std::time::Duration;

use rustix::net::{AddressFamily, RecvFlags, SendFlags, SocketFlags, SocketType};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::kept_orders::KeptOrders;
use crate::mission::Mission;
use crate::narrator::Note;
use crate::service::Service;

/// The longest message, in bytes. A mission with all products of a large warehouse has some
/// hundreds of bytes.
const LONGEST: usize = 32 * 1_024;

/// From the supervisor to the attendant.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Request {
    /// The first message.
    Begin(Begin),
    /// A service has been started as this process.
    Started(Service, u32),
    /// A service has ended. Keep its state for its successor.
    HandOver(Service),
}

/// The state from which an attendant starts.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Begin {
    /// The robot's time at its start, once a clock has shown it.
    pub(crate) robot_start: Option<Duration>,
    /// The mission, with its progress.
    pub(crate) mission: Mission,
    /// What the robot must get back.
    pub(crate) kept: KeptOrders,
    /// Whether an earlier attendant has already reported what the robot does.
    pub(crate) joins_late: bool,
    /// What to remove first.
    pub(crate) sweep: Sweep,
}

/// What an attendant removes from the bus before it joins it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Sweep {
    /// The nodes and files of dead processes.
    #[default]
    TheDead,
    /// All of a damaged bus. None of the robot's services runs.
    Everything,
    /// The same, without joining the bus afterwards.
    EverythingAndEnd,
}

/// From the attendant to the supervisor.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Word {
    /// The nodes and files of dead processes are removed.
    Swept,
    /// It lives, also while it waits for something.
    Pulse(Pulse),
    /// A line for the terminal.
    Note(Note),
    /// The successor of this service can start.
    HandedOver(Service),
    /// This process has been silent for too long.
    Silent(Silence),
    /// Nobody can use the bus any more, for this reason.
    Damaged(String),
    /// The mission's progress.
    Mission(Mission),
    /// The orders to keep have changed.
    Kept {
        /// What the robot has not got back yet.
        left: KeptOrders,
        /// Everything to keep.
        all: KeptOrders,
    },
    /// Products that the mission has delivered but that do not lie at the delivery station.
    Misplaced(Vec<i32>),
}

/// The state of the attendant.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Pulse {
    /// The robot's time, from when it has joined the bus.
    pub(crate) robot_time: Option<Duration>,
    /// Sensor and steering frames it has received.
    pub(crate) frames: u64,
    /// Frames it has lost itself.
    pub(crate) lost_here: u64,
    /// Frames lost on the wires and by the services.
    pub(crate) lost_elsewhere: u64,
    /// How many services are at work.
    pub(crate) at_work: usize,
}

/// A service that lives and is silent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Silence {
    /// The service.
    pub(crate) service: Service,
    /// Its process.
    pub(crate) pid: u32,
    /// Whether this attendant has heard it before.
    pub(crate) was_heard: bool,
}

/// One end of the pair of sockets.
pub(crate) struct Line {
    end: OwnedFd,
    sending: SendFlags,
}

impl Line {
    /// The supervisor's end, and the other as a child's standard output.
    pub(crate) fn pair() -> Result<(Self, Stdio)> {
        let (ours, theirs) = rustix::net::socketpair(
            AddressFamily::UNIX,
            SocketType::SEQPACKET,
            SocketFlags::CLOEXEC,
            None,
        )?;
        let line = Self {
            end: ours,
            sending: SendFlags::NOSIGNAL | SendFlags::DONTWAIT,
        };
        Ok((line, Stdio::from(theirs)))
    }

    /// The attendant's end.
    ///
    /// # Errors
    /// Standard output is not such a socket, because no supervisor started this process.
    pub(crate) fn to_supervisor() -> Result<Self> {
        let end = std::io::stdout().as_fd().try_clone_to_owned()?;
        rustix::net::sockopt::socket_type(&end)?;
        Ok(Self {
            end,
            // A supervisor that was frozen for a while may go on.
            sending: SendFlags::NOSIGNAL,
        })
    }

    /// Sends a message. The supervisor never waits here.
    ///
    /// # Errors
    /// The other end is gone, or does not read.
    pub(crate) fn send(&self, message: &impl Serialize) -> Result<()> {
        rustix::net::send(&self.end, &serde_json::to_vec(message)?, self.sending)?;
        Ok(())
    }

    /// The next message, if there is one.
    ///
    /// # Errors
    /// The other end is gone, or sent something that is not a message.
    pub(crate) fn receive<T: DeserializeOwned>(&self) -> Result<Option<T>> {
        let mut packet = vec![0; LONGEST];
        match rustix::net::recv(&self.end, &mut packet[..], RecvFlags::DONTWAIT) {
            Ok((_, 0)) => Err(ErrorKind::UnexpectedEof.into()),
            Ok((_, length)) => Ok(Some(serde_json::from_slice(&packet[..length])?)),
            Err(errno) => match Error::from(errno) {
                error if error.kind() == ErrorKind::WouldBlock => Ok(None),
                error => Err(error),
            },
        }
    }
}

impl AsFd for Line {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.end.as_fd()
    }
}
