//! Connects `lager top` to the bus: reads the topics that the model wants, and finds out who writes
//! and reads each.
//!
//! A row that is closed or filtered out has no subscription. Its writers and readers come from the
//! bus's own lists. The head needs five states of the robot, and the stop word.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

use lager_home::{BusWatch, Clock};
use lager_ports::{
    Bus, NodeInfo, NodeState, PortError, ReceiveError, Source, Subscriber, TopicInfo,
};
use lager_sample::Topic;
use lager_stop::{StopPage, StopWord};
use lager_topics::{
    LatencyCommand, LatencyPath, LinkHealth, MissionQueue, NavStatus, SteeringState, TopicVisitor,
    visit,
};
use lager_wake::Watchdog;

use super::head::{Failing, Load};
use super::model::Model;
use super::row::Life;
use crate::ToolError;
use crate::source::Stamped;

/// How many samples of one topic are taken in one look.
const TURN: u64 = 1_024;

/// The services that write a sign of life, because nothing on the bus shows that they live.
const SIGNING: [&str; 3] = ["comm", "station", "gateway"];

/// Reads a robot's bus.
pub(crate) struct Feed<'a> {
    bus: &'a Bus,
    watchdog: &'a Watchdog,
    load: fn() -> Load,
    open: BTreeMap<String, Box<dyn Pull>>,
    /// Topics that could not be read at the last look, such as one with no place left.
    refused: BTreeSet<String>,
    services: BusWatch,
    ports: BusWatch,
    ends: Option<Ends>,
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
    queue: Subscriber<MissionQueue>,
    report: Subscriber<SteeringState>,
    path: Subscriber<LatencyPath>,
    command: Subscriber<LatencyCommand>,
    /// Real and robot time at the last look at the clock.
    clock: Clock,
    clocked: (Instant, Duration),
}

impl<'a> Feed<'a> {
    /// Opens the five states of the head.
    ///
    /// # Errors
    /// There are too many observers, or a process of another build.
    pub(crate) fn new(
        bus: &'a Bus,
        watchdog: &'a Watchdog,
        load: fn() -> Load,
    ) -> Result<Self, ToolError> {
        let open = || -> Result<Self, PortError> {
            let clock = bus.clock();
            Ok(Self {
                bus,
                watchdog,
                load,
                open: BTreeMap::new(),
                refused: BTreeSet::new(),
                services: BusWatch::of_services(),
                ports: BusWatch::of_ports(),
                ends: None,
                health: bus.subscriber()?,
                status: bus.subscriber()?,
                queue: bus.subscriber()?,
                report: bus.subscriber()?,
                path: bus.subscriber()?,
                command: bus.subscriber()?,
                clocked: (Instant::now(), clock.now()),
                clock,
            })
        };
        Ok(watchdog.over("opening the topics", open)?)
    }

    /// Finds out who writes and reads the topics, and reads those that the model wants.
    pub(crate) fn look(&mut self, model: &mut Model) -> Result<(), ToolError> {
        let bus = self.bus;
        // Update both, so that each is of this moment.
        let is_other = self.services.has_changed(bus.home()) | self.ports.has_changed(bus.home());
        let ends = match self.ends.take().filter(Ends::writers_are_there) {
            Some(ends) if !is_other => ends,
            // This keeps a core busy for tens of milliseconds, which the robot's path would feel.
            _ => Ends::look(bus, self.watchdog)?,
        };
        model.take_ends(&ends.topics, |pid| ends.life(pid));
        model.head.failing = failing(bus, &ends.nodes);
        self.ends = Some(ends);
        self.refused.clear();
        let word = bus.home().unit(bus.unit()).join(StopPage::FILE);
        let told = StopWord::read(&word).ok().flatten();
        model.head.stop = told.and_then(|told| told.stop());
        model.head.load = (self.load)();
        let (then, robot_then) = self.clocked;
        self.clocked = (Instant::now(), self.clock.now());
        let real = (self.clocked.0 - then).as_secs_f64();
        if real > 0.1 {
            let robot = self.clocked.1.saturating_sub(robot_then);
            model.head.pace = Some(robot.as_secs_f64() / real);
        }
        self.follow(model)
    }

    /// Opens the topics that the model wants, and closes the others.
    pub(crate) fn follow(&mut self, model: &mut Model) -> Result<(), ToolError> {
        let wanted: BTreeSet<String> = model.wanted().map(str::to_owned).collect();
        self.open.retain(|name, _| {
            let stays = wanted.contains(name);
            if !stays {
                model.row(name).rest();
            }
            stays
        });
        for name in wanted {
            if self.open.contains_key(&name) || self.refused.contains(&name) {
                continue;
            }
            let open = || match visit(&name, Open { bus: self.bus }) {
                Ok(opened) => opened.map(Some),
                Err(_) => {
                    let found = self.bus.found(&name)?;
                    Ok(found.map(|found| Box::new(Pulled::new(found)) as Box<dyn Pull>))
                }
            };
            match self.watchdog.over("opening the topic", open) {
                Ok(Some(pull)) => drop(self.open.insert(name, pull)),
                Ok(None) => {}
                Err(error) => {
                    model.row(&name).unread = Some(error.to_string());
                    self.refused.insert(name);
                }
            }
        }
        Ok(())
    }

    /// Takes the new samples.
    pub(crate) fn drain(&mut self, model: &mut Model) -> Result<(), ToolError> {
        self.watchdog.enter("reading the topics");
        let drained = self.drain_all(model);
        self.watchdog.leave();
        Ok(drained?)
    }

    fn drain_all(&mut self, model: &mut Model) -> Result<(), ReceiveError> {
        for (name, pull) in &mut self.open {
            pull.pull(name, model)?;
        }
        if let Some(health) = self.health.latest()? {
            let at_ns = health.stamp().publish_time_ns;
            model.head.take_health(*health, at_ns);
        }
        if let Some(status) = self.status.latest()? {
            model.head.status = Some(*status);
        }
        if let Some(queue) = self.queue.latest()? {
            model.head.queue = Some(*queue);
        }
        if let Some(report) = self.report.latest()? {
            let head = &mut model.head;
            head.battery
                .read(self.clock.now(), report.battery_decivolts);
            head.battery_decivolts = report.battery_decivolts;
        }
        if let Some(path) = self.path.latest()? {
            model.head.path.take(*path);
        }
        if let Some(command) = self.command.latest()? {
            model.head.command.take(*command);
        }
        Ok(())
    }
}

/// A topic that is read.
trait Pull {
    fn pull(&mut self, name: &str, model: &mut Model) -> Result<(), ReceiveError>;
}

struct Pulled<S> {
    from: S,
    lost: u64,
}

impl<S> Pulled<S> {
    fn new(from: S) -> Self {
        Self { from, lost: 0 }
    }
}

impl<S: Source> Pull for Pulled<S> {
    fn pull(&mut self, name: &str, model: &mut Model) -> Result<(), ReceiveError> {
        let mut found = 0;
        while found < TURN
            && let Some(stamp) = self.from.next(Stamped)?
        {
            model.hear(name, &stamp);
            found += 1;
        }
        let lost = self.from.lost() - self.lost;
        self.lost = self.from.lost();
        if found > 0 || lost > 0 {
            let seen = (found, self.from.queue());
            model.row(name).look(seen, lost, Clock::monotonic_ns());
        }
        Ok(())
    }
}

struct Open<'a> {
    bus: &'a Bus,
}

impl TopicVisitor for Open<'_> {
    type Output = Result<Box<dyn Pull>, PortError>;

    fn visit<T: Topic>(self) -> Self::Output {
        Ok(Box::new(Pulled::new(self.bus.subscriber::<T>()?)))
    }
}

/// The programs that write and read the topics, at one moment.
struct Ends {
    topics: Vec<TopicInfo>,
    nodes: Vec<NodeInfo>,
}

impl Ends {
    fn look(bus: &Bus, watchdog: &Watchdog) -> Result<Self, ToolError> {
        let mut topics = watchdog.over("looking at the topics", || bus.topics())?;
        topics.retain(|topic| topic.unit == *bus.unit());
        Ok(Self {
            topics,
            nodes: watchdog.over("looking at the processes", || bus.nodes())?,
        })
    }

    /// Whether all writers of that moment still live. A killed one keeps its ports until somebody
    /// sweeps the bus.
    fn writers_are_there(&self) -> bool {
        let mut writers = self.topics.iter().flat_map(|topic| &topic.writers);
        let is_there = |pid: u32| pid == 0 || Path::new("/proc").join(pid.to_string()).exists();
        writers.all(|writer| is_there(writer.pid))
    }

    fn life(&self, pid: u32) -> Life {
        let node = self.nodes.iter().find(|node| node.pid == pid);
        match node.map(|node| node.state) {
            Some(NodeState::Stale) => Life::Dead,
            _ => life(pid),
        }
    }
}

/// The processes of the robot and of its tools that stand still.
fn failing(bus: &Bus, nodes: &[NodeInfo]) -> Vec<Failing> {
    let (place, robot) = (bus.home(), bus.unit());
    let mut found: Vec<Failing> = Vec::new();
    let mut add = |who: &str, pid: u32, silent: Option<Duration>| {
        if found.iter().all(|failing| failing.pid != pid) {
            let who = who.to_owned();
            found.push(Failing { who, pid, silent });
        }
    };
    let holders = place.up().remove(robot).unwrap_or_default();
    for holder in holders.iter().filter(|holder| holder.frozen) {
        add(&holder.what, holder.pid, None);
    }
    let now_ns = Clock::monotonic_ns();
    for who in SIGNING {
        let Some(sign) = place.sign_of(robot, who) else {
            continue;
        };
        match life(sign.pid) {
            Life::Frozen => add(who, sign.pid, None),
            Life::Alive if sign.is_old(now_ns) => {
                let silent = Duration::from_nanos(now_ns.saturating_sub(sign.at_ns));
                add(who, sign.pid, Some(silent));
            }
            _ => {}
        }
    }
    for node in nodes {
        if node.unit.as_ref() == Some(robot)
            && let Some(part) = &node.part
            && life(node.pid) == Life::Frozen
        {
            add(part, node.pid, None);
        }
    }
    found
}

/// Whether a process runs, as the kernel says.
fn life(pid: u32) -> Life {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // The state follows the name, which is in parentheses and may contain anything.
    let state = stat
        .rsplit(") ")
        .next()
        .and_then(|rest| rest.chars().next());
    match state {
        Some('T' | 't') => Life::Frozen,
        Some('Z' | 'X') | None => Life::Dead,
        _ => Life::Alive,
    }
}
