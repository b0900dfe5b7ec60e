//! Which robot has which connection: names, proofs, and the limited number of places.
//!
//! - A name has one connection. While it is alive, the station refuses a second one, and tells both
//!   robots and the people at the station. After [`LIVING`] of silence a connection is dead, and a
//!   robot that connects again takes its place.
//! - There are [`Station::MOST_ROBOTS`] places. Robots of one address that have not proved their
//!   names get at most [`Station::MOST_OF_ONE_ADDRESS`] of them. When no place is left, a robot
//!   that has proved its name takes the place of one that has not. A robot that the station has
//!   known for longer does the same.
//! - A robot that has announced itself repeats that every second. After [`SILENT`] without a line
//!   the station closes its connection.

use std::net::IpAddr;
use std::time::Duration;

use lager_lines::Name;
use lager_lines::conversation::RobotLine;
use lager_lines::extension::Proof;

use super::gag::thought;
use super::{Peer, Station};

/// How long a connection counts as alive after its last line. A robot that has announced itself
/// says something 20 times a second.
const LIVING: Duration = Duration::from_secs(1);
/// How long a robot that has announced itself may say nothing.
const SILENT: Duration = Duration::from_secs(30);
/// How often people hear that another robot says the same name.
const TOLD: Duration = Duration::from_secs(10);

/// A connection of a robot.
#[derive(Clone, Debug, Default)]
pub(super) struct Link {
    /// The robot's name, once it has spoken.
    pub(super) name: Option<Name>,
    from: Option<IpAddr>,
    is_proved: bool,
    /// When it said something last.
    heard: Duration,
    /// When it was told last that another robot says its name.
    told: Option<Duration>,
}

/// What the station knows of a name.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// Since when.
    since: Duration,
    /// A robot has announced itself by this name, so no robot without a name may get it.
    is_announced: bool,
    is_proved: bool,
}

impl Station {
    /// How many connections of robots at one address may have no proof of their names.
    pub const MOST_OF_ONE_ADDRESS: usize = 16;

    /// Where a robot's connection comes from.
    pub fn comes_from(&mut self, link: u64, address: IpAddr) {
        if let Some(link) = self.links.get_mut(&link) {
            link.from = Some(address);
        }
    }

    /// The robot at this connection has proved the name that its next line says.
    pub fn proved(&mut self, link: u64) {
        if let Some(link) = self.links.get_mut(&link) {
            link.is_proved = true;
        }
    }

    /// Sends a peer the question for its proof, or the station's own proof.
    pub fn prove(&mut self, peer: Peer, proof: &Proof) {
        self.put(peer, proof);
    }

    /// Whether a robot has said something by this connection.
    pub fn is_seated(&self, link: u64) -> bool {
        let link = self.links.get(&link);
        link.is_some_and(|link| link.name.is_some())
    }

    /// Refuses a peer that has not become a robot, and tells it why.
    pub fn refuse(&mut self, peer: Peer, why: &str) {
        self.put(peer, &thought(why));
        self.close(peer, why.to_owned());
    }

    pub(super) fn has_connected(&mut self, link: u64) {
        let heard = self.now;
        let link_of = Link {
            heard,
            ..Link::default()
        };
        self.links.insert(link, link_of);
    }

    /// The robot at this connection has said something. Returns its name if it has one.
    pub(super) fn hears(&mut self, link: u64) -> Option<Option<Name>> {
        let link = self.links.get_mut(&link)?;
        link.heard = self.now;
        Some(link.name.clone())
    }

    /// The connection of this robot.
    pub(super) fn link_of(&self, name: &Name) -> Option<u64> {
        let mut links = self.links.iter();
        let found = links.find(|(_, link)| link.name.as_ref() == Some(name));
        found.map(|(&link, _)| link)
    }

    /// The robot for which a GaG speaks: the one that has been connected for the longest time. If
    /// any robot has proved its name, only such robots count.
    pub(super) fn first(&self) -> Option<(u64, Name)> {
        let is_asked = self.known.values().any(|known| known.is_proved);
        let mut links = self.links.iter();
        links.find_map(|(number, link)| {
            let name = link.name.clone();
            name.filter(|_| link.is_proved || !is_asked)
                .map(|name| (*number, name))
        })
    }

    /// Closes the connections of announced robots that have fallen silent.
    pub(super) fn give_up_silent(&mut self) {
        let is_silent = |link: &Link| {
            let robot = link.name.as_ref().and_then(|name| self.robots.get(name));
            robot.is_some_and(|robot| robot.name().is_some())
                && self.now.saturating_sub(link.heard) >= SILENT
        };
        let silent = self.links.iter().filter(|(_, link)| is_silent(link));
        let silent: Vec<_> = silent.map(|(&link, _)| link).collect();
        for link in silent {
            self.close(Peer::Robot(link), "it has fallen silent".to_owned());
        }
    }

    /// Gives a connection the name of its robot.
    pub(super) fn introduce(&mut self, link: u64, said: &RobotLine) -> Result<Name, String> {
        let (name, is_announced) = match said {
            RobotLine::Hello(hello) => (hello.name.clone(), true),
            _ => (self.free_name(), false),
        };
        if let Some(old) = self.link_of(&name) {
            let is_proved = |link: &u64| self.links.get(link).is_some_and(|link| link.is_proved);
            let is_living = self.now.saturating_sub(self.links[&old].heard) < LIVING;
            if is_living && (is_proved(&old) || !is_proved(&link)) {
                self.tell_of_second(old, &name);
                return Err(format!(
                    "robot {name} is connected already, and one robot has one connection; give \
                     this one another name, or end the other one"
                ));
            }
            let why = format!("robot {name} has connected anew");
            self.links.remove(&old);
            self.close(Peer::Robot(old), why);
        }
        self.make_room(link, &name)?;
        if !self.robots.contains_key(&name) {
            self.forget_robot();
            if self.robots.len() >= Self::MOST_ROBOTS {
                let most = Self::MOST_ROBOTS;
                return Err(format!(
                    "{most} robots are known already; end one of them, or empty its queue"
                ));
            }
        }
        self.knows(&name);
        let is_proved = self.links.get(&link).is_some_and(|link| link.is_proved);
        if let Some(known) = self.known.get_mut(&name) {
            known.is_announced |= is_announced;
            known.is_proved |= is_proved;
        }
        let robot = self.robots.entry(name.clone()).or_default();
        robot.turn(self.now);
        robot.connected();
        if let Some(warehouse) = &self.warehouse {
            // The name has been checked, and the robot has asked nothing yet.
            let _ = robot.set_warehouse(warehouse);
        }
        if let Some(link) = self.links.get_mut(&link) {
            link.name = Some(name.clone());
        }
        self.seat_gag();
        Ok(name)
    }

    /// Adds a name that the station does not know yet.
    pub(super) fn knows(&mut self, name: &Name) {
        let since = self.now;
        self.known.entry(name.clone()).or_insert(Known {
            since,
            is_announced: false,
            is_proved: false,
        });
    }

    /// Tells a robot, and who looks at it, of somebody else who says its name.
    fn tell_of_second(&mut self, old: u64, name: &Name) {
        let now = self.now;
        let Some(link) = self.links.get_mut(&old) else {
            return;
        };
        let is_told = link
            .told
            .is_some_and(|told| now.saturating_sub(told) < TOLD);
        if is_told {
            return;
        }
        link.told = Some(now);
        let from = match link.from {
            Some(from) => format!(" at {from}"),
            None => String::new(),
        };
        let why = format!("somebody else{from} says that he is robot {name}; he is refused");
        let sentence = thought(&why);
        self.put(Peer::Robot(old), &sentence);
        if let Some(robot) = self.robots.get_mut(name) {
            robot.is_told(&why);
        }
    }

    /// Sees to it that there is a place for `name` at this connection.
    fn make_room(&mut self, link: u64, name: &Name) -> Result<(), String> {
        let Some(new) = self.links.get(&link) else {
            return Ok(());
        };
        let seated = || self.links.iter().filter(|(_, link)| link.name.is_some());
        let is_beside = |other: &Link| !other.is_proved && other.from == new.from;
        let beside = seated().filter(|(_, other)| is_beside(other)).count();
        let is_full = seated().count() >= Self::MOST_ROBOTS;
        let is_crowded =
            !new.is_proved && new.from.is_some() && beside >= Self::MOST_OF_ONE_ADDRESS;
        if !is_full && !is_crowded {
            return Ok(());
        }
        let since = |name: &Name| self.known.get(name).map_or(self.now, |known| known.since);
        let may_go = |(_, other): &(&u64, &Link)| {
            !other.is_proved && (!is_crowded || other.from == new.from)
        };
        let youngest = seated()
            .filter(may_go)
            .max_by_key(|(number, other)| (other.name.as_ref().map(since), **number));
        let goes = youngest.filter(|(_, other)| {
            new.is_proved
                || other
                    .name
                    .as_ref()
                    .is_some_and(|other| since(name) < since(other))
        });
        let Some((&goes, _)) = goes else {
            let most = match is_crowded {
                true => format!(
                    "{} robots of this address that have not proved who they are are connected, \
                     which is as many as may be; `--robots-secret FILE` lets more of them prove it",
                    Self::MOST_OF_ONE_ADDRESS
                ),
                false => format!(
                    "{} robots are connected, and no more can be",
                    Self::MOST_ROBOTS
                ),
            };
            return Err(most);
        };
        self.refuse(
            Peer::Robot(goes),
            &format!("its place is robot {name}'s, which has proved who it is or came before it"),
        );
        Ok(())
    }

    fn free_name(&self) -> Name {
        let is_taken = |name: &Name| {
            let is_announced = self.known.get(name).is_some_and(|known| known.is_announced);
            is_announced || self.link_of(name).is_some()
        };
        (1..)
            .filter_map(|number| Name::new(format!("robot-{number}")).ok())
            .find(|name| !is_taken(name))
            .expect("there are more names than connections")
    }

    /// Makes room for a robot by forgetting the one that has been known for the shortest time, of
    /// those that are away and have nothing to fetch.
    fn forget_robot(&mut self) {
        if self.robots.len() < Self::MOST_ROBOTS {
            return;
        }
        let is_of_no_use = |(name, robot): &(&Name, &crate::Robot)| {
            robot.queue().next().is_none() && self.link_of(name).is_none()
        };
        let away = self
            .robots
            .iter()
            .filter(is_of_no_use)
            .map(|(name, _)| name);
        let away = away.max_by_key(|name| self.known.get(*name).map(|known| known.since));
        if let Some(name) = away.cloned() {
            self.robots.remove(&name);
            self.known.remove(&name);
        }
    }
}
