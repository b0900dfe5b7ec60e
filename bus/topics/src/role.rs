//! Who a process is on the bus.

use core::fmt;
use core::str::FromStr;

use crate::tag::coded;

coded! {
    /// The part a process plays; it is in its node's name and decides what it may wait on.
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
        /// Any tool that only looks.
        Observer = 10,
        /// A program of somebody else that acts on topics.
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

    /// What a person calls who has stopped the robot, or changed its mode, in this role: the
    /// program that he knows.
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

    /// Whether the process only looks. Observers share the 64 places a topic has for them;
    /// all other roles have places of their own, so that looking can never keep the robot
    /// from working.
    pub const fn is_observer(self) -> bool {
        matches!(
            self,
            Self::Recorder | Self::Monitor | Self::Gateway | Self::Observer
        )
    }
}

impl fmt::Display for Role {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

/// A text that is no role.
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
    use crate::tag::Coded;

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
