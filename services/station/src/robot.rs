//! The station's side of the conversation with one robot. The station answers from what it knows,
//! or passes on the answers of a GaG that speaks for this robot.
//!
//! ```text
//!  the robot asks            the station answers
//!  sidelength, karta,        from the warehouse, at once or when there is one (AMB-42)
//!  prodlis
//!  fetchprod                 with the first product of the queue, or when one is put in (AMB-43)
//!  styrcomm, armcomm         with the first command that waits, or when one is given (C5)
//!  armcomm                   with pickup_done, once a person has said so and no command waits
//! ```
//!
//! - The station remembers one open question. A new question replaces it, and the old one is never
//!   answered.
//! - The station takes commands only while the robot asks for them: when a person drives it, or
//!   when it stands at goods. At most [`Robot::MOST_COMMANDS`] wait.
//! - A stop replaces all commands that wait, and also a `pickup_done` behind them, because the
//!   robot would drive off after it. If the robot speaks the extension, the station sends it the
//!   stop at once, even while the robot turns and asks nothing. A stop that the robot has not
//!   confirmed when its connection ends is given to its next connection, within [`KEPT`].
//! - The station drops the commands that wait when the robot asks for something else, when its
//!   connection ends, and when somebody takes its wheel. So no old command moves the robot later.
//! - A product leaves the queue when the station tells it to the robot. If the connection ends
//!   before the robot has said another word, the product may not have arrived, so the station puts
//!   it back.
//! - The queue outlives connections.
//! - While a GaG speaks for the robot, the station itself sends only commands: those that the GaG
//!   gave before the robot asked, and those of other people, most of all a stop. The robot stands
//!   when a GaG that drives it leaves, or when somebody takes the wheel from the GaG.
//!
//! - A robot that speaks the extension also takes numbered actions, and answers each. The station
//!   keeps its last state with the time when it arrived ([`Shown`]). A person who drives it by
//!   actions holds its wheel (`wheel.rs`). Anybody may stop it.

use std::collections::VecDeque;
use std::time::Duration;

use lager_floor::{Grid, Heading, Node, ProductId, SideLength};
use lager_lines::conversation::{AnswerRefused, Held, RobotLine, StationLine};
use lager_lines::extension::{Hello, Order};
use lager_lines::gag::{Answer, Query, Request, Telemetry};
use lager_lines::{Name, Products, Text};
use lager_orders::{Code, Reason, lease::TooLate};
use lager_plant::Warehouse;
use lager_wire::OperatorCommand;
use thiserror::Error;

use crate::asked::Asked;
use crate::shown::{Saying, Shown};
use crate::warehouse;
use crate::wheel::Wheel;

mod actions;
mod known;

/// How long after a stop that the robot has not confirmed its next connection is given it.
const KEPT: Duration = Duration::from_secs(5);

pub(crate) use known::Other;

/// What a robot is doing, as its questions show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Doing {
    /// It is not connected.
    #[default]
    Away,
    /// It is connected and asks about the warehouse.
    Starting,
    /// It waits for an order.
    Idle,
    /// It fetches a product by itself.
    Fetching,
    /// It stands at the goods and asks for steps of the arm (C7).
    Picking,
    /// A person drives it by hand (C4).
    ByHand,
}

impl Doing {
    /// Whether the robot takes commands now.
    pub const fn takes_commands(self) -> bool {
        matches!(self, Self::Picking | Self::ByHand)
    }
}

/// Why the station does not give a robot a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{}", Reason::from(*self))]
pub enum CommandRefused {
    /// The robot does not ask for commands.
    NotAsked,
    /// Too many commands wait already.
    Full,
    /// The robot is not at goods.
    NotPicking,
}

impl From<CommandRefused> for Reason {
    fn from(why: CommandRefused) -> Self {
        match why {
            CommandRefused::NotAsked => Code::NotAsked.into(),
            CommandRefused::Full => Self::new(Code::CommandsFull, &[&Robot::MOST_COMMANDS]),
            CommandRefused::NotPicking => Code::NothingPicked.into(),
        }
    }
}

/// Why the station does not give a robot an action.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", Reason::from(self))]
pub enum ActRefused {
    /// The robot understands no actions.
    Plain,
    /// The robot does not answer.
    Full,
    /// Somebody else drives.
    Driven {
        /// Who.
        by: String,
    },
    /// Only its driver may give it.
    NotDriver,
    /// A person gave it too long ago.
    Late(#[from] TooLate),
}

impl From<&ActRefused> for Reason {
    fn from(why: &ActRefused) -> Self {
        match why {
            ActRefused::Plain => Code::Plain.into(),
            ActRefused::Full => Self::new(Code::ActsFull, &[&Asked::MOST]),
            ActRefused::Driven { by } => Self::new(Code::Driven, &[by]),
            ActRefused::NotDriver => Code::DriverOnly.into(),
            ActRefused::Late(late) => (*late).into(),
        }
    }
}

/// Why the station does not put a product in a robot's queue.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", Reason::from(self))]
pub enum FetchRefused {
    /// There is no such product.
    Unknown {
        /// Its number.
        product: ProductId,
    },
    /// The product waits already, or the robot is fetching it. There is one piece of each product.
    Ordered {
        /// Its number.
        product: ProductId,
    },
    /// The product was delivered, or a robot did not find it.
    Gone {
        /// Its number.
        product: ProductId,
        /// The robot that has seen it.
        robot: Name,
    },
    /// Too many products wait.
    Full,
}

impl From<&FetchRefused> for Reason {
    fn from(why: &FetchRefused) -> Self {
        match why {
            FetchRefused::Unknown { product } => Self::new(Code::NoProduct, &[product]),
            FetchRefused::Ordered { product } => Self::new(Code::Ordered, &[product]),
            FetchRefused::Gone { product, robot } => Self::new(Code::Gone, &[product, robot]),
            FetchRefused::Full => Self::new(Code::ProductsFull, &[&Robot::MOST_PRODUCTS]),
        }
    }
}

/// What the station has told a robot of the warehouse.
#[derive(Clone, Debug, Default)]
struct Known {
    side: Option<SideLength>,
    map: Option<Grid>,
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
    /// Its announcement, if it speaks the extension.
    hello: Option<Hello>,
    warehouse: Option<(SideLength, Grid, Products)>,
    /// What the station last told this robot, or one of this name before it, of the warehouse.
    known: Known,
    queue: VecDeque<ProductId>,
    /// The last product that the station told it.
    told: Option<ProductId>,
    /// Whether the robot has said nothing since then.
    is_unanswered: bool,
    commands: VecDeque<OperatorCommand>,
    is_picked: bool,
    /// The last command to its wheels was not the command to stand.
    turns_wheels: bool,
    has_gag: bool,
    node: Option<Node>,
    looks: Option<Heading>,
    thought: Option<Text>,
    now: Duration,
    shown: Shown,
    asked: Asked,
    /// The number of the last stop, and when a person gave it, until the robot has confirmed it.
    unconfirmed: Option<(u32, Duration)>,
    wheel: Wheel,
    /// What the robot has said, until somebody takes it.
    told_news: Vec<Saying>,
}

/// What a person wants of the robot. Each method returns lines for the robot, in this order.
impl Robot {
    /// How many commands may wait (C5).
    pub const MOST_COMMANDS: usize = 32;
    /// How many products may wait.
    pub const MOST_PRODUCTS: usize = 256;

    /// Tells the robot of a warehouse, a first one or a new one.
    ///
    /// # Errors
    ///
    /// Such a warehouse cannot exist. The robot keeps the one before.
    pub fn set_warehouse(&mut self, warehouse: &Warehouse) -> Result<Option<StationLine>, Reason> {
        self.warehouse = Some(warehouse::told(warehouse)?);
        Ok(self.answer())
    }

    /// Gives a command. A stop replaces all commands that wait, and a pickup_done.
    ///
    /// # Errors
    ///
    /// The robot does not ask for commands, or too many wait.
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

    /// Stops the robot: at once if it speaks the extension, else by a command. Only the extension
    /// confirms a stop; the number is that of the confirmation.
    ///
    /// # Errors
    ///
    /// The robot speaks only the document's language and does not ask for commands.
    pub fn stop(&mut self) -> Result<(Option<u32>, Option<StationLine>), CommandRefused> {
        if self.hello.is_none() {
            return Ok((None, self.command(OperatorCommand::Stop)?));
        }
        self.drop_commands();
        let (number, dropped) = self.asked.open_always(self.now);
        self.lose(dropped);
        self.unconfirmed = Some((number, self.now));
        let number = Some(number);
        Ok((number, Some(StationLine::Order(Order::Stop { number }))))
    }

    /// A person says that the goods are in the gripper (Q5). Commands that wait go first.
    ///
    /// # Errors
    ///
    /// The robot does not stand at goods.
    pub fn picked_up(&mut self) -> Result<Option<StationLine>, CommandRefused> {
        if self.doing != Doing::Picking {
            return Err(CommandRefused::NotPicking);
        }
        self.is_picked = true;
        Ok(self.answer())
    }

    /// Puts a product at the end of the queue (F3).
    ///
    /// # Errors
    ///
    /// The warehouse has no such product, or too many wait.
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

    /// Whether this product waits here, or the connected robot is fetching it.
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

    /// Takes the first product with this number out of the queue. Returns whether there was one.
    pub fn cancel(&mut self, product: ProductId) -> bool {
        let place = self.queue.iter().position(|waits| *waits == product);
        place.and_then(|place| self.queue.remove(place)).is_some()
    }
}

/// What a GaG says for the robot.
impl Robot {
    /// Sets whether a GaG speaks for the robot. When a GaG leaves, its last command ends.
    pub fn set_gag(&mut self, has_gag: bool) -> Option<StationLine> {
        let has_left = core::mem::replace(&mut self.has_gag, has_gag) && !has_gag;
        let stands = has_left.then(|| self.end_commands()).flatten();
        stands.or_else(|| self.answer())
    }

    /// Passes on what the GaG answers.
    ///
    /// # Errors
    ///
    /// The robot asks nothing, or something else. It does not get the answer.
    pub fn given(&mut self, answer: Answer) -> Result<StationLine, AnswerRefused> {
        let query = self.held.answer(&answer)?;
        self.known.take(&answer);
        match answer {
            Answer::Fetch(product) => {
                self.begin(product);
                // If the answer does not arrive, the robot asks again, and the station asks the GaG
                // again.
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

/// What the robot itself does.
impl Robot {
    /// The robot has connected.
    pub fn connected(&mut self) {
        self.disconnected();
        self.doing = Doing::Starting;
    }

    /// The robot's connection has ended.
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

    /// The robot has sent a line. Returns the lines for the robot.
    pub fn heard(&mut self, line: RobotLine) -> Option<StationLine> {
        // The robot repeats its announcement as a sign of life; it may be an old one.
        if !matches!(line, RobotLine::Hello(_)) {
            self.is_unanswered = false;
        }
        match line {
            RobotLine::Request(Request::Query(query)) => return self.asked(query),
            RobotLine::Request(Request::Telemetry(telemetry)) => match telemetry {
                Telemetry::Thought(thought) => {
                    self.thought = Some(thought.clone());
                    self.told_news.push(Saying::Thought(thought));
                }
                Telemetry::Robot(node) => self.node = Some(node),
                Telemetry::Heading(looks) => self.looks = Some(looks),
            },
            RobotLine::Hello(hello) => {
                if self.hello.replace(hello).is_none() {
                    return self.stop_again();
                }
            }
            RobotLine::Report(report) => {
                let told = self.shown.take(report, self.now);
                self.told_news.extend(told.filter(|told| match told {
                    // An answer that nobody waits for is no news.
                    Saying::Replied { number, .. } => {
                        self.unconfirmed.take_if(|(stop, _)| stop == number);
                        self.asked.close(*number)
                    }
                    Saying::Event(_)
                    | Saying::Thinks(_)
                    | Saying::Because(_)
                    | Saying::Thought(_)
                    | Saying::Past { .. }
                    | Saying::Asked { .. } => true,
                }));
            }
        }
        None
    }

    /// The connection on which the last stop was given may have been dead already.
    fn stop_again(&mut self) -> Option<StationLine> {
        let (_, given) = self.unconfirmed.take()?;
        let is_meant = self.now.saturating_sub(given) <= KEPT;
        is_meant.then(|| self.stop().ok()?.1).flatten()
    }

    /// Whether people get this as news.
    pub(crate) fn is_told(&mut self, why: &str) {
        let text = Text::new(why.replace(['\r', '\n'], " "));
        self.told_news
            .push(Saying::Thought(text.unwrap_or_default()));
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
            // A station before this one has told the robot what it does not ask for.
            self.known.side.get_or_insert(*side);
            self.known.map.get_or_insert(*map);
            let known = &mut self.known.products;
            known.get_or_insert_with(|| products.clone());
        }
        // A robot of this project asks for each kind of command in another mode.
        let has_turned = self.hello.is_some() && self.doing != before;
        if has_turned || !self.doing.takes_commands() {
            self.drop_commands();
            self.turns_wheels = false;
        }
        self.held.ask(query);
        self.answer()
    }

    /// Tells the robot to fetch `product`.
    fn begin(&mut self, product: ProductId) {
        self.told = Some(product);
        self.is_unanswered = true;
        self.doing = Doing::Fetching;
    }

    /// Whether a command of the document turns its wheels, or more commands wait.
    pub(crate) fn is_commanded(&self) -> bool {
        self.turns_wheels || !self.commands.is_empty() || self.is_picked
    }

    /// The station was held up, so the commands that wait are old: drops them. Returns whether
    /// there were any.
    pub(crate) fn forget_commands(&mut self) -> bool {
        let waited = !self.commands.is_empty() || self.is_picked;
        self.drop_commands();
        waited
    }

    /// The person or GaG that gave the commands has gone: drops the commands that wait, and makes
    /// the robot stand if one of them turns its wheels.
    pub(crate) fn end_commands(&mut self) -> Option<StationLine> {
        self.drop_commands();
        let turns = core::mem::take(&mut self.turns_wheels);
        // The robot asks for commands, or nobody has given one.
        turns.then(|| self.command(OperatorCommand::Stop).ok())??
    }

    fn drop_commands(&mut self) {
        self.commands.clear();
        self.is_picked = false;
    }

    /// Tells the robot this command.
    fn told_command(&mut self, command: OperatorCommand) {
        self.turns_wheels = match command {
            OperatorCommand::Stop => false,
            OperatorCommand::Arm(_) => self.turns_wheels,
            _ => true,
        };
    }

    /// The answer to the open question, if the station can give it now.
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
