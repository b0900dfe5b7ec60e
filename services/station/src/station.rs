//! The external computer as a whole: robots by their names, and a GaG that speaks for one of them.
//!
//! ```text
//!   a connection's first line         its robot is called
//!   lager 1 <name> [<ms>]             by that name; it is answered `lager 1 <station> [<ms>]`
//!   anything else of a robot          robot-1, robot-2 ..., the first that is free
//! ```
//!
//! - A name has one connection, the newest: the one before is closed, because a robot that comes
//!   back may have left a connection whose end this station has not noticed.
//! - A line that breaks the grammar closes its connection; no part of it counts.
//! - A GaG's language has no names of robots, so it speaks for one: the one that has been connected
//!   for longest. The others are answered from the warehouse and their queues.
//! - What a GaG says moves no robot when it may have waited for more than 200 ms, or may have been
//!   meant for the robot for which the GaG spoke before. One that reads nothing drives nobody on.
//! - A GaG's answers are checked as a file is. The station refuses an impossible answer in a
//!   `thought` and asks again. It takes over what a GaG says of the warehouse.
//!
//! - A person drives a robot that speaks the extension by actions (`station/actions.rs`); meanwhile
//!   neither a GaG nor anybody else here moves it, but anybody stops it.
//!
//! It is pure: time, lines and wishes in, [`Output`]s out, in the order in which they came about.

use std::collections::BTreeMap;
use std::time::Duration;

use lager_lines::conversation::{Held, RobotLine, StationLine};
use lager_lines::extension::{Hello, Order};
use lager_lines::gag::Request;
use lager_lines::splitter::LineError;
use lager_lines::{Map, Name, ProductId, Products, SideLength, to_line};
use lager_wire::OperatorCommand;
use thiserror::Error;

use crate::queues::Queues;
use crate::robot::{ActRefused, CommandRefused, FetchRefused, Robot};
use crate::warehouse::{Warehouse, WarehouseError};

mod actions;
mod gag;
mod told;

pub use actions::News;
pub use told::Uses;

/// Who is at the other end of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Peer {
    /// A robot, by the number of its connection; numbers grow and are never used again.
    Robot(u64),
    /// The GaG.
    Gag,
}

/// What is to be done to a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// A line with its end is said.
    Say {
        /// To whom.
        to: Peer,
        /// What.
        line: String,
    },
    /// The same, before all lines that wait to be said: a stop.
    SayFirst {
        /// To whom.
        to: Peer,
        /// What.
        line: String,
    },
    /// It is closed.
    Close {
        /// Whose.
        peer: Peer,
        /// Why, as a sentence.
        why: String,
    },
}

/// What a person wants of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Have a product fetched after those that wait.
    Fetch(ProductId),
    /// Have a product that waits not fetched.
    Cancel(ProductId),
    /// Give a command.
    Command(OperatorCommand),
    /// Tell it that the goods are in the gripper.
    PickedUp,
}

/// Why a wish is not fulfilled.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WishRefused {
    /// There is no such robot.
    #[error("there is no robot {0} here; it connects by itself once it is up")]
    NoRobot(Name),
    /// The command is not given.
    #[error(transparent)]
    Command(#[from] CommandRefused),
    /// The action is not given.
    #[error(transparent)]
    Act(#[from] ActRefused),
    /// The product is not fetched.
    #[error(transparent)]
    Fetch(#[from] FetchRefused),
    /// The product does not wait.
    #[error("product {0} does not wait to be fetched")]
    NotQueued(ProductId),
}

/// The external computer.
#[derive(Clone, Debug)]
pub struct Station {
    name: Name,
    warehouse: Option<Warehouse>,
    robots: BTreeMap<Name, Robot>,
    /// The connections of robots, the oldest first, and the names of those that have spoken.
    links: BTreeMap<u64, Option<Name>>,
    gag: Option<Gag>,
    outputs: Vec<Output>,
    is_unsaved: bool,
    now: Duration,
}

/// The GaG that is connected.
#[derive(Clone, Debug, Default)]
struct Gag {
    /// What it has been asked and has not answered.
    held: Held,
    /// The robot it speaks for.
    robot: Option<Name>,
    /// That robot's connection.
    link: Option<u64>,
    /// What it says may still be meant for this robot, for which it spoke before.
    may_mean: Option<Name>,
    /// Since when it has not read all that it has been told, by the station's clock.
    unread: Option<Duration>,
    /// When it was told something last.
    told: Duration,
    side: Option<SideLength>,
    map: Option<Map>,
    products: Option<Products>,
}

impl Station {
    /// Robots that are remembered, at most. Of those that are away the ones without a queue are
    /// forgotten first.
    pub const MOST_ROBOTS: usize = 64;

    /// An external computer that calls itself `name`.
    ///
    /// # Errors
    ///
    /// When there can be no such warehouse.
    pub fn new(name: Name, warehouse: Option<Warehouse>) -> Result<Self, WarehouseError> {
        if let Some(warehouse) = &warehouse {
            warehouse.check()?;
        }
        Ok(Self {
            name,
            warehouse,
            robots: BTreeMap::new(),
            links: BTreeMap::new(),
            gag: None,
            outputs: Vec::new(),
            is_unsaved: false,
            now: Duration::ZERO,
        })
    }

    /// What is to be done, oldest first; it is then no longer here.
    pub fn outputs(&mut self) -> Vec<Output> {
        core::mem::take(&mut self.outputs)
    }

    /// The robots that are known, connected or not.
    pub fn robots(&self) -> impl Iterator<Item = (&Name, &Robot)> {
        self.robots.iter()
    }

    /// One robot.
    pub fn robot(&self, name: &Name) -> Option<&Robot> {
        self.robots.get(name)
    }

    /// Whether a GaG is connected.
    pub const fn has_gag(&self) -> bool {
        self.gag.is_some()
    }

    /// The warehouse, once it is known.
    pub const fn warehouse(&self) -> Option<&Warehouse> {
        self.warehouse.as_ref()
    }

    /// The warehouse is another one now; robots that wait for it are told.
    ///
    /// # Errors
    ///
    /// When there can be no such warehouse; the one before is kept.
    pub fn set_warehouse(&mut self, warehouse: Warehouse) -> Result<(), WarehouseError> {
        warehouse.check()?;
        let names: Vec<Name> = self.robots.keys().cloned().collect();
        for name in names {
            let robot = self.robots.get_mut(&name).expect("a name of the list");
            let line = robot.set_warehouse(&warehouse)?;
            self.say(&name, line);
        }
        self.warehouse = Some(warehouse);
        self.is_unsaved = true;
        Ok(())
    }

    /// The warehouse, if it is another one than when this was asked last and is to be saved.
    pub fn unsaved(&mut self) -> Option<Warehouse> {
        core::mem::take(&mut self.is_unsaved)
            .then(|| self.warehouse.clone())
            .flatten()
    }

    /// What waits to be fetched, to be saved.
    pub fn queues(&self) -> Queues {
        let waits = |robot: &Robot| robot.unfetched().map(ProductId::get).collect::<Vec<_>>();
        let queues = self.robots.iter();
        let queues = queues.map(|(name, robot)| (name.to_string(), waits(robot)));
        Queues(queues.filter(|(_, waits)| !waits.is_empty()).collect())
    }

    /// Has a product fetched by a robot that need not have connected yet.
    ///
    /// # Errors
    ///
    /// When the warehouse does not have it or too many wait.
    pub fn fetch(&mut self, name: &Name, product: ProductId) -> Result<(), WishRefused> {
        if !self.robots.contains_key(name) {
            let mut robot = Robot::default();
            if let Some(warehouse) = &self.warehouse {
                // It has been checked, and nothing is asked yet.
                let _ = robot.set_warehouse(warehouse);
            }
            robot.fetch(product)?;
            self.robots.insert(name.clone(), robot);
            return Ok(());
        }
        self.wish(name, Wish::Fetch(product))
    }

    /// Does what a person wants of a robot.
    ///
    /// # Errors
    ///
    /// When it cannot be done; nothing has changed then.
    pub fn wish(&mut self, name: &Name, wish: Wish) -> Result<(), WishRefused> {
        let Some(robot) = self.robots.get_mut(name) else {
            return Err(WishRefused::NoRobot(name.clone()));
        };
        let line = match wish {
            Wish::Fetch(product) => robot.fetch(product)?,
            Wish::Cancel(product) if robot.cancel(product) => None,
            Wish::Cancel(product) => return Err(WishRefused::NotQueued(product)),
            Wish::Command(command) => {
                if let Some(by) = robot.driver().filter(|_| command != OperatorCommand::Stop) {
                    let by = by.to_owned();
                    return Err(ActRefused::Driven { by }.into());
                }
                robot.command(command)?
            }
            Wish::PickedUp => robot.picked_up()?,
        };
        self.say(name, line);
        Ok(())
    }
}

/// What peers do.
impl Station {
    /// Somebody has connected.
    pub fn connected(&mut self, peer: Peer) {
        match peer {
            Peer::Robot(link) => {
                self.links.insert(link, None);
            }
            Peer::Gag => {
                self.gag = Some(Gag::default());
                self.seat_gag();
            }
        }
    }

    /// A connection has ended.
    pub fn disconnected(&mut self, peer: Peer) {
        match peer {
            Peer::Robot(link) => {
                if let Some(Some(name)) = self.links.remove(&link)
                    && let Some(robot) = self.robots.get_mut(&name)
                {
                    robot.disconnected();
                }
            }
            Peer::Gag => {
                let robot = self.gag.take().and_then(|gag| gag.robot);
                robot.into_iter().for_each(|name| self.unseat(&name));
            }
        }
        self.seat_gag();
    }

    /// A peer has sent a line, or bytes that cannot be one.
    pub fn heard(&mut self, peer: Peer, line: Result<&str, LineError>) {
        self.heard_late(peer, Duration::ZERO, line);
    }

    /// The same of a line that may have waited for so long before the station read it. A robot
    /// tells of itself, and that is taken however late it comes.
    pub fn heard_late(&mut self, peer: Peer, late: Duration, line: Result<&str, LineError>) {
        let line = match line {
            Ok(line) => line,
            Err(error) => return self.close(peer, error.to_string()),
        };
        match peer {
            Peer::Robot(link) => self.robot_said(link, line),
            Peer::Gag => self.gag_said(late, line),
        }
    }

    fn robot_said(&mut self, link: u64, line: &str) {
        let Some(named) = self.links.get(&link).cloned() else {
            return;
        };
        let said = match RobotLine::read(line) {
            Ok(said) => said,
            Err(error) => return self.close(Peer::Robot(link), error.to_string()),
        };
        let name = match named {
            Some(name) => name,
            None => match self.introduce(link, &said) {
                Ok(name) => name,
                Err(why) => return self.close(Peer::Robot(link), why),
            },
        };
        let signed = match &said {
            RobotLine::Hello(hello) => Some(hello.clock_ms),
            _ => None,
        };
        if let Some(Gag { robot, .. }) = &self.gag
            && robot.as_ref() == Some(&name)
            && let RobotLine::Request(Request::Telemetry(telemetry)) = &said
        {
            let telemetry = Request::Telemetry(telemetry.clone());
            self.put(Peer::Gag, &telemetry);
        }
        let answer = self
            .robots
            .get_mut(&name)
            .and_then(|robot| robot.heard(said));
        if let Some(clock_ms) = signed {
            let hello = Hello {
                version: Hello::VERSION,
                name: self.name.clone(),
                clock_ms,
            };
            self.put(Peer::Robot(link), &StationLine::Hello(hello));
        }
        self.say(&name, answer);
        self.ask_gag(&name);
    }

    /// Gives a connection the name of its robot.
    fn introduce(&mut self, link: u64, said: &RobotLine) -> Result<Name, String> {
        let name = match said {
            RobotLine::Hello(hello) => hello.name.clone(),
            _ => self.free_name(),
        };
        let before = |(_, named): &(&u64, &Option<Name>)| named.as_ref() == Some(&name);
        if let Some((&old, _)) = self.links.iter().find(before) {
            let why = format!("robot {name} has connected anew");
            self.links.remove(&old);
            self.close(Peer::Robot(old), why);
        }
        if !self.robots.contains_key(&name) {
            self.forget_robots();
            if self.robots.len() >= Self::MOST_ROBOTS {
                let most = Self::MOST_ROBOTS;
                return Err(format!(
                    "{most} robots are known already; end one of them, or empty its queue"
                ));
            }
        }
        let robot = self.robots.entry(name.clone()).or_default();
        robot.turn(self.now);
        robot.connected();
        if let Some(warehouse) = &self.warehouse {
            // It has been checked, and nothing is asked yet.
            let _ = robot.set_warehouse(warehouse);
        }
        self.links.insert(link, Some(name.clone()));
        self.seat_gag();
        Ok(name)
    }

    fn free_name(&self) -> Name {
        let taken = |name: &Name| self.links.values().flatten().any(|other| other == name);
        (1..)
            .filter_map(|number| Name::new(format!("robot-{number}")).ok())
            .find(|name| !taken(name))
            .expect("there are more names than connections")
    }

    /// Makes room for a robot by forgetting one of which nothing needs to be remembered.
    fn forget_robots(&mut self) {
        if self.robots.len() >= Self::MOST_ROBOTS {
            let links = &self.links;
            self.robots.retain(|name, robot| {
                robot.queue().next().is_some() || links.values().flatten().any(|one| one == name)
            });
        }
    }
}

/// What is said.
impl Station {
    /// Says a line to a robot, on the connection it has.
    fn say(&mut self, name: &Name, line: Option<StationLine>) {
        let mut links = self.links.iter();
        let link = links.find(|(_, named)| named.as_ref() == Some(name));
        let (Some(line), Some((&link, _))) = (line, link) else {
            return;
        };
        let to = Peer::Robot(link);
        match line {
            StationLine::Order(Order::Stop { .. }) => {
                let line = format!("{line}\n");
                self.outputs.insert(0, Output::SayFirst { to, line });
            }
            line => self.put(to, &line),
        }
    }

    fn put(&mut self, to: Peer, line: &impl core::fmt::Display) {
        match to_line(line) {
            Ok(line) => {
                if let (Peer::Gag, Some(gag)) = (to, &mut self.gag) {
                    gag.told = self.now;
                }
                self.outputs.push(Output::Say { to, line });
            }
            // Everything that is too long has been refused before; a text of a peer is a line's.
            Err(error) => self.close(to, error.to_string()),
        }
    }

    fn close(&mut self, peer: Peer, why: String) {
        self.outputs.push(Output::Close { peer, why });
        self.disconnected(peer);
    }
}
