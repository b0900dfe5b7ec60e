//! Names: of robots, of nodes, of services.
//!
//! Tools know which process is which only by these names.

use std::fmt;
use std::str::FromStr;

use lager_topics::Role;

const FAMILY: &str = "lager";

/// The transport's folder, which stands in the bus's beside those of the robots.
pub(crate) const TRANSPORT: &str = "iceoryx2";

/// Whether a robot cannot have this name because the transport has it.
pub(crate) fn is_transport(name: &str) -> bool {
    name.starts_with(TRANSPORT)
}

/// The name of a robot: 1 to 24 characters of `a`-`z`, `0`-`9` and `-`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RobotName(String);

impl RobotName {
    /// The longest name, in characters.
    pub const MAX_LENGTH: usize = 24;

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for RobotName {
    fn default() -> Self {
        Self("r1".to_owned())
    }
}

impl fmt::Display for RobotName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Why a text is not a robot's name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RobotNameError {
    /// It is empty.
    #[error("a robot's name cannot be empty; use 1 to 24 of a-z, 0-9 and -, for example `r1`")]
    Empty,
    /// It is too long.
    #[error("the robot's name `{0}` has more than 24 characters; choose a shorter one")]
    TooLong(String),
    /// The transport's folder stands beside the robots' under this name.
    #[error(
        "no robot can be called `{0}`, as the bus keeps its own files under that name; choose another"
    )]
    Reserved(String),
    /// It has a character that is not allowed.
    #[error("the robot's name `{name}` contains `{character}`; only a-z, 0-9 and - are allowed")]
    Character {
        /// The text.
        name: String,
        /// The first character that is not allowed.
        character: char,
    },
}

impl FromStr for RobotName {
    type Err = RobotNameError;

    fn from_str(text: &str) -> Result<Self, RobotNameError> {
        if text.is_empty() {
            return Err(RobotNameError::Empty);
        }
        let allowed = |c: &char| c.is_ascii_lowercase() || c.is_ascii_digit() || *c == '-';
        if let Some(character) = text.chars().find(|c| !allowed(c)) {
            return Err(RobotNameError::Character {
                name: text.to_owned(),
                character,
            });
        }
        if text.len() > Self::MAX_LENGTH {
            return Err(RobotNameError::TooLong(text.to_owned()));
        }
        if is_transport(text) {
            return Err(RobotNameError::Reserved(text.to_owned()));
        }
        Ok(Self(text.to_owned()))
    }
}

/// What the name of the actors' service has behind the topic's.
const ACTORS: &str = ":actors";

/// Whether a topic may have this name: it has no colon, which names of other services do.
pub(crate) const fn may_be_topic(name: &str) -> bool {
    let bytes = name.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        if bytes[at] == b':' {
            return false;
        }
        at += 1;
    }
    true
}

/// The name of the service that a topic's actors read.
pub(crate) fn of_actors(topic: &str) -> String {
    format!("{topic}{ACTORS}")
}

/// The topic whose service, public or the actors', has that name.
pub(crate) fn topic_of(service: &str) -> &str {
    service.strip_suffix(ACTORS).unwrap_or(service)
}

/// The full name of a topic, request or wake service.
pub(crate) fn service(robot: &RobotName, name: &str) -> String {
    format!("{FAMILY}/{robot}/{name}")
}

/// The robot and the relative name of a service, if it is one of ours.
pub(crate) fn parse_service(name: &str) -> Option<(RobotName, &str)> {
    let (robot, topic) = name
        .strip_prefix(FAMILY)?
        .strip_prefix('/')?
        .split_once('/')?;
    Some((robot.parse().ok()?, topic))
}

/// The name of a process's node.
pub(crate) fn node(robot: &RobotName, role: Role, pid: u32) -> String {
    format!("{FAMILY}/{robot}/{role}/{pid}")
}

/// Robot, role and process of a node, if it is one of ours.
pub(crate) fn parse_node(name: &str) -> Option<(RobotName, Role, u32)> {
    let (robot, rest) = parse_service(name)?;
    let (role, pid) = parse_port(rest)?;
    Some((robot, role, pid))
}

/// The name of a port of a process.
pub(crate) fn port(role: Role, pid: u32) -> String {
    format!("{role}/{pid}")
}

/// Role and process of a port, if it is one of ours.
pub(crate) fn parse_port(name: &str) -> Option<(Role, u32)> {
    let (role, pid) = name.split_once('/')?;
    Some((role.parse().ok()?, pid.parse().ok()?))
}

/// What people call a process that the software knows by its role or its subcommand.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_names_are_taken_as_they_are() {
        for name in ["r1", "a", "-", "robot-7", "abcdefghijklmnopqrstuvwx"] {
            assert_eq!(name.parse::<RobotName>().unwrap().as_str(), name);
        }
    }

    #[test]
    fn bad_names_are_refused_with_the_reason() {
        let reason = |name: &str| name.parse::<RobotName>().unwrap_err().to_string();
        assert!(reason("").contains("cannot be empty"));
        assert!(reason("R1").contains("contains `R`"));
        assert!(reason("r/1").contains("contains `/`"));
        assert!(reason("å").contains("contains `å`"));
        assert!(reason("iceoryx2").contains("its own files"));
        assert!(reason("abcdefghijklmnopqrstuvwxy").contains("more than 24"));
    }

    #[test]
    fn names_are_read_back_as_they_were_made() {
        let robot: RobotName = "r-2".parse().unwrap();
        assert_eq!(
            parse_node(&node(&robot, Role::Logic, 4711)),
            Some((robot.clone(), Role::Logic, 4711))
        );
        assert_eq!(
            parse_service(&service(&robot, "sensor/line")),
            Some((robot, "sensor/line"))
        );
        assert_eq!(
            parse_port(&port(Role::Observer, 9)),
            Some((Role::Observer, 9))
        );
    }

    #[test]
    fn no_topic_has_the_name_of_actors() {
        let actors = of_actors("sensor/line");
        assert_eq!(actors, "sensor/line:actors");
        assert!(may_be_topic("sensor/line") && !may_be_topic(&actors));
        assert_eq!(topic_of(&actors), "sensor/line");
        assert_eq!(topic_of("sensor/line"), "sensor/line");
    }

    #[test]
    fn names_of_others_are_not_ours() {
        assert_eq!(parse_node("lager/r1/logic"), None);
        assert_eq!(parse_node("lager/R1/logic/3"), None);
        assert_eq!(parse_service("lagerfeld/r1/sensor/line"), None);
        assert_eq!(parse_service("My/Funk/ServiceName"), None);
    }
}
