//! The messages between supervisor and attendant.
//!
//! The two are joined by a pair of sockets, the attendant's being its standard output. A message is
//! a packet, one value in JSON:
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
//! The supervisor never waits. What it cannot send at once, or does not hear in time, counts as a
//! fault of the attendant, and it then starts another attendant.

use std::io::{Error, ErrorKind, Result};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::process::Stdio;
use std::time::Duration;

use rustix::net::{AddressFamily, RecvFlags, SendFlags, SocketFlags, SocketType};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::kept::Kept;
use crate::mission::Mission;
use crate::report::Note;
use crate::services::Service;

/// The longest message. A mission with all products of a large warehouse has some hundreds of
/// bytes.
const LONGEST: usize = 32 * 1_024;

/// From the supervisor to the attendant.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Request {
    /// The first word.
    Begin(Begin),
    /// A service has been started as this process.
    Started(Service, u32),
    /// A service has ended: its successor needs what is kept for it.
    HandOver(Service),
}

/// What an attendant starts from.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Begin {
    /// The robot's time at its start, once a clock has shown it.
    pub robot_start: Option<Duration>,
    /// The mission, as far as it has come.
    pub mission: Mission,
    /// What the robot is to be given back.
    pub kept: Kept,
    /// Whether another attendant has told already what the robot does.
    pub joins_late: bool,
    /// What is to be removed first.
    pub sweep: Sweep,
}

/// What an attendant removes from the bus before it joins it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sweep {
    /// What dead processes have left.
    #[default]
    TheDead,
    /// All of a damaged bus; none of the robot's services runs.
    Everything,
    /// The same, and it does not join it.
    EverythingAndEnd,
}

/// From the attendant to the supervisor.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Word {
    /// What dead processes have left on the bus is removed.
    Swept,
    /// It lives, whatever it waits for.
    Pulse(Pulse),
    /// A line for the terminal.
    Note(Note),
    /// The successor of this service can be started.
    HandedOver(Service),
    /// This process has not been heard for too long.
    Silent(Silence),
    /// The bus cannot be used any more, and why.
    Damaged(String),
    /// How far the mission has come.
    Mission(Mission),
    /// What is to be kept of the robot's orders changes.
    Kept {
        /// What the robot has not been given back yet.
        left: Kept,
        /// All of it.
        all: Kept,
    },
    /// Products that the mission has delivered and that do not lie at the delivery station.
    Misplaced(Vec<i32>),
}

/// The state of the attendant.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Pulse {
    /// The robot's time, from when it has joined the bus.
    pub robot_time: Option<Duration>,
    /// Sensor and steering frames it has received.
    pub frames: u64,
    /// Frames it has lost itself.
    pub lost_here: u64,
    /// Frames lost on the wires and by the services.
    pub lost_elsewhere: u64,
}

/// A service that lives and is not heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Silence {
    /// The service.
    pub service: Service,
    /// Its process.
    pub pid: u32,
    /// Whether this attendant has heard it before.
    pub was_heard: bool,
}

/// One end of the pair of sockets.
pub struct Line {
    end: OwnedFd,
    sending: SendFlags,
}

impl Line {
    /// The supervisor's end, and the other as a child's standard output.
    pub fn pair() -> Result<(Self, Stdio)> {
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
    /// Standard output is no such socket: no supervisor started this process.
    pub fn to_supervisor() -> Result<Self> {
        let end = std::io::stdout().as_fd().try_clone_to_owned()?;
        rustix::net::sockopt::socket_type(&end)?;
        Ok(Self {
            end,
            // A supervisor that was stopped for a while goes on.
            sending: SendFlags::NOSIGNAL,
        })
    }

    /// Sends a message; the supervisor never waits with it.
    ///
    /// # Errors
    /// The other end is gone, or does not read.
    pub fn send(&self, message: &impl Serialize) -> Result<()> {
        rustix::net::send(&self.end, &serde_json::to_vec(message)?, self.sending)?;
        Ok(())
    }

    /// The next message that is there.
    ///
    /// # Errors
    /// The other end is gone, or what came is no message.
    pub fn receive<T: DeserializeOwned>(&self) -> Result<Option<T>> {
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
