//! The external computer as a whole: robots by their names, and a GaG that speaks for one of them.
//!
//! ```text
//!   a connection's first line         its robot is called
//!   lager 1 <name>                    by that name; it is answered `lager 1 <station>`
//!   anything else of a robot          robot-1, robot-2 ..., the first that is free
//! ```
//!
//! - A name has one connection, the newest: the one before is closed, because a robot that comes
//!   back may have left a connection whose end this station has not noticed.
//! - A line that breaks the grammar closes its connection; no part of it counts.
//! - A GaG's language has no names of robots, so it speaks for one: the one that has been connected
//!   for longest. The others are answered from the warehouse and their queues.
//! - A GaG's answers are checked as a file is. The station refuses an impossible answer in a
//!   `thought` and asks again. It takes over what a GaG says of the warehouse.
//!
//! It is pure: lines and wishes in, [`Output`]s out, in the order in which they came about.

use std::collections::BTreeMap;

use lager_lines::conversation::{Held, RobotLine, StationLine};
use lager_lines::extension::Hello;
use lager_lines::gag::{Answer, Query, Request, Telemetry};
use lager_lines::splitter::LineError;
use lager_lines::{Map, Name, ProductId, Products, SideLength, Text, to_line};
use lager_wire::OperatorCommand;
use thiserror::Error;

use crate::queues::Queues;
use crate::robot::{CommandRefused, FetchRefused, Robot};
use crate::warehouse::{StoredProduct, Warehouse, WarehouseError};

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
    /// Stop it.
    Stop,
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
}

/// The GaG that is connected.
#[derive(Clone, Debug, Default)]
struct Gag {
    /// What it has been asked and has not answered.
    held: Held,
    /// The robot it speaks for.
    robot: Option<Name>,
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

    /// It could not be saved; who described it is told.
    pub fn not_saved(&mut self, why: &str) {
        if self.gag.is_some() {
            self.put(Peer::Gag, &thought(why));
        }
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
            Wish::Command(command) => robot.command(command)?,
            Wish::Stop => robot.stop()?,
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
        let line = match line {
            Ok(line) => line,
            Err(error) => return self.close(peer, error.to_string()),
        };
        match peer {
            Peer::Robot(link) => self.robot_said(link, line),
            Peer::Gag => self.gag_said(line),
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
        let is_hello = matches!(said, RobotLine::Hello(_));
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
        if is_hello {
            let hello = Hello {
                version: Hello::VERSION,
                name: self.name.clone(),
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

    fn gag_said(&mut self, line: &str) {
        if self.gag.is_none() {
            return;
        }
        let answer = match Answer::read(line) {
            Ok(answer) => answer,
            Err(error) => return self.correct_gag(&error.to_string()),
        };
        let Some(gag) = &mut self.gag else { return };
        if let Err(error) = gag.held.answer(&answer) {
            return self.correct_gag(&error.to_string());
        }
        let name = gag.robot.clone();
        if let Err(error) = self.learn(&answer) {
            return self.correct_gag(&error.to_string());
        }
        if let Some(name) = name
            && let Some(robot) = self.robots.get_mut(&name)
        {
            // An answer to a question that the robot no longer asks is ignored.
            let line = robot.given(answer).ok();
            self.say(&name, line);
            self.ask_gag(&name);
        }
    }

    /// Tells the GaG what is wrong, and asks again what is still asked.
    fn correct_gag(&mut self, why: &str) {
        self.put(Peer::Gag, &thought(why));
        if let Some(gag) = &mut self.gag {
            gag.held.clear();
            if let Some(name) = gag.robot.clone() {
                self.ask_gag(&name);
            }
        }
    }

    /// Takes up what the GaG says of the warehouse, once all of it is known.
    fn learn(&mut self, answer: &Answer) -> Result<(), WarehouseError> {
        let Some(gag) = &mut self.gag else {
            return Ok(());
        };
        match answer {
            Answer::SideLength(side) => gag.side = Some(*side),
            Answer::Map(map) => gag.map = Some(*map),
            Answer::Products(_, products) => gag.products = Some(products.clone()),
            _ => return Ok(()),
        }
        let (Some(side), Some(map), Some(products)) = (gag.side, gag.map, &gag.products) else {
            return Ok(());
        };
        let told = described(self.warehouse.as_ref(), side, map, products);
        let checked = told.check();
        if checked.is_err() {
            gag.products = None;
        }
        checked?;
        if self.warehouse.as_ref() != Some(&told) {
            self.set_warehouse(told)?;
        }
        Ok(())
    }
}

/// Who the GaG speaks for.
impl Station {
    /// Lets the GaG speak for the robot that has been connected for longest.
    fn seat_gag(&mut self) {
        let first = self.links.values().flatten().next().cloned();
        let Some(gag) = &mut self.gag else { return };
        if gag.robot == first {
            return;
        }
        let before = core::mem::replace(&mut gag.robot, first.clone());
        before.into_iter().for_each(|name| self.unseat(&name));
        let Some(name) = first else { return };
        let Some(robot) = self.robots.get_mut(&name) else {
            return;
        };
        let line = robot.set_gag(true);
        let node = robot.node().map(Telemetry::Robot);
        let looks = robot.looks().map(Telemetry::Heading);
        for telemetry in node.into_iter().chain(looks) {
            self.put(Peer::Gag, &Request::Telemetry(telemetry));
        }
        self.say(&name, line);
        self.ask_gag(&name);
    }

    /// The GaG speaks for this robot no more.
    fn unseat(&mut self, name: &Name) {
        if let Some(robot) = self.robots.get_mut(name) {
            let line = robot.set_gag(false);
            self.say(name, line);
        }
    }

    /// Asks the GaG what its robot asks, if it has not been asked that already.
    fn ask_gag(&mut self, name: &Name) {
        let Some(gag) = &mut self.gag else { return };
        if gag.robot.as_ref() != Some(name) {
            return;
        }
        let asked: Option<Query> = self.robots.get(name).and_then(Robot::held);
        if let Some(query) = asked
            && gag.held.get() != Some(query)
        {
            gag.held.ask(query);
            self.put(Peer::Gag, &Request::Query(query));
        }
    }
}

/// What is said.
impl Station {
    /// Says a line to a robot, on the connection it has.
    fn say(&mut self, name: &Name, line: Option<StationLine>) {
        let mut links = self.links.iter();
        let link = links.find(|(_, named)| named.as_ref() == Some(name));
        if let (Some(line), Some((&link, _))) = (line, link) {
            self.put(Peer::Robot(link), &line);
        }
    }

    fn put(&mut self, to: Peer, line: &impl core::fmt::Display) {
        match to_line(line) {
            Ok(line) => self.outputs.push(Output::Say { to, line }),
            // Everything that is too long has been refused before; a text of a peer is a line's.
            Err(error) => self.close(to, error.to_string()),
        }
    }

    fn close(&mut self, peer: Peer, why: String) {
        self.outputs.push(Output::Close { peer, why });
        self.disconnected(peer);
    }
}

/// A sentence for a GaG.
fn thought(why: &str) -> Request {
    let text = Text::new(why.replace(['\r', '\n'], " "));
    Request::Telemetry(Telemetry::Thought(text.unwrap_or_default()))
}

/// The warehouse before with what a GaG says of it. Products keep the names they had.
fn described(
    before: Option<&Warehouse>,
    side: SideLength,
    map: Map,
    products: &Products,
) -> Warehouse {
    let known = |id: i32| {
        let mut known = before.iter().flat_map(|before| &before.products);
        known.find(|product| product.id == id)
    };
    let product = |product: &lager_lines::Product| StoredProduct {
        id: product.id.get(),
        name: known(product.id.get()).and_then(|known| known.name.clone()),
        square: [product.square.x, product.square.y],
        side: product.side.to_string(),
    };
    Warehouse {
        size: [map.size().x, map.size().y],
        side_length_cm: side.cm(),
        delivery: [map.delivery().x, map.delivery().y],
        products: products.as_slice().iter().map(product).collect(),
        rest: before.map_or_else(toml::Table::new, |before| before.rest.clone()),
    }
}
