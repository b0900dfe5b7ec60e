//! [`Role`]: the part that a process plays on the robot's bus.

use core::fmt;
use core::str::FromStr;

use lager_sample::{Part, coded};

coded! {
    /// The part that a process plays. It is in its node's name and decides what wakes it.
    pub enum Role {
        /// Serial ports and the arbiter.
        Bridge = 0,
        /// The navigator.
        Logic = 1,
        /// The client of the external computer.
        Comm = 2,
        /// The external computer's server and operator panel.
        Station = 3,
        /// Writes recordings and plays them.
        Recorder = 4,
        /// Dashboards and metrics.
        Monitor = 5,
        /// The bus to the outside.
        Gateway = 6,
        /// The simulated body.
        Simulator = 7,
        /// Starts the others and keeps their last values.
        Supervisor = 8,
        /// One-shot commands such as `lager drive`.
        Operator = 9,
        /// Any tool that only observes.
        Observer = 10,
        /// Another program, not of this project, that acts on topics.
        Guest = 11,
    }
}

impl Role {
    /// Every role.
    pub const ALL: [Self; 12] = [
        Self::Bridge,
        Self::Logic,
        Self::Comm,
        Self::Station,
        Self::Recorder,
        Self::Monitor,
        Self::Gateway,
        Self::Simulator,
        Self::Supervisor,
        Self::Operator,
        Self::Observer,
        Self::Guest,
    ];

    /// The role's name in node and service names: lower case, no blanks.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Bridge => "bridge",
            Self::Logic => "logic",
            Self::Comm => "comm",
            Self::Station => "station",
            Self::Recorder => "recorder",
            Self::Monitor => "monitor",
            Self::Gateway => "gateway",
            Self::Simulator => "simulator",
            Self::Supervisor => "supervisor",
            Self::Operator => "operator",
            Self::Observer => "observer",
            Self::Guest => "guest",
        }
    }

    /// The name that people know for a process with this role, when that process has stopped the
    /// robot or changed its mode.
    pub const fn as_author(self) -> &'static str {
        match self {
            Self::Comm | Self::Station => "the external computer or its panel",
            Self::Operator => "a `lager` command",
            Self::Supervisor => "`lager up`",
            Self::Bridge => "the bridge",
            Self::Logic => "logic",
            Self::Recorder => "the recorder",
            Self::Monitor => "the monitor",
            Self::Gateway => "the gateway",
            Self::Simulator => "the simulated robot",
            Self::Observer | Self::Guest => "another program",
        }
    }

    /// Whether the process only observes.
    pub const fn is_observer(self) -> bool {
        matches!(
            self,
            Self::Recorder | Self::Monitor | Self::Gateway | Self::Observer
        )
    }

    /// The role as a part on the bus.
    pub const fn part(self) -> Part {
        let part = Part::new(self as u8, self.as_str());
        if self.is_observer() {
            part.observing()
        } else {
            part
        }
    }
}

impl From<Role> for Part {
    fn from(role: Role) -> Self {
        role.part()
    }
}

impl fmt::Display for Role {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

/// The name that people use for a process whose part or subcommand is `who`.
#[must_use]
pub fn called(who: &str) -> &str {
    match who {
        "comm" => "link to the station (comm)",
        "simulator" => "simulated robot (simulator)",
        "emulator" => "emulated boards (emulator)",
        "up" => "supervisor (up)",
        other => other,
    }
}

/// The text names no role.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownRole(pub String);

impl fmt::Display for UnknownRole {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "`{}` is no role; the roles are", self.0)?;
        for role in Role::ALL {
            write!(formatter, " {role}")?;
        }
        Ok(())
    }
}

impl std::error::Error for UnknownRole {}

impl FromStr for Role {
    type Err = UnknownRole;

    fn from_str(text: &str) -> Result<Self, UnknownRole> {
        Self::ALL
            .into_iter()
            .find(|role| role.as_str() == text)
            .ok_or_else(|| UnknownRole(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lager_sample::Coded;

    #[test]
    fn every_role_is_found_by_its_name_and_by_its_code() {
        assert_eq!(Role::ALL.len(), Role::VARIANTS.len());
        for role in Role::ALL {
            assert_eq!(role.as_str().parse(), Ok(role));
            assert_eq!(Role::of_code(role.to_code()), Some(role));
        }
    }

    #[test]
    fn a_wrong_role_is_refused_with_the_right_ones() {
        let error = "Bridge".parse::<Role>().unwrap_err();
        assert!(error.to_string().contains("bridge logic comm"), "{error}");
    }
}
