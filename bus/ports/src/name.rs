//! Makes and reads the names of nodes, services and ports. Tools know processes by these names
//! only.

use lager_home::UnitName;
use lager_sample::{Application, Part};

/// The ending that the actors' service has after the topic's name.
const ACTORS: &str = ":actors";

/// Whether a topic may have this name. It has no colon: other services' names have one.
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

/// The topic to which the service of that name belongs, be it the public or the actors' one.
pub(crate) fn topic_of(service: &str) -> &str {
    service.strip_suffix(ACTORS).unwrap_or(service)
}

/// The full name of a topic, request or wake service.
pub(crate) fn service(application: &Application, unit: &UnitName, name: &str) -> String {
    format!("{}/{unit}/{name}", application.family)
}

/// The unit and the relative name of a service, if it is one of the application's.
pub(crate) fn parse_service<'name>(
    application: &Application,
    name: &'name str,
) -> Option<(UnitName, &'name str)> {
    let (unit, topic) = name
        .strip_prefix(application.family)?
        .strip_prefix('/')?
        .split_once('/')?;
    Some((unit.parse().ok()?, topic))
}

/// The name of a process's node.
pub(crate) fn node(application: &Application, unit: &UnitName, part: Part, pid: u32) -> String {
    service(application, unit, &port(part, pid))
}

/// The unit, part and process id of a node, if it is one of the application's.
pub(crate) fn parse_node<'name>(
    application: &Application,
    name: &'name str,
) -> Option<(UnitName, &'name str, u32)> {
    let (unit, rest) = parse_service(application, name)?;
    let (part, pid, _) = parse_port(rest)?;
    Some((unit, part, pid))
}

/// The ending of the name of an observer's port.
const OBSERVES: &str = "/observes";

/// The name of a port of a process.
pub(crate) fn port(part: Part, pid: u32) -> String {
    let observes = if part.is_observer() { OBSERVES } else { "" };
    format!("{part}/{pid}{observes}")
}

/// The part, the process id, and whether the port is an observer's; `None` if it is none of ours.
pub(crate) fn parse_port(name: &str) -> Option<(&str, u32, bool)> {
    let process = name.strip_suffix(OBSERVES);
    let (part, pid) = process.unwrap_or(name).split_once('/')?;
    Some((part, pid.parse().ok()?, process.is_some()))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An application without a topic.
    pub(crate) static WEATHER: Application = Application::new("weather");

    #[test]
    fn names_are_read_back_as_they_were_made() {
        let unit: UnitName = "r-2".parse().unwrap();
        let sailor = Part::new(3, "sailor");
        let onlooker = Part::new(4, "onlooker").observing();
        for (part, observes) in [(sailor, false), (onlooker, true)] {
            assert_eq!(
                parse_node(&WEATHER, &node(&WEATHER, &unit, part, 4711)),
                Some((unit.clone(), part.name(), 4711))
            );
            let port = port(part, 9);
            assert_eq!(parse_port(&port), Some((part.name(), 9, observes)));
        }
        let now = service(&WEATHER, &unit, "now");
        assert_eq!(now, "weather/r-2/now");
        assert_eq!(parse_service(&WEATHER, &now), Some((unit, "now")));
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
        assert_eq!(parse_node(&WEATHER, "weather/r1/logic"), None);
        assert_eq!(parse_node(&WEATHER, "weather/R1/logic/3"), None);
        assert_eq!(parse_service(&WEATHER, "weathers/r1/now"), None);
        assert_eq!(parse_service(&WEATHER, "My/Funk/ServiceName"), None);
    }
}
