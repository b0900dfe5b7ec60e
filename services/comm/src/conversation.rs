//! The robot's side of the conversation (C1-C9), as a pure state machine: lines and samples in,
//! [`Action`]s out, time an argument.
//!
//! What is asked follows from what the robot is doing and nothing else, so a successor of a killed
//! comm asks the same:
//!
//! ```text
//!   mode        what the robot does                     asked
//!   manual      no warehouse is known, and the peer     sidelength, karta, prodlis, for a second
//!               speaks the extension
//!               anything but a one-shot, which is       styrcomm
//!               awaited
//!   autonomous  side, floor or goods are not known      sidelength, karta, prodlis
//!               it stands at the goods                  armcomm
//!               no order is under way or waits          fetchprod
//!               anything else                           nothing
//! ```
//!
//! - Nothing is asked before the bridge has told the mode. When it becomes manual the robot asks at
//!   once (L436); an answer to what was held before is passed over.
//! - The floor is asked for once; side and goods by each connection.
//! - A command is carried out while its answer is fresh. An answer that was read after this process
//!   was held up for [`Conversation::LONGEST_PAUSE`] may be old, so in manual mode comm closes the
//!   connection instead. `styrcomm 1` makes the robot stand even when nothing was asked.
//! - **A link that is lost makes the robot stand in manual mode.** A peer that speaks the extension
//!   repeats its `lager` line whenever the robot repeats its own, every 50 ms in manual mode; 150
//!   ms without a word while something is carried out are a lost link. A peer that speaks only the
//!   document's language may be silent as long as it likes, so there only the end of its connection
//!   counts, which the kernel finds some 3 s after the last sign of the peer's machine.
//! - In autonomous mode a lost link changes nothing: the order is carried out (AMB-49 leaves it
//!   open).
//! - A `stop` is carried out before all other lines that have come with it, whoever sends it, and
//!   commands among these are dropped.
//! - What cannot be done is told in a `thought`, and asked again a little later.

use core::time::Duration;

use lager_lines::conversation::{Held, RobotLine, StationLine};
use lager_lines::extension::{self, Hello, Report};
use lager_lines::gag::{Answer, Query, Request};
use lager_lines::splitter::LineError;
use lager_lines::{Coord, Name, ProductId, Text};
use lager_topics::{
    Event, EventKind, Health, Input, InputKind, Mode, NavigatorStatus, Order, OrderQueue, Phase,
    Refusal, Route, SteeringOrder, SteeringReport, Thought, WarehouseMap,
};
use lager_wire::OperatorCommand;

use crate::driving::Driving;
use crate::map::{Described, direction};
use crate::moment::Moment;
use crate::speech::{self, Told};

/// In ns of real time: how often the extension's first line is repeated in manual mode, and else.
const SIGN_BY_HAND: u64 = 50_000_000;
const SIGN: u64 = 1_000_000_000;
/// How long a peer that answers it may be silent while something is carried out, and else.
const SILENT_BY_HAND: u64 = 150_000_000;
const SILENT: u64 = 5_000_000_000;
/// When a question is asked again after an impossible answer.
const AGAIN: u64 = 200_000_000;
/// When an order or a press is repeated that logic does not show.
const REPEAT: u64 = 250_000_000;
/// How long after the connection is there a robot in manual mode asks for the warehouse rather than
/// for commands.
const DESCRIBED: u64 = 1_000_000_000;
/// How long logic may take over a press.
const PRESS: u64 = 2_500_000_000;
/// Stops whose confirmation is owed, at most.
const MOST_STOPS: usize = 16;

/// What is to be done, in the order in which it was decided.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Say a line to the peer.
    Say(RobotLine),
    /// Give the connection up; another one is made.
    HangUp(&'static str),
    /// Publish the warehouse.
    Map(Box<WarehouseMap>),
    /// Order a product.
    Order(Order),
    /// Press a button.
    Press(Input),
    /// Give or renew a steering order.
    Steer(SteeringOrder),
    /// Stop the robot by its stop word.
    Stop,
}

/// The conversation.
#[derive(Clone, Debug)]
pub struct Conversation {
    name: Name,
    actions: Vec<Action>,
    /// The last moment at which it was looked after.
    turned_ns: u64,
    last_id: u32,

    is_up: bool,
    /// The peer has answered the extension's first line.
    is_extended: bool,
    /// Nothing has been heard on this connection.
    is_fresh: bool,
    up_ns: u64,
    heard_ns: u64,
    signed_ns: u64,
    held: Held,
    /// Nothing is asked before.
    ask_from_ns: u64,
    told: Told,

    warehouse: Described,
    published: Option<Box<WarehouseMap>>,
    health: Option<Health>,
    status: Option<NavigatorStatus>,
    queue: Option<OrderQueue>,
    /// Given, and not yet shown by logic.
    order: Option<(Order, u64)>,
    /// Pressed at, and repeated at.
    pickup: Option<(Input, u64, u64)>,
    driving: Driving,
    /// Stops that are to be confirmed, and when they came.
    stops: Vec<(u32, u64)>,
}

/// What happens to the connection.
impl Conversation {
    /// How long its thread may be held up before the lines that have come meanwhile count as old.
    pub const LONGEST_PAUSE: Duration = Duration::from_millis(200);

    /// A conversation of the robot `name`; `kept` is the map that an earlier one has published.
    pub fn new(name: Name, kept: Option<WarehouseMap>) -> Self {
        let warehouse = kept.as_ref().map(Described::floor_of);
        Self {
            name,
            actions: Vec::new(),
            turned_ns: 0,
            last_id: 0,
            is_up: false,
            is_extended: false,
            is_fresh: false,
            up_ns: 0,
            heard_ns: 0,
            signed_ns: 0,
            held: Held::default(),
            ask_from_ns: 0,
            told: Told::default(),
            warehouse: warehouse.unwrap_or_default(),
            published: kept.map(Box::new),
            health: None,
            status: None,
            queue: None,
            order: None,
            pickup: None,
            driving: Driving::default(),
            stops: Vec::new(),
        }
    }

    /// What is to be done; it is then no longer here.
    pub fn actions(&mut self) -> Vec<Action> {
        core::mem::take(&mut self.actions)
    }

    /// When it wants to be looked after next, in robot time, if before its usual turn.
    pub fn due(&self) -> Option<Duration> {
        self.driving.due()
    }

    /// A connection is there.
    pub fn connected(&mut self, now: Moment) {
        self.is_up = true;
        self.is_extended = false;
        self.is_fresh = true;
        self.up_ns = now.ns;
        self.heard_ns = now.ns;
        self.held.clear();
        self.ask_from_ns = 0;
        self.told = Told::default();
        self.warehouse.side = None;
        self.warehouse.products = None;
        self.sign(now);
    }

    /// The connection has ended.
    pub fn disconnected(&mut self, now: Moment) {
        self.is_up = false;
        self.held.clear();
        self.stops.clear();
        self.stand(now);
    }

    /// Time has passed. To be called before what has come since, at least every 20 ms.
    pub fn turn(&mut self, now: Moment) {
        let pause = Duration::from_nanos(now.ns.saturating_sub(self.turned_ns));
        self.turned_ns = now.ns;
        if pause > Self::LONGEST_PAUSE && self.is_up && self.mode() == Some(Mode::Manual) {
            self.hang_up(
                now,
                "the robot was held up, so what it has not read may be old",
            );
        }
        match self.driving.renew(now.robot) {
            Ok(order) => self.actions.extend(order.map(Action::Steer)),
            Err(why) => self.think(&why),
        }
        self.repeat(now);
        self.keep_up(now);
        self.ask(now);
    }

    /// Lines have come, all that had arrived.
    pub fn heard(&mut self, now: Moment, lines: &[Result<String, LineError>]) {
        if !self.is_up {
            return;
        }
        self.heard_ns = now.ns;
        let read = |line: &Result<String, LineError>| match line {
            Ok(line) => Ok(StationLine::read(line).map_err(|error| error.to_string())),
            Err(error) => Err(error.to_string()),
        };
        let lines: Vec<_> = lines.iter().map(read).collect();
        let mut is_stopped = false;
        for line in lines.iter().flatten().flatten() {
            if let StationLine::Order(extension::Order::Stop { number }) = line {
                self.stop(now, *number);
                is_stopped = true;
            }
        }
        for line in lines {
            match line {
                Ok(Ok(line)) => self.take(now, line, is_stopped),
                Ok(Err(_)) if self.is_fresh => {}
                Ok(Err(why)) => self.correct(now, &why),
                Err(_) => return self.hang_up(now, "its lines cannot be read"),
            }
            self.is_fresh = false;
        }
        self.ask(now);
    }

    fn take(&mut self, now: Moment, line: StationLine, is_stopped: bool) {
        match line {
            StationLine::Hello(_) => self.is_extended = true,
            StationLine::Order(extension::Order::Stop { .. }) => {}
            StationLine::Order(extension::Order::Do { number, .. }) => {
                let reason = Text::new("this robot takes stops and the document's commands");
                self.say(RobotLine::Report(Report::Refused {
                    number,
                    reason: reason.unwrap_or_default(),
                }));
            }
            StationLine::Answer(answer) => self.answered(now, answer, is_stopped),
        }
    }

    fn answered(&mut self, now: Moment, answer: Answer, is_stopped: bool) {
        let is_stop = answer == Answer::Command(OperatorCommand::Stop);
        if self.held.answer(&answer).is_err() {
            if is_stop {
                self.stand(now);
            }
            return;
        }
        match answer {
            Answer::SideLength(side) => self.warehouse.side = Some(side),
            Answer::Map(map) => self.warehouse.map = Some(map),
            Answer::Products(_, products) => {
                self.warehouse.products = Some(products);
                self.publish_map(now);
            }
            Answer::Fetch(product) => self.fetch(now, product),
            Answer::PickupDone => self.press_picked(now),
            Answer::Command(_) if is_stopped => {}
            Answer::Command(command) => self.command(now, command),
        }
    }

    fn publish_map(&mut self, now: Moment) {
        match self.warehouse.to_bus() {
            Some(Ok(map)) => {
                let map = Box::new(map);
                if self.published.as_ref() != Some(&map) {
                    self.published = Some(map.clone());
                    self.actions.push(Action::Map(map));
                }
            }
            Some(Err(why)) => {
                // Either may be wrong.
                self.warehouse = Described::default();
                self.correct(now, &why);
            }
            None => {}
        }
    }

    fn fetch(&mut self, now: Moment, product: ProductId) {
        let products = self.warehouse.products.iter();
        let mut known = products.flat_map(|products| products.as_slice());
        if !known.any(|one| one.id == product) {
            return self.correct(now, &format!("there is no product {product}"));
        }
        let order = Order {
            id: self.fresh_id(now),
            product: product.get(),
        };
        self.order = Some((order, now.ns));
        self.actions.push(Action::Order(order));
    }

    fn press_picked(&mut self, now: Moment) {
        let input = Input {
            kind: InputKind::PickupDone.into(),
            order_id: self.status.map_or(0, |status| status.order_id),
            id: self.fresh_id(now),
            ..Input::default()
        };
        self.pickup = Some((input, now.ns, now.ns));
        self.actions.push(Action::Press(input));
    }

    fn command(&mut self, now: Moment, command: OperatorCommand) {
        if command == OperatorCommand::Stop {
            return self.stand(now);
        }
        let is_arm = matches!(command, OperatorCommand::Arm(_));
        if self.mode() != Some(Mode::Manual) && !is_arm {
            let why = "the robot is autonomous and stands at goods: only its arm is moved";
            return self.correct(now, why);
        }
        let blocked = self.health.and_then(|health| health.blocked.get());
        if let Some(why) = blocked.filter(|why| *why != Refusal::None) {
            let why = format!("{} is not possible now: {why}", command.name());
            return self.correct(now, &why);
        }
        let id = self.fresh_id(now);
        let order = self.driving.begin(now, id, command);
        self.actions.push(Action::Steer(order));
    }

    fn stop(&mut self, now: Moment, number: Option<u32>) {
        self.driving.let_go();
        self.actions.push(Action::Stop);
        if let Some(number) = number
            && self.stops.len() < MOST_STOPS
        {
            self.stops.push((number, now.ns));
        }
    }
}

/// What the robot does.
impl Conversation {
    /// The bridge has told who may steer.
    pub fn health(&mut self, now: Moment, health: &Health) {
        let mode_before = self.mode();
        self.health = Some(*health);
        if self.mode() != mode_before {
            // A command that was begun in one mode has no meaning in the other.
            self.driving.let_go();
            self.held.clear();
        }
        if let Some(why) = self.driving.refused(health) {
            self.think(&why);
        }
        if health.stopped != 0 && self.driving.let_go() {
            self.think("the robot has been stopped");
        }
        self.ask(now);
    }

    /// Logic has told where it is and what it does.
    pub fn status(&mut self, now: Moment, status: &NavigatorStatus) {
        self.status = Some(*status);
        if status.phase != Phase::Picking {
            self.pickup = None;
        }
        self.see_order(status.order_id);
        if let Some(heading) = status.heading.get() {
            let line = self.told.looks(direction(heading));
            self.say_if_up(line);
        }
        self.ask(now);
    }

    /// Logic has told what it will fetch.
    pub fn queue(&mut self, now: Moment, queue: &OrderQueue) {
        self.queue = Some(*queue);
        if queue.under_way != 0 {
            self.see_order(queue.order_id);
        }
        for order in queue.orders() {
            self.see_order(order.id);
        }
        self.ask(now);
    }

    /// Something has happened on a mission.
    pub fn event(&mut self, now: Moment, event: &Event) {
        match event.kind.get() {
            // Logic says why in a thought.
            Some(EventKind::Refused) if self.is_ordered(event.order_id) => {
                self.order = None;
                self.ask_from_ns = now.ns + AGAIN;
            }
            Some(EventKind::PickupRefused) => self.pickup = None,
            _ => {}
        }
        self.ask(now);
    }

    /// The steering board has reported.
    pub fn report(&mut self, now: Moment, report: &SteeringReport) {
        if let Some(why) = self.driving.reported(report) {
            self.think(&why);
        }
        let stopped = self.health.is_some_and(|health| health.stopped != 0);
        if stopped && (report.left_duty, report.right_duty, report.age_ms) == (0, 0, 0) {
            for (number, since) in core::mem::take(&mut self.stops) {
                let after_ms = now.ns.saturating_sub(since) / 1_000_000;
                self.say(RobotLine::Report(Report::Stopped {
                    number,
                    after_ms: u32::try_from(after_ms).unwrap_or(u32::MAX),
                }));
            }
        }
        self.ask(now);
    }

    /// Logic has planned another way.
    pub fn route(&mut self, route: &Route) {
        if let Some(node) = route.nodes().first() {
            let line = self.told.node(Coord {
                x: node.x,
                y: node.y,
            });
            self.say_if_up(line);
        }
    }

    /// A service has thought something.
    pub fn thought(&mut self, thought: &Thought) {
        self.think(&thought.to_string());
    }

    /// Whether this order has been given and logic does not show it yet.
    fn is_ordered(&self, id: u32) -> bool {
        self.order.is_some_and(|(order, _)| order.id == id)
    }

    /// Logic shows this order: it is not to be repeated.
    fn see_order(&mut self, id: u32) {
        self.order.take_if(|(order, _)| order.id == id);
    }
}

/// What follows from all of it.
impl Conversation {
    fn mode(&self) -> Option<Mode> {
        self.health.and_then(|health| health.mode.get())
    }

    /// What the robot wants to know.
    fn wanted(&self, now: Moment) -> Option<Query> {
        let unknown = self.warehouse.unknown();
        if self.mode()? == Mode::Manual {
            let is_new = now.ns.saturating_sub(self.up_ns) < DESCRIBED;
            let is_blind = self.published.is_none() && self.is_extended && is_new;
            let wheels = (!self.driving.is_awaited()).then_some(Query::Wheels);
            return unknown.filter(|_| is_blind).or(wheels);
        }
        if unknown.is_some() {
            return unknown;
        }
        if self.status?.phase == Phase::Picking {
            let waits = self.driving.is_running() || self.pickup.is_some();
            return (!waits).then_some(Query::Arm);
        }
        let queue = self.queue?;
        let is_idle = self.order.is_none() && queue.under_way == 0 && queue.count == 0;
        is_idle.then_some(Query::Fetch)
    }

    fn ask(&mut self, now: Moment) {
        if !self.is_up {
            return;
        }
        let Some(query) = self.wanted(now) else {
            // A person at the robot may have ordered meanwhile. What the station answers all the
            // same waits after that.
            if self.held.get() != Some(Query::Fetch) {
                self.held.clear();
            }
            return;
        };
        if self.held.get() != Some(query) && now.ns >= self.ask_from_ns {
            self.held.ask(query);
            self.say(RobotLine::Request(Request::Query(query)));
        }
    }

    /// Repeats what logic does not show yet.
    fn repeat(&mut self, now: Moment) {
        if let Some((order, sent)) = &mut self.order
            && now.ns.saturating_sub(*sent) >= REPEAT
        {
            *sent = now.ns;
            self.actions.push(Action::Order(*order));
        }
        if let Some((input, pressed, sent)) = &mut self.pickup {
            if now.ns.saturating_sub(*pressed) >= PRESS {
                self.pickup = None;
                self.think("logic does not react to pickup_done");
            } else if now.ns.saturating_sub(*sent) >= REPEAT {
                *sent = now.ns;
                self.actions.push(Action::Press(*input));
            }
        }
    }

    /// Finds out whether the link is still there.
    fn keep_up(&mut self, now: Moment) {
        if !self.is_up || !self.is_extended {
            return;
        }
        let silent = now.ns.saturating_sub(self.heard_ns);
        if silent >= SILENT || (self.driving.is_running() && silent >= SILENT_BY_HAND) {
            return self.hang_up(now, "the external computer has fallen silent");
        }
        let period = match self.mode() {
            Some(Mode::Manual) => SIGN_BY_HAND,
            _ => SIGN,
        };
        if now.ns.saturating_sub(self.signed_ns) >= period {
            self.sign(now);
        }
    }

    /// Says the extension's first line, which a peer that knows it answers.
    fn sign(&mut self, now: Moment) {
        self.signed_ns = now.ns;
        self.say(RobotLine::Hello(Hello {
            version: Hello::VERSION,
            name: self.name.clone(),
        }));
    }

    fn hang_up(&mut self, now: Moment, why: &'static str) {
        self.disconnected(now);
        self.actions.push(Action::HangUp(why));
    }

    /// Makes the robot stand where it is driven from here, without a latched stop.
    fn stand(&mut self, now: Moment) {
        if self.driving.let_go() {
            let id = self.fresh_id(now);
            let order = self.driving.begin(now, id, OperatorCommand::Stop);
            self.actions.push(Action::Steer(order));
        }
    }

    /// Tells the peer what cannot be done; the question that follows is asked a little later.
    fn correct(&mut self, now: Moment, why: &str) {
        self.think(why);
        self.held.clear();
        self.ask_from_ns = now.ns + AGAIN;
    }

    fn think(&mut self, sentence: &str) {
        self.say_if_up(Some(speech::thought(sentence)));
    }

    fn say_if_up(&mut self, line: Option<RobotLine>) {
        if let Some(line) = line.filter(|_| self.is_up) {
            self.say(line);
        }
    }

    fn say(&mut self, line: RobotLine) {
        self.actions.push(Action::Say(line));
    }

    /// An id that nothing of this or an earlier process has had for the last hour: the
    /// milliseconds of the machine's clock.
    fn fresh_id(&mut self, now: Moment) -> u32 {
        let milliseconds = (now.ns / 1_000_000) as u32;
        // Two in one millisecond follow each other; the clock has caught up long before a restart.
        self.last_id = match milliseconds.wrapping_sub(self.last_id) {
            0 | 0x8000_0000.. => self.last_id.wrapping_add(1),
            _ => milliseconds,
        };
        self.last_id
    }
}
