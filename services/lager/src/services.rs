//! The processes of a robot, each a subcommand of this program.

use std::fmt;

use lager_ports::called;
use serde::{Deserialize, Serialize};

/// One of a robot's processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Service {
    /// What the supervisor itself must not do: everything on the bus.
    Attendant,
    /// The simulated robot.
    Simulator,
    /// The boards' real images.
    Emulator,
    /// The serial ports, and who steers.
    Bridge,
    /// The navigator.
    Logic,
    /// The robot's side of the conversation with the external computer.
    Comm,
    /// The external computer, which is on no bus.
    Station,
    /// Figures and live views for programs outside.
    Gateway,
}

impl Service {
    /// The subcommand that runs it.
    pub fn command(self) -> &'static str {
        match self {
            Self::Attendant => "attend",
            Self::Simulator => "simulator",
            Self::Emulator => "emulator",
            Self::Bridge => "bridge",
            Self::Logic => "logic",
            Self::Comm => "comm",
            Self::Station => "station",
            Self::Gateway => "gateway",
        }
    }

    /// How others learn that it goes on.
    pub fn sign(self) -> Sign {
        match self {
            Self::Attendant => Sign::Line,
            Self::Simulator | Self::Emulator | Self::Bridge | Self::Logic => Sign::Topic,
            Self::Comm | Self::Station | Self::Gateway => Sign::File,
        }
    }
}

/// How a service shows that it goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// It publishes its state again and again, by the robot's clock.
    Topic,
    /// It writes when it last came round its loop (`lager_ports::Life`), by the real clock.
    File,
    /// It tells the supervisor itself.
    Line,
}

impl fmt::Display for Service {
    /// What people call it.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Attendant => "attendant",
            other => called(other.command()),
        })
    }
}
