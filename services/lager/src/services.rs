//! The processes of a robot, each a subcommand of this program.

use std::fmt;

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

    /// Whether it says something on the bus again and again as long as it lives. Comm does not, and
    /// watches over its calls into the bus itself.
    pub fn is_heard(self) -> bool {
        !matches!(self, Self::Comm | Self::Station | Self::Gateway)
    }
}

impl fmt::Display for Service {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Attendant => "attendant",
            other => other.command(),
        })
    }
}
