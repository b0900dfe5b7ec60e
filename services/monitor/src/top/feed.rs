//! Connects `lager top` to the bus, or to a gateway: reads the topics that the model wants, and finds
//! out who writes and reads each.
//!
//! A row that is closed or filtered out has no subscription. Its writers and readers come from the
//! bus's own lists. The head needs six states of the robot, and the stop word.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use lager_ports::{NodeInfo, Place, ReceiveError, Source, TopicInfo, Watched, newest};
use lager_sample::{Stamp, Topic};
use lager_topics::{
    LatencyCommand, LatencyPath, LinkHealth, MissionQueue, NavStatus, SteeringState, TopicVisitor,
    visit,
};
use lager_wake::Watchdog;

use super::head::Load;
use super::model::Model;
use crate::ToolError;
use crate::life::Life;
use crate::origin::Origin;
use crate::source::Stamped;

/// How many samples of one topic are taken in one look.
const TURN: u64 = 1_024;

/// Reads a robot's topics.
pub(crate) struct Feed<'a, P: Origin> {
    place: &'a P,
    watchdog: &'a Watchdog,
    load: fn() -> Load,
    open: BTreeMap<String, Box<dyn Pull>>,
    /// Topics that could not be read at the last look, such as one with no place left.
    refused: BTreeSet<String>,
    watch: P::Watch,
    ends: Option<Ends>,
    health: Option<P::Typed<LinkHealth>>,
    status: Option<P::Typed<NavStatus>>,
    queue: Option<P::Typed<MissionQueue>>,
    report: Option<P::Typed<SteeringState>>,
    path: Option<P::Typed<LatencyPath>>,
    command: Option<P::Typed<LatencyCommand>>,
    /// The stamps' and the robot's time at the last look at them.
    clocked: Option<(u64, Duration)>,
}

impl<'a, P: Origin> Feed<'a, P> {
    /// Opens the states of the head.
    ///
    /// # Errors
    /// There are too many observers, or a process of another build.
    pub(crate) fn new(
        place: &'a P,
        watchdog: &'a Watchdog,
        load: fn() -> Load,
    ) -> Result<Self, ToolError> {
        let open = || -> Result<Self, P::OpenError> {
            Ok(Self {
                place,
                watchdog,
                load,
                open: BTreeMap::new(),
                refused: BTreeSet::new(),
                watch: place.watch(Watched::Ends),
                ends: None,
                health: place.typed()?,
                status: place.typed()?,
                queue: place.typed()?,
                report: place.typed()?,
                path: place.typed()?,
                command: place.typed()?,
                clocked: place.unit_time(),
            })
        };
        watchdog
            .over("opening the topics", open)
            .map_err(Into::into)
    }

    /// Finds out who writes and reads the topics, and reads those that the model wants.
    pub(crate) fn look(&mut self, model: &mut Model) -> Result<(), ToolError> {
        let place = self.place;
        let is_other = place.has_changed(&mut self.watch);
        let ends = self
            .ends
            .take()
            .filter(|ends| !is_other && ends.are_there(place));
        let ends = match ends {
            Some(ends) => ends,
            // On the bus this keeps a core busy for tens of milliseconds, which the robot's path
            // would feel.
            None => Ends::look(place, self.watchdog)?,
        };
        model.take_ends(&ends.topics, |pid| place.life(&ends.nodes, pid));
        model.head.failing = place.failing(&ends.nodes);
        self.ends = Some(ends);
        self.refused.clear();
        model.head.stop = place.stop();
        model.head.load = (self.load)();
        let now = place.unit_time();
        if let (Some((then_ns, then)), Some((now_ns, now))) = (self.clocked, now) {
            let real = now_ns.saturating_sub(then_ns) as f64 / 1e9;
            if real > 0.1 {
                model.head.pace = Some(now.saturating_sub(then).as_secs_f64() / real);
            }
        }
        self.clocked = now.or(self.clocked);
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
            let place = self.place;
            let open = || match visit(&name, Open { place }) {
                Ok(Ok(Some(opened))) => Ok(Some(opened)),
                Ok(Err(error)) => Err(error),
                Ok(Ok(None)) | Err(_) => {
                    let found = place.described(&name)?;
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
        let now_ns = self.place.time().now_ns;
        for (name, pull) in &mut self.open {
            pull.pull(name, model, now_ns)?;
        }
        let head = &mut model.head;
        if let Some((stamp, health)) = last::<LinkHealth>(&mut self.health)? {
            head.take_health(health, stamp.publish_time_ns);
        }
        if let Some((_, status)) = last::<NavStatus>(&mut self.status)? {
            head.status = Some(status);
        }
        if let Some((_, queue)) = last::<MissionQueue>(&mut self.queue)? {
            head.queue = Some(queue);
        }
        if let Some((_, report)) = last::<SteeringState>(&mut self.report)? {
            let robot = self
                .place
                .unit_time()
                .map_or(Duration::ZERO, |(_, now)| now);
            head.battery.read(robot, report.battery_decivolts);
            head.battery_decivolts = report.battery_decivolts;
        }
        if let Some((_, path)) = last::<LatencyPath>(&mut self.path)? {
            head.path.take(path);
        }
        if let Some((_, command)) = last::<LatencyCommand>(&mut self.command)? {
            head.command.take(command);
        }
        Ok(())
    }
}

/// The newest sample of a state that can be read, with its stamp.
fn last<T: Topic>(
    from: &mut Option<impl Source>,
) -> Result<Option<(Stamp, T::Payload)>, ReceiveError> {
    match from {
        Some(from) => newest::<T>(from),
        None => Ok(None),
    }
}

/// A topic that is read.
trait Pull {
    fn pull(&mut self, name: &str, model: &mut Model, now_ns: u64) -> Result<(), ReceiveError>;
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
    fn pull(&mut self, name: &str, model: &mut Model, now_ns: u64) -> Result<(), ReceiveError> {
        let mut found = 0;
        while found < TURN
            && let Some(stamp) = self.from.next(Stamped)?
        {
            model.hear(name, &stamp);
            found += 1;
        }
        // A loss over a link is taken back if the sample comes late.
        let lost = self.from.lost().saturating_sub(self.lost);
        self.lost = self.from.lost();
        if found > 0 || lost > 0 {
            let seen = (found, self.from.queue());
            model.row(name).look(seen, lost, now_ns);
        }
        Ok(())
    }
}

struct Open<'a, P> {
    place: &'a P,
}

impl<P: Place> TopicVisitor for Open<'_, P> {
    type Output = Result<Option<Box<dyn Pull>>, P::OpenError>;

    fn visit<T: Topic>(self) -> Self::Output {
        let opened = self.place.typed::<T>()?;
        Ok(opened.map(|from| Box::new(Pulled::new(from)) as Box<dyn Pull>))
    }
}

/// The programs that write and read the topics, at one moment.
struct Ends {
    topics: Vec<TopicInfo>,
    nodes: Vec<NodeInfo>,
}

impl Ends {
    fn look<P: Origin>(place: &P, watchdog: &Watchdog) -> Result<Self, ToolError> {
        let topics = watchdog.over("looking at the topics", || place.every_topic());
        Ok(Self {
            topics: topics.map_err(Into::into)?,
            nodes: watchdog.over("looking at the processes", || place.processes())?,
        })
    }

    /// Whether all writers of that moment still live. A killed one keeps its ports until somebody
    /// sweeps the bus.
    fn are_there(&self, place: &impl Origin) -> bool {
        let mut writers = self.topics.iter().flat_map(|topic| &topic.writers);
        writers.all(|writer| writer.pid == 0 || place.life(&[], writer.pid) != Life::Dead)
    }
}
