//! The robot's side of the conversation (C1-C9), as a pure state machine: lines and samples in,
//! [`Effect`]s out, time an argument.
//!
//! Only the robot's state decides which question it asks. So the successor of a killed comm asks
//! the same question:
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
//! - The robot asks nothing before the bridge has told the mode. When the mode becomes manual it
//!   asks at once (C4), and ignores an answer to its earlier question.
//! - The robot asks for the floor once, and for side length and goods on each connection.
//! - **Nothing moves late.** An order that moves the robot, or lets it move, is refused with a
//!   sentence when it comes more than 200 ms after somebody gave it; an answer to `fetchprod` after
//!   2 s. A peer that speaks the extension repeats the clock that the robot sends with its `lager`
//!   line; from this comm knows how old a line may be (`freshness.rs`). The lines of any other peer
//!   have no age: if this process was held up and may have such a line waiting, comm closes the
//!   connection instead. `styrcomm 1` makes the robot stand whenever it comes.
//! - **A lost link makes a robot stand that somebody drives through it.** A peer that speaks the
//!   extension repeats its `lager` line whenever the robot repeats its own. If it says nothing for
//!   150 ms while the robot carries something out, the link is lost. A peer that speaks only the
//!   document's language may be silent for any time. There only the end of its connection counts;
//!   the kernel finds it some 3 s after the last sign of the peer's machine.
//! - The document does not say what a lost link means in autonomous mode (AMB-49), so the
//!   configuration does ([`LinkLost`]): the robot carries out its order all the same, or logic
//!   makes it stand at the next node until the link is there again.
//! - A `stop` is carried out before all other lines that have come with it, whoever sends it, and
//!   commands among these are dropped. It is carried out even if comm was held up and has given up
//!   the link before it read the stop.
//! - The numbers of a connection's actions grow. An action whose number is not greater than the
//!   last one is refused: it was heard before, or comes late.
//! - If the robot cannot do something, it says so in a `thought` and asks again a little later.
//! - Even if a peer answers at once, the robot asks for commands at most 1 000 times a second, and
//!   for anything else at most 5 times. If an answer takes longer than that, the next question
//!   follows at once.
//!
//! A station that has answered the extension's first line is told states, events and lists besides
//! (`telling.rs`). Its numbered actions are carried out and answered (`conversation/orders.rs`);
//! `lager-operator` knows what each waits for, and what moves the robot. No other peer hears
//! anything of that.

use core::ops::Range;
use core::time::Duration;
use std::collections::VecDeque;

use lager_battery::{Battery, Pack};
use lager_floor::ProductId;
use lager_lines::Name;
use lager_lines::conversation::{Held, RobotLine, StationLine, StationLineError};
use lager_lines::extension::{self, Happened, Hello};
use lager_lines::gag::{Answer, Query, Request};
use lager_lines::splitter::LineError;
use lager_operator::{Driving, For, Orders};
use lager_orders::lease::{COMMAND, LATEST, LATEST_MOVE, TooLate};
use lager_orders::{Code, Mode, Moment, Reason};
use lager_topics::{Event, Phase, WarehouseMap};
use lager_wire::OperatorCommand;

use crate::effect::Effect;
use crate::known::Known;
use crate::lives::Lives;
use crate::lost::{LinkLost, Standing};
use crate::map::Described;
use crate::memory::Memory;
use crate::speech::Told;
use crate::telling::Telling;

mod commissioning;
mod freshness;
mod orders;
mod samples;
mod saying;

use freshness::Freshness;

/// How often the robot repeats the extension's first line: while it carries something out, and
/// else. In ns of real time. A line counts as older by up to this time.
const SIGN_MOVING: u64 = 25_000_000;
const SIGN: u64 = 50_000_000;
/// How long a peer that answers it may be silent: while something is carried out, and else.
const SILENT_MOVING: u64 = COMMAND.as_nanos() as u64;
const SILENT: u64 = 5_000_000_000;
/// How long after a question the robot asks the next one at the earliest; also after an impossible
/// answer.
const AGAIN: u64 = 200_000_000;
/// How long after a command the robot asks for the next one at the earliest, however fast the peer
/// has answered. A peer that takes this long for its answer does not wait.
///
/// On a busy machine with two cores comm took 54 % of one for a peer that answered 36 000 times a
/// second. With this pace it takes 5.6 %, with a pace of 2 ms 3.8 %, and 0.7 % without any answers
/// (2026-11-24).
const PACE: u64 = 1_000_000;
/// In ns since the connection began: from when to when a robot in manual mode that nobody has
/// driven asks for the warehouse, not for commands.
const DESCRIBED: Range<u64> = 1_000_000_000..2_000_000_000;
/// How long an event waits at most for the status that follows from it, and how soon the robot looks
/// for one. Logic publishes an event first, so a peer that hears it at once may answer before comm
/// knows the state from which the answer must be judged.
const UNTOLD: u64 = 100_000_000;
const UNTOLD_PACE: u64 = 1_000_000;
/// The answer to actions that a stop has ended.
const STOPPED: Code = Code::Stopped;
/// How many stops may wait for their confirmation.
const MOST_STOPS: usize = 16;

/// Where a wish comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asker {
    /// An answer to a question of the document. It gets no reply.
    Question,
    /// An action with this number.
    Action(u32),
}

/// The conversation.
#[derive(Clone, Debug)]
pub struct Conversation {
    name: Name,
    effects: Vec<Effect>,
    /// The time of the last call.
    turned_ns: u64,

    is_up: bool,
    /// The peer has answered the extension's first line.
    is_extended: bool,
    /// The peer has said nothing on this connection.
    is_fresh: bool,
    /// The number of the connection's last action.
    last_number: Option<u32>,
    up_ns: u64,
    heard_ns: u64,
    signed_ns: u64,
    freshness: Freshness,
    /// Somebody has driven the robot by answers of the document.
    is_driven: bool,
    held: Held,
    /// No question before this time.
    ask_from_ns: u64,
    /// The last question to this peer, and when it was asked.
    asked: Option<(Query, u64)>,
    /// When the next question goes out, if one waits.
    asks_ns: Option<u64>,
    told: Told,

    warehouse: Described,
    known: Known,
    /// When the last status was published.
    status_ns: u64,
    /// Events that wait for the status that follows from them, and when each was published.
    untold: VecDeque<(u64, Event)>,
    /// What only a peer with the extension is told.
    telling: Telling,
    battery: Battery,
    /// What has happened lately.
    memory: Memory,
    /// Which services have ended.
    lives: Lives,
    orders: Orders<Asker>,
    driving: Driving,
    /// Stops that wait for their confirmation, and when they came.
    stops: Vec<(u32, u64)>,
    /// What a lost link means in autonomous mode.
    standing: Standing,
}

/// What happens to the connection.
impl Conversation {
    /// A conversation of the robot `name`. `kept` is the map that an earlier conversation
    /// published.
    pub fn new(name: Name, kept: Option<WarehouseMap>, link_lost: LinkLost) -> Self {
        let warehouse = kept.as_ref().map(Described::floor_of);
        Self {
            name,
            effects: Vec::new(),
            turned_ns: 0,
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
            status_ns: 0,
            untold: VecDeque::new(),
            telling: Telling::default(),
            battery: Battery::default(),
            memory: Memory::default(),
            lives: Lives::default(),
            orders: Orders::default(),
            driving: Driving::default(),
            stops: Vec::new(),
            standing: Standing::new(link_lost),
        }
    }

    /// The same for a robot with this battery.
    #[must_use]
    pub fn on(mut self, pack: Pack) -> Self {
        self.battery = Battery::new(pack);
        self
    }

    /// Takes what is to be done, in the order of the decisions.
    pub fn effects(&mut self) -> Vec<Effect> {
        core::mem::take(&mut self.effects)
    }

    /// When it must be called next, in robot time, if earlier than its usual turn.
    pub fn due(&self) -> Option<Duration> {
        self.driving.due()
    }

    /// When it must be called next because of a question or an event that waits, in ns of real time.
    pub fn due_ns(&self) -> Option<u64> {
        let looks = (!self.untold.is_empty()).then(|| self.turned_ns + UNTOLD_PACE);
        self.asks_ns.into_iter().chain(looks).min()
    }

    /// A connection has begun.
    pub fn connected(&mut self, now: Moment) {
        if self.up_ns != 0 {
            self.happened(now, Happened::LinkBack, "");
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
        // It is not known yet whether the peer reads more than a name in that line.
        self.sign(now, None);
    }

    /// The connection has ended.
    pub fn disconnected(&mut self, now: Moment) {
        if core::mem::take(&mut self.is_up) {
            self.happened(now, Happened::LinkLost, "");
        }
        self.held.clear();
        self.stops.clear();
        self.orders.keep(|asker| asker == Asker::Question);
        self.driving.forget_actions();
        self.stand(now, Code::LinkLost);
        self.stand_commissioned(now);
    }

    /// Time has passed. Call this before everything that has come since, at least every 20 ms.
    pub fn turn(&mut self, now: Moment) {
        let pause = Duration::from_nanos(now.ns.saturating_sub(self.turned_ns));
        self.turned_ns = now.ns;
        if self.is_up && self.waits_for_what_is_old_after(pause) {
            self.hang_up(now, Code::HeldUp);
        }
        if self.driving.is_over(now) {
            self.stand(now, Code::DriveOver);
            self.think(Code::DriveOver);
        }
        let renewed = self.driving.renew(now.robot);
        self.effects.extend(renewed.map(Effect::Steer));
        // In the document's language nothing ends an order that was given.
        self.orders.turn(now, |asker| asker != Asker::Question);
        self.tell_events(now);
        self.settle();
        let told = self
            .standing
            .tell(now, self.is_up, &self.known, self.orders.ids());
        self.effects.extend(told.map(Effect::Do));
        self.keep_up(now);
        self.ask(now);
    }

    /// Lines have come, all that had arrived. If the link was given up before they were read, only
    /// a stop among them counts.
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
                Err(_) => return self.hang_up(now, Code::LinesUnread),
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
                let trip = hello
                    .clock_ms
                    .and_then(|sent| now.clock_ms().checked_sub(sent));
                self.known.trip_ms = trip.and_then(|ms| u32::try_from(ms).ok());
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
                    self.correct(now, Code::HelloFirst);
                }
            }
            StationLine::Answer(answer) => self.answered(now, answer, is_stopped),
        }
    }

    /// Says which part of a line cannot be read.
    fn misread(&mut self, now: Moment, error: &StationLineError) {
        let number = match error {
            StationLineError::Order(error) => error.number().filter(|_| self.is_extended),
            StationLineError::Hello(_) | StationLineError::Answer(_) => None,
        };
        let why = Reason::new(Code::Misread, &[error]);
        match number {
            Some(number) => self.reply(number, Err(why)),
            None => self.correct(now, why),
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
        if let Err(TooLate(late)) = TooLate::check(late, answer.latest()) {
            let why = Reason::new(Code::LateAnswer, &[&answer, &late.as_millis()]);
            return self.correct(now, why);
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
                    self.correct(now, why);
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
                    self.effects.push(Effect::Map(map));
                }
            }
            Some(Err(why)) => {
                // Either of the two may be wrong.
                self.warehouse = Described::default();
                self.correct(now, why);
            }
            None => {}
        }
    }

    fn fetch(&mut self, now: Moment, product: ProductId) {
        let products = self.warehouse.products.iter();
        let mut known = products.flat_map(|products| products.as_slice());
        if !known.any(|one| one.id == product) {
            return self.correct(now, Reason::new(Code::NoProduct, &[&product]));
        }
        let order = self.orders.ids().fresh(now.ns);
        self.orders.order(now, Asker::Question, order, product);
    }

    fn press_picked(&mut self, now: Moment) {
        let picked = lager_orders::Action::Picked { force: false };
        let seen = self.known.seen();
        let begun = self
            .orders
            .give(now, Duration::ZERO, Asker::Question, picked, &seen);
        if let Err(why) = begun {
            self.correct(now, why);
        }
    }
}

/// Decides what follows from the state and the lines.
impl Conversation {
    /// Whether an order that answered a question has not shown its effect yet.
    fn is_ordering(&self) -> bool {
        self.orders.ordering().any(|asker| asker == Asker::Question)
    }

    /// The question that the robot needs now.
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
            let waits = self.driving.is_running() || self.orders.has_picked();
            return (!waits).then_some(Query::Arm);
        }
        // Logic would refuse the order, and the station would have given it in vain.
        if phase == Phase::WaitingForMap || status.needs_reset() {
            return None;
        }
        let queue = self.known.queue?;
        let is_idle = !self.is_ordering() && queue.under_way == 0 && queue.count == 0;
        is_idle.then_some(Query::Fetch)
    }

    fn ask(&mut self, now: Moment) {
        self.asks_ns = None;
        if !self.is_up {
            return;
        }
        let Some(query) = self.wanted(now) else {
            // A person at the robot may have given an order meanwhile. If the station still
            // answers, its order waits after that one.
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

    /// When the robot may ask `query` at the earliest, whatever the last answer was.
    fn paced_ns(&self, query: Query) -> u64 {
        let is_for_command = |query| matches!(query, Query::Wheels | Query::Arm);
        match self.asked {
            Some((last, at)) if is_for_command(last) && is_for_command(query) => at + PACE,
            Some((last, at)) if last == query => at + AGAIN,
            _ => 0,
        }
    }

    /// Checks whether the link is lost.
    fn keep_up(&mut self, now: Moment) {
        if !self.is_up || !self.is_extended {
            return;
        }
        let silent = now.ns.saturating_sub(self.heard_ns);
        let (most, period) = match self.driving.is_running() || self.moves_commissioned() {
            true => (SILENT_MOVING, SIGN_MOVING),
            false => (SILENT, SIGN),
        };
        if silent >= most {
            return self.hang_up(now, Code::PeerSilent);
        }
        if now.ns.saturating_sub(self.signed_ns) >= period {
            self.sign(now, Some(now.clock_ms()));
        }
    }

    /// Says the extension's first line. A peer that knows it answers.
    fn sign(&mut self, now: Moment, clock_ms: Option<u64>) {
        self.signed_ns = now.ns;
        self.say(RobotLine::Hello(Hello {
            version: Hello::VERSION,
            name: self.name.clone(),
            clock_ms,
        }));
    }

    /// Whether an answer of unknown age that moves the robot may have come meanwhile.
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

    fn hang_up(&mut self, now: Moment, why: Code) {
        self.disconnected(now);
        self.effects.push(Effect::HangUp(why.into()));
    }

    /// Makes the robot stand if it is driven from here, without a stop. `why` is the answer to the
    /// actions that end by this.
    fn stand(&mut self, now: Moment, why: Code) {
        if self.driving.let_go(why) {
            let id = self.orders.ids().fresh(now.ns);
            let stop = OperatorCommand::Stop;
            let order = self
                .driving
                .begin(now, Duration::ZERO, id, stop, For::Question);
            self.effects.push(Effect::Steer(order));
        }
    }
}
