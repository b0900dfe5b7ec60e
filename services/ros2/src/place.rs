//! Where in ROS 2 the node is found: the domain, and how far it is heard. From flags first, then from
//! the variables that every program of ROS 2 reads.

use std::fmt;

/// A place in ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The domain. Programs in different domains never meet.
    pub domain: u16,
    /// How far the node is heard.
    pub reach: Reach,
}

/// How far a node is heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Reach {
    /// On this machine.
    Localhost,
    /// By every machine in the network.
    Subnet,
}

/// Why there is no such place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlaceError {
    /// The domain is none.
    #[error(
        "{from} is `{said}`, and a domain of ROS 2 is a number from 0 to {MOST_DOMAINS}; those up to \
         101 are free on every machine"
    )]
    Domain {
        /// Who says it.
        from: &'static str,
        /// What is said.
        said: String,
    },
    /// Nobody would hear the node.
    #[error(
        "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF, so no program would find the robot; set it to LOCALHOST \
         or SUBNET, or give --range"
    )]
    Off,
    /// The variable has another value.
    #[error(
        "ROS_AUTOMATIC_DISCOVERY_RANGE is `{0}`, which is not known here; it may be LOCALHOST or SUBNET"
    )]
    Range(String),
}

/// The ports of a higher domain would be beyond 65535.
const MOST_DOMAINS: u16 = 232;

impl Place {
    /// The place that flags and variables name; `variable` reads one. Without any it is domain 0 on
    /// this machine alone, while a plain program of ROS 2 would be heard in the whole network.
    ///
    /// # Errors
    /// What they say is no place, or nobody would hear the node.
    pub fn of(
        domain: Option<u16>,
        reach: Option<Reach>,
        variable: impl Fn(&str) -> Option<String>,
    ) -> Result<Self, PlaceError> {
        let set = |name| variable(name).filter(|said| !said.is_empty());
        let (from, said) = match (domain, set("ROS_DOMAIN_ID")) {
            (Some(domain), _) => ("--domain", domain.to_string()),
            (None, Some(said)) => ("ROS_DOMAIN_ID", said),
            (None, None) => ("the domain", "0".to_owned()),
        };
        let number = said.trim().parse().ok();
        let Some(domain) = number.filter(|domain| *domain <= MOST_DOMAINS) else {
            return Err(PlaceError::Domain { from, said });
        };
        let reach = match (reach, set("ROS_AUTOMATIC_DISCOVERY_RANGE").as_deref()) {
            (Some(reach), _) => reach,
            // The older variable wins in ROS 2 as well.
            (None, _) if set("ROS_LOCALHOST_ONLY").as_deref() == Some("1") => Reach::Localhost,
            (None, None | Some("LOCALHOST")) => Reach::Localhost,
            (None, Some("SUBNET" | "SYSTEM_DEFAULT")) => Reach::Subnet,
            (None, Some("OFF")) => return Err(PlaceError::Off),
            (None, Some(other)) => return Err(PlaceError::Range(other.to_owned())),
        };
        Ok(Self { domain, reach })
    }
}

impl fmt::Display for Reach {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Localhost => "LOCALHOST",
            Self::Subnet => "SUBNET",
        })
    }
}

impl fmt::Display for Place {
    /// Writes the place and who reaches it.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { domain, reach } = self;
        let who = match reach {
            Reach::Localhost => "this machine alone",
            Reach::Subnet => "everybody in the network",
        };
        write!(formatter, "domain {domain}, range {reach}: {who}")
    }
}

/// The name of a robot as ROS allows it: `r-1` is `r_1`, and `7` is `robot_7`.
pub fn node_name(robot: &str) -> String {
    let words: Vec<&str> = robot.split('-').filter(|word| !word.is_empty()).collect();
    let name = words.join("_");
    match name.starts_with(|first: char| first.is_ascii_lowercase()) {
        true => name,
        false => format!("robot_{name}").trim_end_matches('_').to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(
        domain: Option<u16>,
        reach: Option<Reach>,
        set: &[(&str, &str)],
    ) -> Result<Place, PlaceError> {
        Place::of(domain, reach, |name| {
            let mut set = set.iter();
            let (_, said) = set.find(|(one, _)| *one == name)?;
            Some((*said).to_owned())
        })
    }

    #[test]
    fn without_a_word_it_is_this_machine_alone() {
        let place = place(None, None, &[]).expect("a place");
        assert_eq!((place.domain, place.reach), (0, Reach::Localhost));
        assert_eq!(
            place.to_string(),
            "domain 0, range LOCALHOST: this machine alone"
        );
    }

    #[test]
    fn the_variables_of_ros_are_obeyed_and_flags_win() {
        let set = [
            ("ROS_DOMAIN_ID", "42"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"),
        ];
        let told = place(None, None, &set).expect("a place");
        assert_eq!((told.domain, told.reach), (42, Reach::Subnet));
        let flagged = place(Some(7), Some(Reach::Localhost), &set).expect("a place");
        assert_eq!((flagged.domain, flagged.reach), (7, Reach::Localhost));
        let older = [set[1], ("ROS_LOCALHOST_ONLY", "1")];
        assert_eq!(
            place(None, None, &older).expect("a place").reach,
            Reach::Localhost
        );
    }

    #[test]
    fn what_is_no_place_is_refused_with_what_may_be_said() {
        for (name, said, words) in [
            ("ROS_DOMAIN_ID", "233", "from 0 to 232"),
            ("ROS_DOMAIN_ID", "one", "ROS_DOMAIN_ID is `one`"),
            (
                "ROS_AUTOMATIC_DISCOVERY_RANGE",
                "OFF",
                "no program would find",
            ),
            (
                "ROS_AUTOMATIC_DISCOVERY_RANGE",
                "WORLD",
                "LOCALHOST or SUBNET",
            ),
        ] {
            let refused = place(None, None, &[(name, said)]).expect_err("no place");
            assert!(refused.to_string().contains(words), "{refused}");
        }
    }

    #[test]
    fn every_robot_has_a_name_of_ros() {
        for (robot, name) in [
            ("r1", "r1"),
            ("r-1", "r_1"),
            ("a--b-", "a_b"),
            ("7", "robot_7"),
            ("--", "robot"),
        ] {
            assert_eq!(node_name(robot), name);
        }
    }
}
