//! The conversation's shell between the socket and the bus: it carries lines and samples and
//! decides nothing.
//!
//! **Safe state**: silence. When this process ends, nobody renews its command any more, and the
//! bridge stops the robot when the lease is over, 120 ms later. Logic goes on with its orders.
//!
//! A watchdog guards its turns. Each turn is a sign of life, and a call that does not return ends
//! the process. `up` starts it again.

use core::time::Duration;
use std::path::PathBuf;

use lager_battery::Pack;
use lager_home::{Clock, Home, UnitName};
use lager_lines::{MAX_LINE, Name, to_line};
use lager_operator::Act;
use lager_orders::{Code, Commission, Moment, Reason};
use lager_ports::{
    Bus, Cause, KEPT_WAIT, PortError, Publisher, ReceiveError, Sample, SendError, Subscriber,
};
use lager_sample::{Request, Topic};
use lager_stop::{StopPage, StopWord};
use lager_topics::{
    BridgeRequest, LatencyPath, LinkHealth, LogThought, MissionEvent, MissionOrder, MissionQueue,
    NavBlocks, NavMap, NavRoute, NavStatus, OperatorInput, Role, SensorDistance, SensorLine,
    SteeringCommand, SteeringState, StopCause, TruthPose, WarehouseMap, WorldRequest,
};
use lager_wake::{Policy, Shutdown, Waiter, Watchdog};

use crate::asking::Asking;
use crate::commissioner::{self, Commissioner};
use crate::conversation::Conversation;
use crate::effect::Effect;
use crate::known::{Machine, Senses};
use crate::link::{Link, News, Wanted};
use crate::lost::LinkLost;
use crate::telling;

/// The longest wait for anything, in real time. Most samples do not wake comm, so that the path has
/// no further process to wake.
const LONGEST_WAIT: Duration = Duration::from_millis(10);

/// How often comm looks into the robot's folder, in ns of real time.
const LOOK: u64 = 200_000_000;
/// How long ago, in ns, people may have asked for something that this process tells: another one may
/// have died before it could. A station knows again what it was told within this time.
const RECALLED: u64 = 3_000_000_000;

/// Why a request was not sent.
const BUSY: Code = Code::TooMuchAsked;

/// What comm is told at its start.
#[derive(Clone, Debug)]
pub struct CommConfig {
    /// The external computer: host and port.
    pub station: String,
    /// The robot's name for the external computer.
    pub name: Name,
    /// The file of the secret by which both recognise each other. Without one the robot believes
    /// whoever answers there, as in the document.
    pub secret: Option<PathBuf>,
    /// What a lost link means in autonomous mode.
    pub link_lost: LinkLost,
    /// Its battery.
    pub pack: Pack,
    /// Whether to take over the map of an earlier comm.
    pub resume: bool,
    /// The program that commissions the robot; without one nobody does by a page.
    pub commissioner: Option<Commissioner>,
    /// Finds out how this machine is, in well under a millisecond.
    pub machine: fn() -> Machine,
}

/// Runs the communication unit until `shutdown` is requested. `watchdog` guards its turns, and ends
/// the process when one hangs.
///
/// # Errors
/// Comm's ports on the bus cannot be opened; the sentence says what to do.
pub fn run(
    bus: &Bus,
    config: &CommConfig,
    watchdog: &Watchdog,
    shutdown: &Shutdown,
) -> Result<(), PortError> {
    let mut shell = Shell::new(&Opening { bus, watchdog }, config)?;
    shutdown.wake(shell.waiter.ringer());
    while !shutdown.is_requested() {
        shell.turn();
    }
    Ok(())
}

/// Opens one port after the other; each may take as long as any other call.
struct Opening<'a> {
    bus: &'a Bus,
    watchdog: &'a Watchdog,
}

impl Opening<'_> {
    fn subscriber<T: Topic>(&self) -> Result<Subscriber<T>, PortError> {
        self.watchdog.enter("opening a topic");
        self.bus.subscriber()
    }

    fn publisher<T: Topic>(&self) -> Result<Publisher<T>, PortError> {
        self.watchdog.enter("opening a topic");
        self.bus.publisher()
    }

    fn asking<R: Request>(&self, waiter: &Waiter) -> Result<Asking<R>, PortError> {
        self.watchdog.enter("opening a request");
        Asking::new(self.bus, waiter.ringer())
    }
}

struct Shell {
    clock: Clock,
    waiter: Waiter,
    watchdog: Watchdog,
    conversation: Conversation,
    link: Link,
    stop_word: PathBuf,
    home: Home,
    robot: UnitName,
    machine: fn() -> Machine,
    /// When it looks into the robot's folder next.
    looks_ns: u64,
    /// When somebody last asked for something that was told.
    asked_ns: u64,

    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
    queue: Subscriber<MissionQueue>,
    events: Subscriber<MissionEvent>,
    reports: Subscriber<SteeringState>,
    route: Subscriber<NavRoute>,
    thoughts: Subscriber<LogThought>,
    line: Subscriber<SensorLine>,
    distance: Subscriber<SensorDistance>,
    blocks: Subscriber<NavBlocks>,
    latency: Subscriber<LatencyPath>,
    truth: Subscriber<TruthPose>,

    map: Publisher<NavMap>,
    orders: Publisher<MissionOrder>,
    inputs: Publisher<OperatorInput>,
    commands: Publisher<SteeringCommand>,
    bridge: Asking<BridgeRequest>,
    world: Asking<WorldRequest>,
    commissioner: Option<Commissioner>,
    /// The commissioning that is at work.
    commissions: Option<commissioner::Process>,
    complaints: u32,
}

impl Drop for Shell {
    fn drop(&mut self) {
        self.home.forget_asked(&self.robot);
    }
}

impl Shell {
    fn new(opening: &Opening<'_>, config: &CommConfig) -> Result<Self, PortError> {
        let Opening { bus, watchdog } = opening;
        watchdog.enter("asking for the map that is kept");
        let kept = match config.resume {
            true => bus.kept::<NavMap>(KEPT_WAIT).unwrap_or_else(|error| {
                tracing::warn!("the map is asked for anew: {error}");
                None
            }),
            false => None,
        };
        let kept = kept.map(|(map, _)| map);
        watchdog.enter("opening the bells");
        let waiter = bus.waiter(Policy::Block)?;
        let wanted = Wanted {
            station: config.station.clone(),
            robot: config.name.clone(),
            secret: config.secret.clone(),
        };
        // Nothing of it is needed to drive.
        let _ = bus.home().listen_asked(bus.unit());
        let mut shell = Self {
            clock: bus.clock(),
            link: Link::new(wanted, waiter.ringer()).map_err(|error| PortError::Thread {
                what: "the link to the station",
                fault: error.into(),
            })?,
            bridge: opening.asking(&waiter)?,
            world: opening.asking(&waiter)?,
            waiter,
            watchdog: (*watchdog).clone(),
            conversation: Conversation::new(config.name.clone(), kept, config.link_lost)
                .on(config.pack),
            stop_word: bus.home().folder_of(bus.unit()).join(StopPage::FILE),
            home: bus.home().clone(),
            robot: bus.unit().clone(),
            machine: config.machine,
            looks_ns: 0,
            asked_ns: Clock::monotonic_ns().saturating_sub(RECALLED),
            health: opening.subscriber()?,
            status: opening.subscriber()?,
            queue: opening.subscriber()?,
            events: opening.subscriber()?,
            reports: opening.subscriber()?,
            route: opening.subscriber()?,
            thoughts: opening.subscriber()?,
            line: opening.subscriber()?,
            distance: opening.subscriber()?,
            blocks: opening.subscriber()?,
            latency: opening.subscriber()?,
            truth: opening.subscriber()?,
            map: opening.publisher()?,
            orders: opening.publisher()?,
            inputs: opening.publisher()?,
            commands: opening.publisher()?,
            commissioner: config.commissioner.clone(),
            commissions: None,
            complaints: 0,
        };
        if let Some(map) = kept {
            shell.publish_map(&map);
        }
        if config.resume {
            let now = shell.now();
            shell.conversation.lives_again(now);
        }
        Ok(shell)
    }

    fn turn(&mut self) {
        self.watchdog.leave();
        self.waiter.wait(self.longest_wait());
        self.watchdog.enter("a turn");
        let now = self.now();
        self.conversation.turn(now);
        self.act();
        // First the robot's state, so that lines meet the conversation as it is now.
        self.look(now);
        self.take_samples(now);
        self.take_answers();
        self.take_commission();
        self.take_lines(now);
        self.act();
        self.link.write();
    }

    /// How long to wait at most, in real time.
    fn longest_wait(&self) -> Duration {
        let due = self.conversation.due();
        let due = due.map(|due| self.clock.real(due.saturating_sub(self.clock.now())));
        let due_ns = self.conversation.due_ns();
        let soon = due_ns.map(|at| Duration::from_nanos(at.saturating_sub(Clock::monotonic_ns())));
        let waits = [due, soon].into_iter().flatten();
        waits.fold(LONGEST_WAIT, Duration::min)
    }

    fn now(&self) -> Moment {
        Moment {
            robot: self.clock.now(),
            ns: Clock::monotonic_ns(),
        }
    }

    /// Looks at what stands in the robot's folder: its services, and what people have ordered in a
    /// terminal.
    fn look(&mut self, now: Moment) {
        if now.ns < self.looks_ns {
            return;
        }
        self.looks_ns = now.ns + LOOK;
        for (at_ns, words) in self.home.asked(&self.robot, self.asked_ns) {
            self.asked_ns = at_ns;
            self.conversation.asked(at_ns, &words);
        }
        let services = self.home.watched(&self.robot);
        self.conversation.services(now, services);
    }

    fn take_samples(&mut self, now: Moment) {
        if let Some(health) = self.next(|shell| shell.health.latest()) {
            self.conversation.health(now, &health);
        }
        // Logic publishes queue and route before their status, so what is read after the status is
        // no older.
        let status = self.next(|shell| shell.status.latest());
        if let Some(queue) = self.next(|shell| shell.queue.latest()) {
            self.conversation.queue(now, &queue);
        }
        if let Some(route) = self.next(|shell| shell.route.latest()) {
            self.conversation.route(&route);
        }
        if let Some(status) = status {
            let published_ns = status.stamp().publish_time_ns;
            self.conversation.status(now, &status, published_ns);
        }
        while let Some(event) = self.next(|shell| shell.events.receive()) {
            let published_ns = event.stamp().publish_time_ns;
            self.conversation.event(now, &event, published_ns);
        }
        if let Some(report) = self.next(|shell| shell.reports.latest()) {
            self.conversation.report(now, &report);
        }
        while let Some(thought) = self.next(|shell| shell.thoughts.receive()) {
            self.conversation.thought(&thought);
        }
        if self.conversation.is_to_tell(now) {
            // Read this last, so that it is as new as possible.
            self.take_senses();
            if self.conversation.is_to_tell_health(now) {
                self.conversation.machine((self.machine)());
            }
            self.conversation.tell(now);
        }
    }

    /// Takes the samples that only a station with the extension is told; the last one of each topic
    /// is enough.
    fn take_senses(&mut self) {
        let truth = self.next(|shell| shell.truth.latest());
        let senses = Senses {
            line: self.next(|shell| shell.line.latest()).map(|line| *line),
            distance: self
                .next(|shell| shell.distance.latest())
                .map(|distance| *distance),
            blocks: (self.next(|shell| shell.blocks.latest())).map(|blocks| Box::new(*blocks)),
            latency: (self.next(|shell| shell.latency.latest()))
                .map(|latency| Box::new(latency.total)),
            truth: truth.map(|truth| Box::new(*truth)),
        };
        self.conversation.senses(senses);
    }

    /// Takes the answers to requests.
    fn take_answers(&mut self) {
        while let Some((id, answer)) = self.bridge.answer() {
            self.conversation.answered_by_bridge(id, answer);
        }
        while let Some((id, answer)) = self.world.answer() {
            self.conversation.answered_by_world(self.now(), id, &answer);
        }
    }

    /// Takes what the commissioning tells.
    fn take_commission(&mut self) {
        while let Some(news) = self.commissions.as_mut().and_then(|process| process.next()) {
            match news {
                commissioner::News::Told(report) => self.conversation.commission_told(report),
                commissioner::News::Over => {
                    if let Some(process) = self.commissions.take() {
                        process.reap();
                    }
                    self.conversation.commission_over(None);
                }
            }
        }
    }

    /// Says something to the commissioning, or begins one.
    fn commission(&mut self, given_ns: u64, said: Commission) {
        if let (Some(process), _) = (&mut self.commissions, said) {
            return process.tell(given_ns, said);
        }
        let flag = match said {
            Commission::Begin => None,
            Commission::Undo => Some("--undo"),
            Commission::Restart => Some("--restart"),
            // It has ended meanwhile.
            _ => return,
        };
        let started = match &self.commissioner {
            Some(wanted) => commissioner::Process::start(wanted, flag, self.waiter.ringer()),
            None => Err(std::io::ErrorKind::NotFound.into()),
        };
        match started {
            Ok(process) => self.commissions = Some(process),
            Err(error) => self
                .conversation
                .commission_over(Some(Reason::new(Code::Misread, &[&error]))),
        }
    }

    /// Takes what has come over the link. It passes on all lines at once, so that a stop among them
    /// goes first.
    fn take_lines(&mut self, now: Moment) {
        let mut lines = Vec::new();
        while let Some(news) = self.link.next() {
            match news {
                News::Lines(more) => lines.extend(more),
                News::Up(_) => {
                    lines.clear();
                    self.conversation.connected(now);
                }
                News::Down(why) => {
                    // Lines that came before the end are still carried out, most of all a stop.
                    self.conversation.heard(now, &lines);
                    lines.clear();
                    tracing::info!("the external computer is away: {why}");
                    self.conversation.disconnected(now);
                }
            }
        }
        if !lines.is_empty() {
            self.conversation.heard(now, &lines);
        }
    }

    fn act(&mut self) {
        for effect in self.conversation.effects() {
            match effect {
                Effect::Say(line) => match to_line(&line) {
                    Ok(line) => self.link.say(&line),
                    Err(error) => tracing::error!("more than {MAX_LINE} bytes: {error}"),
                },
                Effect::Show(report) => match (telling::kind(&report), to_line(&report)) {
                    (Some(kind), Ok(line)) => self.link.show(kind, line),
                    (None, Ok(line)) => self.link.say(&line),
                    (_, Err(error)) => tracing::error!("more than {MAX_LINE} bytes: {error}"),
                },
                Effect::Do(Act::Ask { id, ask }) => {
                    if !self.bridge.ask(id, ask) {
                        self.conversation.answered_by_bridge(id, Err(BUSY.into()));
                    }
                }
                Effect::Do(Act::AskWorld { id, ask }) => {
                    if !self.world.ask(id, ask) {
                        self.conversation
                            .answered_by_world(self.now(), id, &Err(BUSY.into()));
                    }
                }
                Effect::HangUp(why) => {
                    tracing::info!("the connection is given up: {why}");
                    self.link.hang_up();
                }
                Effect::Map(map) => self.publish_map(&map),
                Effect::Do(Act::Order(order)) => {
                    let sent = self.orders.send(Cause::OWN, order);
                    self.check(sent);
                }
                Effect::Do(Act::Press(input)) => {
                    let sent = self.inputs.send(Cause::OWN, input);
                    self.check(sent);
                }
                Effect::Steer(order) => {
                    let sent = self.commands.send(Cause::OWN, order);
                    self.check(sent);
                }
                Effect::Commission { given_ns, said } => self.commission(given_ns, said),
                Effect::Stop => {
                    if let Err(error) =
                        StopWord::set(&self.stop_word, Role::Comm, StopCause::Ordered)
                    {
                        tracing::error!("the robot may still be moving: {error}");
                    }
                }
            }
        }
    }

    fn publish_map(&self, map: &WarehouseMap) {
        if let Err(error) = self.map.send(Cause::OWN, *map) {
            tracing::error!("{error}");
        }
    }

    fn next<T: Topic>(
        &mut self,
        receive: impl FnOnce(&mut Self) -> Result<Option<Sample<T>>, ReceiveError>,
    ) -> Option<Sample<T>> {
        match receive(self) {
            Ok(sample) => sample,
            Err(error) => {
                self.complain(&error);
                None
            }
        }
    }

    fn check(&mut self, sent: Result<(), SendError>) {
        if let Err(error) = sent {
            self.complain(&error);
        }
    }

    /// Logs faults of the bus, but not the same one for ever.
    fn complain(&mut self, error: &dyn std::error::Error) {
        self.complaints = self.complaints.wrapping_add(1);
        if self.complaints.is_power_of_two() {
            tracing::error!(times = self.complaints, "{error}");
        }
    }
}
