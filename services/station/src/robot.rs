//! The conversation with one robot as the external computer sees it. The external computer answers
//! by itself, or passes on what a GaG answers while one speaks for this robot.
//!
//! ```text
//!  the robot asks            it is answered
//!  sidelength, karta,        from the warehouse, at once or when there is one (AMB-42)
//!  prodlis
//!  fetchprod                 with the first product of the queue, or when one is put in (AMB-43)
//!  styrcomm, armcomm         with the first command that waits, or when one is given (C5)
//!  armcomm                   with pickup_done, once a person has said so and no command waits
//! ```
//!
//! - One question is held. A new question takes its place, and the old one is never answered.
//! - Commands are taken while the robot asks for them, by hand or at a pick station, and at most
//!   [`Robot::MOST_COMMANDS`] wait. A stop takes the place of all that wait, and of a pickup_done
//!   behind them, after which the robot would drive off. A robot that speaks the extension is told
//!   it at once, though it asks nothing while it turns. When the robot asks for something else, its
//!   connection ends or somebody takes its wheel, they are dropped: nobody's old command moves it
//!   later.
//! - A product leaves the queue when the robot is told it. If the connection ends before the robot
//!   has said another word, it is put back, since it may not have arrived.
//! - The queue outlives connections.
//! - While a GaG speaks for the robot only commands are answered from here: those that it gave
//!   before it was asked, and those that were given besides, a stop above all. The robot stands
//!   when a GaG that drives it leaves, or somebody takes the wheel from it.
//!
//! - A robot that speaks the extension is given numbered actions besides, and answers each. What it
//!   shows of itself is kept with the time when it came ([`Shown`]). Who drives it by actions holds
//!   its seat (`wheel.rs`); anybody may stop it.

use std::collections::VecDeque;
use std::time::Duration;

use lager_lines::conversation::{AnswerRefused, Held, RobotLine, StationLine};
use lager_lines::extension::{Hello, Order};
use lager_lines::gag::{Answer, Query, Request, Telemetry};
use lager_lines::{Coord, Direction, Map, Name, ProductId, Products, SideLength, Text, TooLate};
use lager_wire::OperatorCommand;
use thiserror::Error;

use crate::asked::Asked;
use crate::shown::{Shown, Told};
use crate::warehouse::{Warehouse, WarehouseError};
use crate::wheel::Wheel;

mod actions;
mod known;

pub(crate) use known::Other;

/// What a robot is doing, as far as its questions tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Doing {
    /// It is not connected.
    #[default]
    Away,
    /// It is connected and asks about the warehouse.
    Starting,
    /// It waits to be told what to fetch.
    Idle,
    /// It fetches a product by itself.
    Fetching,
    /// It stands at the goods and asks for steps of the arm (C7).
    Picking,
    /// It is driven by hand (C4).
    ByHand,
}

impl Doing {
    /// Whether it takes commands.
    pub const fn takes_commands(self) -> bool {
        matches!(self, Self::Picking | Self::ByHand)
    }
}

/// Why a command is not given to a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CommandRefused {
    /// It does not ask for any.
    #[error(
        "the robot takes no commands now; it does when it is switched to manual or stands at goods"
    )]
    NotAsked,
    /// It is slower than the person who gives them.
    #[error(
        "{} commands wait already; wait until the robot has taken some, or stop it",
        Robot::MOST_COMMANDS
    )]
    Full,
    /// There are no goods to be picked up.
    #[error("the robot does not stand at goods, so nothing was picked up")]
    NotPicking,
}

/// Why an action is not given to a robot.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ActRefused {
    /// It does not understand any.
    #[error("the robot speaks only the document's language, or is away; it takes no actions")]
    Plain,
    /// It does not answer.
    #[error(
        "{} actions are unanswered already; wait for the robot, or stop it",
        Asked::MOST
    )]
    Full,
    /// Somebody else drives.
    #[error("{by} drives the robot; wait until he has left, or stop it")]
    Driven {
        /// Who.
        by: String,
    },
    /// Only who drives it may.
    #[error("the robot is moved by its driver alone; take the wheel first")]
    NotDriver,
    /// It was given too long ago.
    #[error(transparent)]
    Late(#[from] TooLate),
}

/// Why a product is not put in a robot's queue.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FetchRefused {
    /// There is no such product.
    #[error("there is no product {product} in the warehouse")]
    Unknown {
        /// Its number.
        product: ProductId,
    },
    /// It waits already, or is under way. There is one piece of goods for each number.
    #[error("product {product} is ordered already")]
    Ordered {
        /// Its number.
        product: ProductId,
    },
    /// Its goods were delivered, or were not found.
    #[error(
        "product {product} is not in its place, as robot {robot} has seen; put it back and say \
         `lager map back {product}`"
    )]
    Gone {
        /// Its number.
        product: ProductId,
        /// Who has seen it.
        robot: Name,
    },
    /// Too many wait.
    #[error(
        "{} products wait already; wait until some are delivered",
        Robot::MOST_PRODUCTS
    )]
    Full,
}

/// What a robot was told of the warehouse.
#[derive(Clone, Debug, Default)]
struct Known {
    side: Option<SideLength>,
    map: Option<Map>,
    products: Option<Products>,
}

impl Known {
    fn take(&mut self, answer: &Answer) {
        match answer {
            Answer::SideLength(side) => self.side = Some(*side),
            Answer::Map(map) => self.map = Some(*map),
            Answer::Products(_, products) => self.products = Some(products.clone()),
            _ => {}
        }
    }
}

/// One robot.
#[derive(Clone, Debug, Default)]
pub struct Robot {
    doing: Doing,
    held: Held,
    /// As it has announced itself, if it speaks the extension.
    hello: Option<Hello>,
    warehouse: Option<(SideLength, Map, Products)>,
    /// What of it, and of those before it, the robot was told last.
    known: Known,
    queue: VecDeque<ProductId>,
    /// The product that it was told last.
    told: Option<ProductId>,
    /// Whether it has not been heard since it was told.
    is_unanswered: bool,
    commands: VecDeque<OperatorCommand>,
    is_picked: bool,
    /// The last command to its wheels was another than to stand.
    turns_wheels: bool,
    has_gag: bool,
    node: Option<Coord>,
    looks: Option<Direction>,
    thought: Option<Text>,
    now: Duration,
    shown: Shown,
    asked: Asked,
    wheel: Wheel,
    /// What it has said and nobody has taken yet.
    told_news: Vec<Told>,
}

/// What a person wants of it. What is returned is said to the robot, in this order.
impl Robot {
    /// Commands that may wait, at most (C5).
    pub const MOST_COMMANDS: usize = 32;
    /// Products that may wait, at most.
    pub const MOST_PRODUCTS: usize = 256;

    /// The warehouse is known, or is another one.
    ///
    /// # Errors
    ///
    /// When there can be no such warehouse; the one before is kept.
    pub fn set_warehouse(
        &mut self,
        warehouse: &Warehouse,
    ) -> Result<Option<StationLine>, WarehouseError> {
        self.warehouse = Some(warehouse.check()?);
        Ok(self.answer())
    }

    /// Gives a command. A stop takes the place of all that wait, and of a pickup_done.
    ///
    /// # Errors
    ///
    /// When the robot does not ask for commands or too many wait.
    pub fn command(
        &mut self,
        command: OperatorCommand,
    ) -> Result<Option<StationLine>, CommandRefused> {
        if !self.doing.takes_commands() {
            return Err(CommandRefused::NotAsked);
        }
        if command == OperatorCommand::Stop {
            self.drop_commands();
            if self.hello.is_some() && self.held.get().is_none() {
                self.told_command(command);
                return Ok(Some(StationLine::Answer(Answer::Command(command))));
            }
        }
        if self.commands.len() == Self::MOST_COMMANDS {
            return Err(CommandRefused::Full);
        }
        self.commands.push_back(command);
        Ok(self.answer())
    }

    /// Stops the robot: in the extension's lane of its own if it speaks that, else by a command.
    /// The number is that of the confirmation, which only the extension has.
    ///
    /// # Errors
    ///
    /// When it speaks only the document's language and does not ask for commands.
    pub fn stop(&mut self) -> Result<(Option<u32>, Option<StationLine>), CommandRefused> {
        if self.hello.is_none() {
            return Ok((None, self.command(OperatorCommand::Stop)?));
        }
        self.drop_commands();
        let (number, dropped) = self.asked.open_always(self.now);
        self.lose(dropped);
        let number = Some(number);
        Ok((number, Some(StationLine::Order(Order::Stop { number }))))
    }

    /// The goods are in the gripper (Q5). Commands that wait are given first.
    ///
    /// # Errors
    ///
    /// When the robot does not stand at goods.
    pub fn picked_up(&mut self) -> Result<Option<StationLine>, CommandRefused> {
        if self.doing != Doing::Picking {
            return Err(CommandRefused::NotPicking);
        }
        self.is_picked = true;
        Ok(self.answer())
    }

    /// Has a product fetched after those that wait (F3).
    ///
    /// # Errors
    ///
    /// When the warehouse does not have it or too many wait.
    pub fn fetch(&mut self, product: ProductId) -> Result<Option<StationLine>, FetchRefused> {
        let products = self.warehouse.iter().flat_map(|(_, _, all)| all.as_slice());
        if !products.into_iter().any(|one| one.id == product) {
            return Err(FetchRefused::Unknown { product });
        }
        if self.is_ordered(product) {
            return Err(FetchRefused::Ordered { product });
        }
        let gone = self.shown.gone.as_ref().map(|gone| gone.value.first());
        if let Some(hello) = &self.hello
            && gone.is_some_and(|gone| gone.contains(&product))
        {
            let robot = hello.name.clone();
            return Err(FetchRefused::Gone { product, robot });
        }
        if self.queue.len() == Self::MOST_PRODUCTS {
            return Err(FetchRefused::Full);
        }
        self.queue.push_back(product);
        Ok(self.answer())
    }

    /// Whether this product waits here, or the robot that is connected is told to fetch it.
    fn is_ordered(&self, product: ProductId) -> bool {
        if self.queue.contains(&product) {
            return true;
        }
        if self.doing == Doing::Away {
            return false;
        }
        let is_told = matches!(self.doing, Doing::Fetching | Doing::Picking)
            && self.told == Some(product)
            && self.hello.is_none();
        let state = self.shown.state.as_ref();
        let queue = self.shown.queue.as_ref();
        let mut waiting = queue.iter().flat_map(|queue| queue.value.first());
        let shows = state.is_some_and(|state| state.value.product == Some(product))
            || waiting.any(|waits| waits.product == product);
        is_told || shows && self.hello.is_some()
    }

    /// Takes the first of the products that wait with this number out of the queue; tells whether
    /// there was one.
    pub fn cancel(&mut self, product: ProductId) -> bool {
        let place = self.queue.iter().position(|waits| *waits == product);
        place.and_then(|place| self.queue.remove(place)).is_some()
    }
}

/// What a GaG says for it.
impl Robot {
    /// Whether a GaG speaks for it from now on. One that leaves drives it no further.
    pub fn set_gag(&mut self, has_gag: bool) -> Option<StationLine> {
        let has_left = core::mem::replace(&mut self.has_gag, has_gag) && !has_gag;
        let stands = has_left.then(|| self.end_commands()).flatten();
        stands.or_else(|| self.answer())
    }

    /// Passes on what the GaG answers.
    ///
    /// # Errors
    ///
    /// When the robot asks nothing, or something else. It is not told.
    pub fn given(&mut self, answer: Answer) -> Result<StationLine, AnswerRefused> {
        let query = self.held.answer(&answer)?;
        self.known.take(&answer);
        match answer {
            Answer::Fetch(product) => {
                self.begin(product);
                // If it does not arrive, the robot asks again and the GaG with it.
                self.is_unanswered = false;
            }
            Answer::PickupDone => self.doing = Doing::Fetching,
            Answer::Command(command) => {
                self.told_command(command);
                if command == OperatorCommand::Stop {
                    self.drop_commands();
                }
            }
            _ => {}
        }
        Ok(StationLine::Answer(answer.spelled_as(query)))
    }
}

/// What the robot does.
impl Robot {
    /// It has connected.
    pub fn connected(&mut self) {
        self.disconnected();
        self.doing = Doing::Starting;
    }

    /// Its connection has ended.
    pub fn disconnected(&mut self) {
        if let Some(product) = self.told.take_if(|_| self.is_unanswered) {
            self.queue.push_front(product);
        }
        self.doing = Doing::Away;
        self.held.clear();
        self.hello = None;
        self.is_unanswered = false;
        self.drop_commands();
        self.turns_wheels = false;
        let lost = self.asked.lost(self.now, true);
        self.lose(lost);
    }

    /// It has said something. What is returned is said to it.
    pub fn heard(&mut self, line: RobotLine) -> Option<StationLine> {
        // An announcement is repeated as a sign of life, and may have been under way before.
        if !matches!(line, RobotLine::Hello(_)) {
            self.is_unanswered = false;
        }
        match line {
            RobotLine::Request(Request::Query(query)) => return self.asked(query),
            RobotLine::Request(Request::Telemetry(telemetry)) => match telemetry {
                Telemetry::Thought(thought) => {
                    self.thought = Some(thought.clone());
                    self.told_news.push(Told::Thought(thought));
                }
                Telemetry::Robot(node) => self.node = Some(node),
                Telemetry::Heading(looks) => self.looks = Some(looks),
            },
            RobotLine::Hello(hello) => self.hello = Some(hello),
            RobotLine::Report(report) => {
                let told = self.shown.take(report, self.now);
                self.told_news.extend(told.filter(|told| match told {
                    // What nobody waits for is no news.
                    Told::Replied { number, .. } => self.asked.close(*number),
                    Told::Event(_)
                    | Told::Thinks(_)
                    | Told::Thought(_)
                    | Told::Past { .. }
                    | Told::Asked { .. } => true,
                }));
            }
        }
        None
    }

    fn asked(&mut self, query: Query) -> Option<StationLine> {
        let before = self.doing;
        self.doing = match query {
            Query::SideLength | Query::Map | Query::Products(_) => Doing::Starting,
            Query::Fetch => Doing::Idle,
            Query::Arm => Doing::Picking,
            Query::Wheels => Doing::ByHand,
        };
        if self.doing != Doing::Picking {
            self.is_picked = false;
        }
        if self.doing != Doing::Starting
            && let Some((side, map, products)) = &self.warehouse
        {
            // What it does not ask for it has been told by a station before this one.
            self.known.side.get_or_insert(*side);
            self.known.map.get_or_insert(*map);
            let known = &mut self.known.products;
            known.get_or_insert_with(|| products.clone());
        }
        // One of this project asks for either kind of command in a mode of its own.
        let has_turned = self.hello.is_some() && self.doing != before;
        if has_turned || !self.doing.takes_commands() {
            self.drop_commands();
            self.turns_wheels = false;
        }
        self.held.ask(query);
        self.answer()
    }

    /// It is told to fetch `product`.
    fn begin(&mut self, product: ProductId) {
        self.told = Some(product);
        self.is_unanswered = true;
        self.doing = Doing::Fetching;
    }

    /// Whether it turns its wheels by a command of the document, or more commands wait.
    pub(crate) fn is_commanded(&self) -> bool {
        self.turns_wheels || !self.commands.is_empty() || self.is_picked
    }

    /// Whatever waits to be told it was given before the station was held up; whether there was
    /// anything.
    pub(crate) fn forget_commands(&mut self) -> bool {
        let waited = !self.commands.is_empty() || self.is_picked;
        self.drop_commands();
        waited
    }

    /// Whoever gave commands gives no more: none of them waits any longer, and the robot stands
    /// where one of them turns its wheels.
    pub(crate) fn end_commands(&mut self) -> Option<StationLine> {
        self.drop_commands();
        let turns = core::mem::take(&mut self.turns_wheels);
        // It asks for commands, or none was given.
        turns.then(|| self.command(OperatorCommand::Stop).ok())??
    }

    fn drop_commands(&mut self) {
        self.commands.clear();
        self.is_picked = false;
    }

    /// It is told this command.
    fn told_command(&mut self, command: OperatorCommand) {
        self.turns_wheels = match command {
            OperatorCommand::Stop => false,
            OperatorCommand::Arm(_) => self.turns_wheels,
            _ => true,
        };
    }

    /// The answer to the question that is held, if it can be given now.
    fn answer(&mut self) -> Option<StationLine> {
        let query = self.held.get()?;
        if self.has_gag && !matches!(query, Query::Arm | Query::Wheels) {
            return None;
        }
        let warehouse = self.warehouse.as_ref();
        let answer = match query {
            Query::SideLength => Answer::SideLength(warehouse?.0),
            Query::Map => Answer::Map(warehouse?.1),
            Query::Products(word) => Answer::Products(word, warehouse?.2.clone()),
            Query::Fetch => {
                let product = self.queue.pop_front()?;
                self.begin(product);
                Answer::Fetch(product)
            }
            Query::Arm | Query::Wheels => match self.commands.pop_front() {
                Some(command) => {
                    self.told_command(command);
                    Answer::Command(command)
                }
                None if query == Query::Arm && self.is_picked => {
                    self.is_picked = false;
                    self.doing = Doing::Fetching;
                    Answer::PickupDone
                }
                None => return None,
            },
        };
        self.held.clear();
        self.known.take(&answer);
        Some(StationLine::Answer(answer))
    }
}
