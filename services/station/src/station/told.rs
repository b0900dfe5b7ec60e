//! What robots do with a warehouse that is another one now.
//!
//! A robot asks for its warehouse when it connects, and never for the floor again: its size does
//! not change while a robot is up. So goods that have changed are told to a robot by having it
//! connect anew, and a floor that has changed is another one from its next start on. A simulated
//! robot is told nothing: its world stays the one in which it was started.

use core::fmt;

use lager_lines::Name;

use super::{Peer, Station};
use crate::robot::{Doing, Other, Robot};

/// What a robot that is connected does with a warehouse that has just been described.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Uses {
    /// It uses it, or does as soon as it asks.
    This(Name),
    /// It is told where the goods are now.
    Told(Name),
    /// It is driven, and asks for the goods when it connects anew.
    Driven(Name),
    /// It goes on with the floor of before.
    FloorBefore(Name),
    /// It is simulated, and its world is the one of before.
    WorldBefore(Name),
}

impl fmt::Display for Uses {
    /// As the part of a sentence.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::This(robot) => write!(formatter, "{robot} uses it"),
            Self::Told(robot) => write!(formatter, "{robot} is told where the goods are"),
            Self::Driven(robot) => write!(
                formatter,
                "{robot} is driven and is told where the goods are when it connects anew"
            ),
            Self::FloorBefore(robot) => write!(
                formatter,
                "{robot} still uses the floor of before, until it is put on the delivery node and \
                 `lager up` is started again"
            ),
            Self::WorldBefore(robot) => write!(
                formatter,
                "{robot} is simulated and still drives in the warehouse of before, until \
                 `lager up` is started again"
            ),
        }
    }
}

impl Station {
    /// Has robots that may use them ask for goods that have changed; what each robot that is
    /// connected does with the warehouse.
    pub(crate) fn tell_goods(&mut self) -> Vec<Uses> {
        let robots = self.robots.iter();
        let here = robots.filter(|(_, robot)| robot.doing() != Doing::Away);
        let uses: Vec<Uses> = here
            .map(|(name, robot)| uses(name.clone(), robot))
            .collect();
        for it in &uses {
            if let Uses::Told(name) = it
                && let Some((&link, _)) =
                    self.links.iter().find(|(_, it)| it.as_ref() == Some(name))
            {
                let why = "the goods have changed: it asks for them anew".to_owned();
                self.close(Peer::Robot(link), why);
            }
        }
        uses
    }
}

fn uses(name: Name, robot: &Robot) -> Uses {
    match robot.uses_other() {
        None => Uses::This(name),
        Some(_) if robot.shown().truth.is_some() => Uses::WorldBefore(name),
        Some(Other::Floor) => Uses::FloorBefore(name),
        Some(Other::Goods) if robot.driver().is_some() => Uses::Driven(name),
        Some(Other::Goods) => Uses::Told(name),
    }
}
