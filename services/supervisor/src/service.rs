//! The processes of a robot, each a subcommand of this program.

use std::fmt;

use lager_topics::called;
use serde::{Deserialize, Serialize};

/// One of a robot's processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Service {
    /// Does everything on the bus that the supervisor itself must not do.
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
    /// The external computer, which joins no bus.
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

    /// How others see that it lives.
    pub fn sign(self) -> Sign {
        match self {
            Self::Attendant => Sign::Line,
            Self::Simulator | Self::Emulator | Self::Bridge | Self::Logic => Sign::Topic,
            Self::Comm | Self::Station | Self::Gateway => Sign::File,
        }
    }
}

/// How a service shows that it lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// It publishes its state regularly, by the robot's clock.
    Topic,
    /// It writes a sign of life in each turn of its loop (`lager_home::Life`), by the real clock.
    File,
    /// It tells the supervisor itself.
    Line,
}

impl fmt::Display for Service {
    /// Its name for people.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Attendant => "attendant",
            other => called(other.command()),
        })
    }
}
