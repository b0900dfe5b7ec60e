//! The robot's side of the conversation (C1-C9), as a pure state machine: lines and samples in,
//! [`Action`]s out, time an argument.
//!
//! What is asked follows from what the robot is doing and nothing else, so a successor of a killed
//! comm asks the same:
//!
//! ```text
//!   mode        what the robot does                     asked
//!   manual      anything but a one-shot, which is       styrcomm
//!               awaited
//!               for a second nobody has driven it, no   sidelength, karta, prodlis, for a second
//!               warehouse is known, and the peer
//!               speaks the extension
//!   autonomous  side, floor or goods are not known      sidelength, karta, prodlis
//!               it stands at the goods                  armcomm
//!               no order is under way or waits, and     fetchprod
//!               logic knows where it is and the goods
//!               anything else                           nothing
//! ```
//!
//! - Nothing is asked before the bridge has told the mode. When it becomes manual the robot asks at
//!   once (L436); an answer to what was held before is passed over.
//! - The floor is asked for once; side and goods by each connection.
//! - **Nothing moves late.** What moves the robot or lets it move is refused with a sentence when it
//!   comes more than 200 ms after it was given, and `fetchprod` after 2 s. How old a line may be at
//!   most, a peer that speaks the extension shows by repeating the clock that the robot puts into
//!   its sign (`freshness.rs`). Any other peer's lines have no age: where this process was held up
//!   and one of them may be waited for, comm closes the connection instead.
//!   `styrcomm 1` makes the robot stand whenever it comes.
//! - **A link that is lost makes the robot stand where it is driven through it.** A peer that speaks
//!   the extension repeats its `lager` line whenever the robot repeats its own; 150 ms without a
//!   word while something is carried out are a lost link. A peer that speaks only the document's
//!   language may be silent as long as it likes, so there only the end of its connection counts,
//!   which the kernel finds some 3 s after the last sign of the peer's machine.
//! - In autonomous mode the document leaves open what a lost link means (AMB-49), so it is
//!   configured ([`LinkLost`]): the order is carried out all the same, or logic is told to stand at
//!   the next node until the link is there again.
//! - A `stop` is carried out before all other lines that have come with it, whoever sends it, and
//!   commands among these are dropped. It is carried out even where comm was held up and has given
//!   the link up before it was read.
//! - The numbers of a connection's actions grow. An action whose number is not above the last one is
//!   refused: it was heard before, or comes late.
//! - What cannot be done is told in a `thought`, and asked again a little later.
//! - A peer that answers at once is not asked without end: commands are asked for at most 1 000
//!   times a second, anything else at most 5 times. An answer that took longer than that is
//!   followed by the next question at once.
//!
//! A station that has answered the extension's first line is told states, events and lists besides
//! (`telling.rs`), and its numbered actions are carried out and answered
//! (`conversation/orders.rs`): what is waited for stands in `tasks.rs`, what moves the robot in
//! `driving.rs`. No other peer hears anything of that.

use core::ops::Range;
use core::time::Duration;
use std::collections::HashMap;

use lager_lines::conversation::{Held, RobotLine, StationLine, StationLineError};
use lager_lines::extension::{self, EventKind, Hello};
use lager_lines::gag::{Answer, Query, Request};
use lager_lines::splitter::LineError;
use lager_lines::{LATEST, LATEST_MOVE, Name, ProductId, TooLate};
use lager_topics::{Mode, Order, Phase, Role, WarehouseMap};
use lager_wire::OperatorCommand;

use crate::action::Action;
use crate::driving::{Driving, For};
use crate::ids::Ids;
use crate::known::Known;
use crate::lost::{LinkLost, Standing};
use crate::map::Described;
use crate::memory::Memory;
use crate::moment::Moment;
use crate::speech::Told;
use crate::tasks::{Asker, Tasks};
use crate::telling::Telling;

mod freshness;
mod orders;
mod samples;
mod saying;

use freshness::Freshness;

/// In ns of real time: how often the extension's first line is repeated while something is carried
/// out, and else. What comes counts as older by up to as much.
const SIGN_MOVING: u64 = 25_000_000;
const SIGN: u64 = 50_000_000;
/// How long a peer that answers it may be silent while something is carried out, and else.
const SILENT_MOVING: u64 = 150_000_000;
const SILENT: u64 = 5_000_000_000;
/// When a question is asked again after an impossible answer, and at the earliest at all.
const AGAIN: u64 = 200_000_000;
/// When a further command is asked for at the earliest, however fast the peer has answered. One
/// that takes this long for its answer waits for nothing.
///
/// On a busy machine with two cores comm took 54 % of one for a peer that answered 36 000 times a
/// second. With this pace it takes 5.6 %, with one of 2 ms 3.8 %, and while nothing is answered
/// 0.7 % (2026-11-24).
const PACE: u64 = 1_000_000;
/// In ns since the connection is there: from when to when a robot in manual mode that nobody has
/// driven asks for the warehouse rather than for commands.
const DESCRIBED: Range<u64> = 1_000_000_000..2_000_000_000;
/// What is said to actions that a stop has ended.
const STOPPED: &str = "the robot has been stopped";
/// Stops whose confirmation is owed, at most.
const MOST_STOPS: usize = 16;

/// The conversation.
#[derive(Clone, Debug)]
pub struct Conversation {
    name: Name,
    actions: Vec<Action>,
    /// The last moment at which it was looked after.
    turned_ns: u64,
    ids: Ids,

    is_up: bool,
    /// The peer has answered the extension's first line.
    is_extended: bool,
    /// Nothing has been heard on this connection.
    is_fresh: bool,
    /// The number of the last action that has come on it.
    last_number: Option<u32>,
    up_ns: u64,
    heard_ns: u64,
    signed_ns: u64,
    freshness: Freshness,
    /// Somebody has driven the robot by answers of the document.
    is_driven: bool,
    held: Held,
    /// Nothing is asked before.
    ask_from_ns: u64,
    /// What was asked last of this peer, and when.
    asked: Option<(Query, u64)>,
    /// When the next question goes, where one is held back.
    asks_ns: Option<u64>,
    told: Told,

    warehouse: Described,
    known: Known,
    /// What is told besides where the extension is spoken.
    telling: Telling,
    /// What has happened lately.
    memory: Memory,
    /// The services of the robot, and since when each lives, as their samples' stamps have it.
    lives: HashMap<Role, u64>,
    tasks: Tasks,
    driving: Driving,
    /// Stops that are to be confirmed, and when they came.
    stops: Vec<(u32, u64)>,
    /// What a lost link means in autonomous mode.
    standing: Standing,
}

/// What happens to the connection.
impl Conversation {
    /// A conversation of the robot `name`; `kept` is the map that an earlier one has published.
    pub fn new(name: Name, kept: Option<WarehouseMap>, link_lost: LinkLost) -> Self {
        let warehouse = kept.as_ref().map(Described::floor_of);
        Self {
            name,
            actions: Vec::new(),
            turned_ns: 0,
            ids: Ids::default(),
            is_up: false,
            is_extended: false,
            is_fresh: false,
            last_number: None,
            up_ns: 0,
            heard_ns: 0,
            signed_ns: 0,
            freshness: Freshness::default(),
            is_driven: false,
            held: Held::default(),
            ask_from_ns: 0,
            asked: None,
            asks_ns: None,
            told: Told::default(),
            warehouse: warehouse.unwrap_or_default(),
            known: Known {
                map: kept.map(Box::new),
                ..Known::default()
            },
            telling: Telling::default(),
            memory: Memory::default(),
            lives: HashMap::new(),
            tasks: Tasks::default(),
            driving: Driving::default(),
            stops: Vec::new(),
            standing: Standing::new(link_lost),
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

    /// When it wants to be looked after next to ask something, in ns of real time, if a question is
    /// held back.
    pub const fn asks_ns(&self) -> Option<u64> {
        self.asks_ns
    }

    /// A connection is there.
    pub fn connected(&mut self, now: Moment) {
        if self.up_ns != 0 {
            self.happened(now, EventKind::LinkBack, "");
        }
        self.is_up = true;
        self.is_extended = false;
        self.is_fresh = true;
        self.last_number = None;
        self.up_ns = now.ns;
        self.heard_ns = now.ns;
        self.freshness = Freshness::default();
        self.held.clear();
        self.ask_from_ns = 0;
        self.asked = None;
        self.told = Told::default();
        self.warehouse.side = None;
        self.warehouse.products = None;
        // Whether the peer reads more than a name behind it is not known yet.
        self.sign(now, None);
    }

    /// The connection has ended.
    pub fn disconnected(&mut self, now: Moment) {
        if core::mem::take(&mut self.is_up) {
            self.happened(now, EventKind::LinkLost, "");
        }
        self.held.clear();
        self.stops.clear();
        self.tasks.forget_actions();
        self.driving.forget_actions();
        self.stand(now, "the link is lost");
    }

    /// Time has passed. To be called before what has come since, at least every 20 ms.
    pub fn turn(&mut self, now: Moment) {
        let pause = Duration::from_nanos(now.ns.saturating_sub(self.turned_ns));
        self.turned_ns = now.ns;
        if self.is_up && self.waits_for_what_is_old_after(pause) {
            self.hang_up(
                now,
                "the robot was held up, so what it has not read may be old",
            );
        }
        if self.driving.is_over(now) {
            let why = "the time of the last drive is over and nobody has renewed it";
            self.stand(now, why);
            self.think(why);
        }
        let renewed = self.driving.renew(now.robot);
        self.actions.extend(renewed.map(Action::Steer));
        self.tasks.turn(now);
        self.settle();
        let told = self
            .standing
            .tell(now, self.is_up, &self.known, &mut self.ids);
        self.actions.extend(told.map(Action::Press));
        self.keep_up(now);
        self.ask(now);
    }

    /// Lines have come, all that had arrived. Of those that are read after the link was given up
    /// only a stop counts.
    pub fn heard(&mut self, now: Moment, lines: &[Result<String, LineError>]) {
        let silent = Duration::from_nanos(now.ns.saturating_sub(self.heard_ns));
        self.freshness.after_silence(silent, self.is_extended);
        self.heard_ns = now.ns;
        let read = |line: &Result<String, LineError>| match line {
            Ok(line) => Ok(StationLine::read(line)),
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
        if !self.is_up {
            return;
        }
        for line in lines {
            match line {
                Ok(Ok(line)) => self.take(now, line, is_stopped),
                Ok(Err(error)) if self.is_fresh && error.is_of_nobody() => {}
                Ok(Err(error)) => self.misread(now, &error),
                Err(_) => return self.hang_up(now, "its lines cannot be read"),
            }
            self.is_fresh = false;
        }
        self.settle();
        self.ask(now);
    }

    fn take(&mut self, now: Moment, line: StationLine, is_stopped: bool) {
        match line {
            StationLine::Hello(hello) => {
                self.freshness.echoed(now, hello.clock_ms);
                if !self.is_extended {
                    self.is_extended = true;
                    self.telling.begin();
                    self.sign(now, Some(now.clock_ms()));
                    for report in self.memory.told(now.ns).collect::<Vec<_>>() {
                        self.say(RobotLine::Report(report));
                    }
                }
            }
            StationLine::Order(extension::Order::Stop { .. }) => {}
            StationLine::Order(extension::Order::Do {
                number,
                late_ms,
                action,
            }) => {
                if self.is_extended {
                    let given = Duration::from_millis(late_ms.into());
                    let late = self.freshness.late(now) + given;
                    self.carry_out(now, late, number, action, is_stopped);
                } else {
                    self.correct(
                        now,
                        "say `lager 1 <name>` before any other line of the extension",
                    );
                }
            }
            StationLine::Answer(answer) => self.answered(now, answer, is_stopped),
        }
    }

    /// Says what of a line cannot be read.
    fn misread(&mut self, now: Moment, error: &StationLineError) {
        let number = match error {
            StationLineError::Order(error) => error.number().filter(|_| self.is_extended),
            StationLineError::Hello(_) | StationLineError::Answer(_) => None,
        };
        match number {
            Some(number) => self.reply(number, Err(error.to_string())),
            None => self.correct(now, &error.to_string()),
        }
    }

    fn answered(&mut self, now: Moment, answer: Answer, is_stopped: bool) {
        let is_stop = answer == Answer::Command(OperatorCommand::Stop);
        if self.held.answer(&answer).is_err() {
            if is_stop {
                self.stand(now, STOPPED);
            }
            return;
        }
        let late = self.freshness.late(now);
        if let Err(why) = TooLate::check(late, answer.latest()) {
            return self.correct(now, &format!("{answer}: {why}"));
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
            Answer::Command(command) => {
                self.is_driven = true;
                if let Err(why) = self.command(now, late, command, For::Question) {
                    self.correct(now, &why);
                }
            }
        }
    }

    fn publish_map(&mut self, now: Moment) {
        match self.warehouse.to_bus() {
            Some(Ok(map)) => {
                let map = Box::new(map);
                if self.known.map.as_ref() != Some(&map) {
                    self.known.map = Some(map.clone());
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
            id: self.ids.fresh(now),
            product: product.get(),
        };
        self.tasks.order(now, Asker::Question, order);
    }

    fn press_picked(&mut self, now: Moment) {
        let order = self.known.status.map_or(0, |status| status.order_id);
        let id = self.ids.fresh(now);
        self.tasks.picked(now, Asker::Question, id, order, false);
    }
}

/// What follows from all of it.
impl Conversation {
    /// What the robot wants to know.
    fn wanted(&self, now: Moment) -> Option<Query> {
        let unknown = self.warehouse.unknown();
        if self.known.mode()? == Mode::Manual {
            let is_idle = DESCRIBED.contains(&now.ns.saturating_sub(self.up_ns)) && !self.is_driven;
            let is_blind = self.known.map.is_none() && self.is_extended && is_idle;
            let wheels = (!self.driving.is_awaited()).then_some(Query::Wheels);
            return unknown.filter(|_| is_blind).or(wheels);
        }
        if unknown.is_some() {
            return unknown;
        }
        let status = self.known.status?;
        let phase = status.phase.get()?;
        if phase == Phase::Picking {
            let waits = self.driving.is_running() || self.tasks.has_picked();
            return (!waits).then_some(Query::Arm);
        }
        // Logic would refuse the order, and the station would have told it in vain.
        if phase == Phase::WaitingForMap || status.needs_reset() {
            return None;
        }
        let queue = self.known.queue?;
        let is_idle = !self.tasks.has_order() && queue.under_way == 0 && queue.count == 0;
        is_idle.then_some(Query::Fetch)
    }

    fn ask(&mut self, now: Moment) {
        self.asks_ns = None;
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
        if self.held.get() == Some(query) {
            return;
        }
        let from_ns = self.ask_from_ns.max(self.paced_ns(query));
        if now.ns < from_ns {
            self.asks_ns = Some(from_ns);
            return;
        }
        self.asked = Some((query, now.ns));
        self.held.ask(query);
        self.say(RobotLine::Request(Request::Query(query)));
    }

    /// When `query` may be asked at the earliest, whatever was answered to the question before.
    fn paced_ns(&self, query: Query) -> u64 {
        let is_for_command = |query| matches!(query, Query::Wheels | Query::Arm);
        match self.asked {
            Some((last, at)) if is_for_command(last) && is_for_command(query) => at + PACE,
            Some((last, at)) if last == query => at + AGAIN,
            _ => 0,
        }
    }

    /// Finds out whether the link is still there.
    fn keep_up(&mut self, now: Moment) {
        if !self.is_up || !self.is_extended {
            return;
        }
        let silent = now.ns.saturating_sub(self.heard_ns);
        let (most, period) = match self.driving.is_running() {
            true => (SILENT_MOVING, SIGN_MOVING),
            false => (SILENT, SIGN),
        };
        if silent >= most {
            return self.hang_up(now, "the external computer has fallen silent");
        }
        if now.ns.saturating_sub(self.signed_ns) >= period {
            self.sign(now, Some(now.clock_ms()));
        }
    }

    /// Says the extension's first line, which a peer that knows it answers.
    fn sign(&mut self, now: Moment, clock_ms: Option<u64>) {
        self.signed_ns = now.ns;
        self.say(RobotLine::Hello(Hello {
            version: Hello::VERSION,
            name: self.name.clone(),
            clock_ms,
        }));
    }

    /// Whether an answer may have come meanwhile that moves the robot and whose age nobody knows.
    fn waits_for_what_is_old_after(&self, pause: Duration) -> bool {
        let is_by_hand = self.known.mode() == Some(Mode::Manual);
        let most = match self.held.get() {
            _ if self.freshness.is_told() => return false,
            Some(Query::Arm) => LATEST_MOVE,
            _ if is_by_hand => LATEST_MOVE,
            Some(Query::Fetch) => LATEST,
            _ => return false,
        };
        pause > most
    }

    fn hang_up(&mut self, now: Moment, why: &'static str) {
        self.disconnected(now);
        self.actions.push(Action::HangUp(why));
    }

    /// Makes the robot stand where it is driven from here, without a latched stop. `why` is said to
    /// the actions that this ends.
    fn stand(&mut self, now: Moment, why: &str) {
        if self.driving.let_go(why) {
            let id = self.ids.fresh(now);
            let stop = OperatorCommand::Stop;
            let order = self
                .driving
                .begin(now, Duration::ZERO, id, stop, For::Question);
            self.actions.push(Action::Steer(order));
        }
    }
}
