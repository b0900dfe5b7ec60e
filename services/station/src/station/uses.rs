//! What robots do when somebody has changed the warehouse.
//!
//! A robot asks for its warehouse when it connects. It asks for the floor only once, because the
//! floor does not change while a robot is up. So after a change of the goods the station ends the
//! connection; the robot connects again and asks for the goods. A changed floor counts from the
//! robot's next start. The station tells a simulated robot nothing, because the simulated world
//! stays as it was at its start, until somebody has it made anew ([`Handle::robots`] says of each
//! robot which warehouse it uses).
//!
//! [`Handle::robots`]: crate::Handle::robots

use lager_lines::Name;
use lager_orders::{Code, Reason};

use super::{Peer, Station};
use crate::robot::{Doing, Other, Robot};

/// What a connected robot does with a warehouse that somebody has just described.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Uses {
    /// It uses the warehouse now, or as soon as it asks.
    This(Name),
    /// The station tells it where the goods are now.
    Told(Name),
    /// A person drives it. It asks for the goods when it connects again.
    Driven(Name),
    /// It keeps the floor of before.
    FloorBefore(Name),
    /// It is simulated and stays in the world of before.
    WorldBefore(Name),
}

impl Uses {
    /// What `robot` does with the station's warehouse.
    pub(crate) fn of(name: Name, robot: &Robot) -> Self {
        match robot.uses_other() {
            None => Self::This(name),
            Some(_) if robot.shown().truth.is_some() => Self::WorldBefore(name),
            Some(Other::Floor) => Self::FloorBefore(name),
            Some(Other::Goods) if robot.driver().is_some() => Self::Driven(name),
            Some(Other::Goods) => Self::Told(name),
        }
    }

    /// Its word for programs.
    pub const fn as_str(&self) -> &'static str {
        match self {
            Self::This(_) => "this",
            Self::Told(_) => "told",
            Self::Driven(_) => "driven",
            Self::FloorBefore(_) => "floor_before",
            Self::WorldBefore(_) => "world_before",
        }
    }
}

impl From<&Uses> for Reason {
    fn from(uses: &Uses) -> Self {
        let (code, robot) = match uses {
            Uses::This(robot) => (Code::UsesThis, robot),
            Uses::Told(robot) => (Code::UsesTold, robot),
            Uses::Driven(robot) => (Code::UsesDriven, robot),
            Uses::FloorBefore(robot) => (Code::UsesFloorBefore, robot),
            Uses::WorldBefore(robot) => (Code::UsesWorldBefore, robot),
        };
        Self::new(code, &[robot])
    }
}

impl Station {
    /// Makes robots ask for changed goods, if they can use them. Returns what each connected robot
    /// does with the warehouse.
    pub(crate) fn tell_goods(&mut self) -> Vec<Uses> {
        let robots = self.robots.iter();
        let here = robots.filter(|(_, robot)| robot.doing() != Doing::Away);
        let uses: Vec<Uses> = here
            .map(|(name, robot)| Uses::of(name.clone(), robot))
            .collect();
        for it in &uses {
            if let Uses::Told(name) = it
                && let Some(link) = self.link_of(name)
            {
                let why = "the goods have changed: it asks for them anew".to_owned();
                self.close(Peer::Robot(link), why);
            }
        }
        uses
    }
}
