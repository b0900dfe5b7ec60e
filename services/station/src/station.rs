//! The external computer as a whole: robots by their names, and a GaG that speaks for one of them.
//!
//! ```text
//!   a connection's first line         its robot is called
//!   lager 1 <name> [<ms>]             by that name; the answer is `lager 1 <station> [<ms>]`
//!   anything else of a robot          robot-1, robot-2 ..., the first that is free
//! ```
//!
//! - A name has one connection, and the number of connections is limited (`station/links.rs`). A
//!   robot has proved its name before its lines come here (`gate.rs`).
//! - A line that breaks the grammar closes its connection; the station ignores the whole line.
//! - A GaG's language has no names of robots. So a GaG speaks for one robot: the one that has been
//!   connected for the longest time. The station answers the others itself, from the warehouse and
//!   their queues.
//! - The station refuses a GaG's command that may be older than 200 ms, and one that may be meant
//!   for the robot for which the GaG spoke before. A robot stands when the GaG that drives it stops
//!   reading.
//! - The station checks a GaG's answers as it checks a file. It refuses an impossible answer with a
//!   `thought`, and asks again. It takes over what a GaG says of the warehouse.
//! - A person who drives a robot by actions (`station/actions.rs`) drives alone: neither a GaG nor
//!   another person moves the robot then. Anybody may stop it.
//!
//! It is pure: time, lines and wishes in, [`Output`]s out, in their order.

use std::collections::BTreeMap;
use std::time::Duration;

use lager_floor::{Grid, ProductId, SideLength};
use lager_lines::conversation::{Held, RobotLine, StationLine};
use lager_lines::extension::{Hello, Order};
use lager_lines::gag::Request;
use lager_lines::splitter::LineError;
use lager_lines::{Name, Products, to_line};
use lager_orders::{Code, Reason};
use lager_plant::Warehouse;
use lager_wire::OperatorCommand;
use thiserror::Error;

use crate::queues::Queues;
use crate::robot::{ActRefused, CommandRefused, FetchRefused, Robot};
use crate::warehouse;

mod actions;
mod gag;
mod links;
mod uses;

use links::{Known, Link};

pub use actions::RobotSaid;
pub use uses::Uses;

/// The peer at the other end of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Peer {
    /// A robot, by the number of its connection. Numbers grow and never come twice.
    Robot(u64),
    /// The GaG.
    Gag,
}

/// What the sockets have to do with a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// Write this line and its end.
    Say {
        /// To whom.
        to: Peer,
        /// What.
        line: String,
    },
    /// Write this line before all lines that wait, because it is a stop.
    SayFirst {
        /// To whom.
        to: Peer,
        /// What.
        line: String,
    },
    /// Close it.
    Close {
        /// Whose.
        peer: Peer,
        /// Why, as a sentence.
        why: String,
    },
}

/// A person's wish for a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Fetch a product, after those that wait.
    Fetch(ProductId),
    /// Do not fetch a product that waits.
    Cancel(ProductId),
    /// Give a command.
    Command(OperatorCommand),
    /// Tell the robot that the goods are in the gripper.
    PickedUp,
}

/// Why the station refuses a wish.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", Reason::from(self))]
pub enum WishRefused {
    /// There is no such robot.
    NoRobot(Name),
    /// The robot does not get the command.
    Command(#[from] CommandRefused),
    /// The robot does not get the action.
    Act(#[from] ActRefused),
    /// The robot does not get the product into its queue.
    Fetch(#[from] FetchRefused),
    /// The product does not wait in the queue.
    NotQueued(ProductId),
}

impl From<&WishRefused> for Reason {
    fn from(why: &WishRefused) -> Self {
        match why {
            WishRefused::NoRobot(robot) => Self::new(Code::NoRobot, &[robot]),
            WishRefused::Command(why) => (*why).into(),
            WishRefused::Act(why) => why.into(),
            WishRefused::Fetch(why) => why.into(),
            WishRefused::NotQueued(product) => Self::new(Code::NotQueued, &[product]),
        }
    }
}

/// The external computer.
#[derive(Clone, Debug)]
pub struct Station {
    name: Name,
    warehouse: Option<Warehouse>,
    robots: BTreeMap<Name, Robot>,
    /// The connections of robots, the oldest first.
    links: BTreeMap<u64, Link>,
    /// The names that the station knows.
    known: BTreeMap<Name, Known>,
    gag: Option<Gag>,
    outputs: Vec<Output>,
    is_unsaved: bool,
    now: Duration,
}

/// The GaG that is connected.
#[derive(Clone, Debug, Default)]
struct Gag {
    /// The question that the station has asked it, until it answers.
    held: Held,
    /// The robot it speaks for.
    robot: Option<Name>,
    /// That robot's connection.
    link: Option<u64>,
    /// The robot for which it spoke before; its next line may still be meant for that one.
    may_mean: Option<Name>,
    /// The station has told it something since it speaks for another robot.
    is_told: bool,
    /// Since when lines wait that it has not read, by the station's clock.
    unread: Option<Duration>,
    /// When the station told it something last.
    told: Duration,
    side: Option<SideLength>,
    map: Option<Grid>,
    products: Option<Products>,
}

impl Station {
    /// How many robots the station remembers. Robots that are away and have no queue are forgotten
    /// first.
    pub const MOST_ROBOTS: usize = 64;

    /// An external computer that calls itself `name`.
    ///
    /// # Errors
    ///
    /// Such a warehouse cannot exist.
    pub fn new(name: Name, warehouse: Option<Warehouse>) -> Result<Self, Reason> {
        if let Some(warehouse) = &warehouse {
            warehouse::told(warehouse)?;
        }
        Ok(Self {
            name,
            warehouse,
            robots: BTreeMap::new(),
            links: BTreeMap::new(),
            known: BTreeMap::new(),
            gag: None,
            outputs: Vec::new(),
            is_unsaved: false,
            now: Duration::ZERO,
        })
    }

    /// Takes what the sockets have to do, the oldest first.
    pub fn outputs(&mut self) -> Vec<Output> {
        core::mem::take(&mut self.outputs)
    }

    /// Whether the sockets have something to do.
    pub(crate) fn has_outputs(&self) -> bool {
        !self.outputs.is_empty()
    }

    /// All robots that the station knows, connected or not.
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

    /// The warehouse, once the station knows it.
    pub const fn warehouse(&self) -> Option<&Warehouse> {
        self.warehouse.as_ref()
    }

    /// Sets another warehouse, and answers robots that wait for it.
    ///
    /// # Errors
    ///
    /// Such a warehouse cannot exist. The one before stays.
    pub fn set_warehouse(&mut self, warehouse: Warehouse) -> Result<(), Reason> {
        warehouse::told(&warehouse)?;
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

    /// The warehouse, if it has changed since the last call and must be saved.
    pub fn unsaved(&mut self) -> Option<Warehouse> {
        core::mem::take(&mut self.is_unsaved)
            .then(|| self.warehouse.clone())
            .flatten()
    }

    /// The products that wait, for the file.
    pub fn queues(&self) -> Queues {
        let waits = |robot: &Robot| robot.unfetched().map(ProductId::get).collect::<Vec<_>>();
        let queues = self.robots.iter();
        let queues = queues.map(|(name, robot)| (name.to_string(), waits(robot)));
        Queues(queues.filter(|(_, waits)| !waits.is_empty()).collect())
    }

    /// Puts a product in the queue of a robot that may not have connected yet.
    ///
    /// # Errors
    ///
    /// The warehouse has no such product, or too many wait.
    pub fn fetch(&mut self, name: &Name, product: ProductId) -> Result<(), WishRefused> {
        if !self.robots.contains_key(name) {
            let mut robot = Robot::default();
            if let Some(warehouse) = &self.warehouse {
                // The name has been checked, and the robot has asked nothing yet.
                let _ = robot.set_warehouse(warehouse);
            }
            robot.fetch(product)?;
            self.robots.insert(name.clone(), robot);
            self.knows(name);
            return Ok(());
        }
        self.wish(name, Wish::Fetch(product))
    }

    /// Does what a person wants of a robot.
    ///
    /// # Errors
    ///
    /// The station cannot do it. Nothing has changed then.
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
            Peer::Robot(link) => self.has_connected(link),
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
                if let Some(Link {
                    name: Some(name), ..
                }) = self.links.remove(&link)
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

    /// The same for a line that may have waited for so long before the station read it. A robot's
    /// news count, however late they come.
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
        let Some(named) = self.hears(link) else {
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
                Err(why) => return self.refuse(Peer::Robot(link), &why),
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
}

/// What the station says.
impl Station {
    /// Says a line to a robot, by its connection.
    fn say(&mut self, name: &Name, line: Option<StationLine>) {
        let (Some(line), Some(link)) = (line, self.link_of(name)) else {
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
                    gag.is_told = true;
                }
                self.outputs.push(Output::Say { to, line });
            }
            // Longer texts have been refused before; a peer's text fits a line.
            Err(error) => self.close(to, error.to_string()),
        }
    }

    fn close(&mut self, peer: Peer, why: String) {
        self.outputs.push(Output::Close { peer, why });
        self.disconnected(peer);
    }
}
