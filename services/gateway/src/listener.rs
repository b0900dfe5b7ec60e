//! The thread that polls the bus.

use std::any::Any;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use lager_home::{BusWatch, Clock};
use lager_journal::{Envelope, EnvelopeSchema};
use lager_ports::{
    Bus, Found, IntrospectError, Layout, PortError, ReceiveError, Source, Subscriber, TopicInfo,
};
use lager_remote::Kind;
use lager_sample::{Description, Stamp, Topic, bytes_of};
use lager_topics::{TOPICS, TopicVisitor, visit};
use lager_wake::{Pace, Shutdown, Watchdog};
use serde::Serialize;

use crate::figures::Figures;
use crate::{GatewayError, Shared};

/// How often it looks for new topics.
const LOOK: Duration = Duration::from_secs(1);
/// How many samples of one topic it takes before the next topic has its turn.
const TURN: u64 = 1_024;

/// A part that gets every sample at once, in the form of a recording.
pub(crate) trait Viewer {
    /// The listener reads a topic from now on. If it carries a state, its last sample stays true.
    fn open(&mut self, topic: &str, schema: &EnvelopeSchema, is_state: bool);

    /// Whether the next sample of a topic need be written at all.
    fn wants(&self, topic: &str) -> bool;

    /// Takes a message.
    fn take(&mut self, topic: &str, stamp: &Stamp, message: &[u8]);
}

/// A part that gets every sample at once, as it lies in memory.
pub(crate) trait Outlet {
    /// The listener reads a topic from now on.
    fn open(&mut self, topic: &str, description: &Description, kind: Kind);

    /// Learns who writes and reads the topics.
    fn look_at_ends(&mut self, topics: &[TopicInfo]);

    /// Takes a sample. The bus has lost `lost` samples of the topic so far.
    fn take(&mut self, topic: &str, stamp: &Stamp, lost: u64, payload: &[u8]);

    /// Has its turn after each look at the bus.
    fn tick(&mut self);
}

/// Those who get each sample, if there are any.
#[derive(Default)]
pub(crate) struct Shown {
    /// Viewers of messages.
    pub(crate) viewer: Option<Box<dyn Viewer>>,
    /// Listeners on other computers.
    pub(crate) outlet: Option<Box<dyn Outlet>>,
}

/// Reads every topic until a request to end, or until `is_over`.
pub(crate) fn listen(
    bus: &Bus,
    watchdog: &Watchdog,
    shutdown: &Shutdown,
    shared: &Shared,
    shown: Shown,
    is_over: impl Fn() -> bool,
) -> Result<(), GatewayError> {
    let Shown { viewer, outlet } = shown;
    let mut pace = match viewer.is_some() || outlet.is_some() {
        true => Pace::keeping(),
        // Its own figures are made from stamps.
        false => Pace::counting(),
    };
    let mut listener = Listener {
        bus,
        watchdog,
        clock: bus.clock(),
        viewer,
        outlet,
        feeds: Vec::new(),
        opened: BTreeSet::new(),
        refused: BTreeSet::new(),
        services: BusWatch::of_services(),
        ports: BusWatch::of_ports(),
    };
    let mut looked: Option<Instant> = None;
    let mut is_short = false;
    while !shutdown.is_requested() && !is_over() {
        if looked.is_none_or(|looked| looked.elapsed() >= LOOK) {
            looked = Some(Instant::now());
            if !bus.is_listed() {
                return Err(GatewayError::Cleared);
            }
            match listener.look(shared) {
                // What is open goes on, and it is looked again in a moment.
                Err(GatewayError::Look(error @ IntrospectError::Short(_))) => {
                    if !std::mem::replace(&mut is_short, true) {
                        tracing::warn!("{error}; topics that come are not seen until then");
                    }
                }
                looked => {
                    looked?;
                    is_short = false;
                }
            }
        }
        listener.drain(shared, &mut pace)?;
        if let Some(outlet) = &mut listener.outlet {
            outlet.tick();
        }
        std::thread::sleep(pace.wait());
    }
    Ok(())
}

/// Everything that is listened to.
struct Listener<'a> {
    bus: &'a Bus,
    watchdog: &'a Watchdog,
    clock: Clock,
    viewer: Option<Box<dyn Viewer>>,
    outlet: Option<Box<dyn Outlet>>,
    feeds: Vec<Box<dyn Feed>>,
    opened: BTreeSet<String>,
    /// Topics that could not be opened and were reported.
    refused: BTreeSet<String>,
    services: BusWatch,
    ports: BusWatch,
}

/// A topic that is listened to.
trait Feed {
    /// The layout of its samples, and what it carries.
    fn about(&self) -> (Description, Kind);

    /// Takes the new samples. Returns how full the topic's queue was.
    fn drain(&mut self, to: &mut Takers<'_>, pace: &mut Pace) -> Result<(), ReceiveError>;
}

/// The receivers of each sample.
struct Takers<'a> {
    figures: &'a mut Figures,
    real: &'a dyn Fn(Duration) -> Duration,
    viewer: Option<&'a mut (dyn Viewer + 'static)>,
    outlet: Option<&'a mut (dyn Outlet + 'static)>,
}

impl Takers<'_> {
    /// Of any topic.
    fn count<P: Serialize>(
        &mut self,
        topic: &str,
        stamp: &Stamp,
        lost: u64,
        (payload, bytes): (&P, &[u8]),
    ) {
        self.figures.count(topic, stamp, lost);
        if let Some(outlet) = &mut self.outlet {
            outlet.take(topic, stamp, lost, bytes);
        }
        let Some(viewer) = self.viewer.as_mut().filter(|viewer| viewer.wants(topic)) else {
            return;
        };
        let envelope = Envelope {
            stamp: *stamp,
            lost,
            dropped: 0,
            payload,
        };
        let message = serde_json::to_vec(&envelope).expect("a payload is JSON");
        viewer.take(topic, stamp, &message);
    }
}

impl Listener<'_> {
    /// Opens new topics, of the table and of other programs, and updates the writers and readers of
    /// all topics where ports have come or gone. Tries a topic again that could not be opened.
    fn look(&mut self, shared: &Shared) -> Result<(), GatewayError> {
        for entry in TOPICS {
            if !self.opened.contains(entry.name) {
                let open = || visit(entry.name, Open { bus: self.bus });
                let opened = self.watchdog.over("opening the topic", open);
                self.keep(entry.name, opened.expect("a topic of the table").map(Some));
            }
        }
        // Both, so that each knows what is there now.
        let place = self.bus.home();
        if !(self.services.has_changed(place) | self.ports.has_changed(place)) {
            return Ok(());
        }
        let look = || self.bus.topics();
        let mut topics = self.watchdog.over("listing the topics", look)?;
        topics.retain(|topic| topic.unit == *self.bus.unit());
        for topic in &topics {
            let is_new = topic.entry.is_none() && !self.opened.contains(&topic.name);
            if is_new && topic.layout == Layout::Described {
                let open = || self.bus.found(&topic.name);
                let opened = self.watchdog.over("opening the topic", open);
                let opened =
                    opened.map(|found| found.map(|found| Box::new(found) as Box<dyn Feed>));
                self.keep(&topic.name, opened);
            }
        }
        shared.figures().look_at_ends(&topics);
        if let Some(outlet) = &mut self.outlet {
            outlet.look_at_ends(&topics);
        }
        Ok(())
    }

    fn keep(&mut self, name: &str, opened: Result<Option<Box<dyn Feed>>, PortError>) {
        match opened {
            Ok(Some(feed)) => {
                self.opened.insert(name.to_owned());
                let (description, kind) = feed.about();
                if let Some(viewer) = &mut self.viewer {
                    let schema = EnvelopeSchema::of(&description);
                    viewer.open(name, &schema, kind == Kind::State);
                }
                if let Some(outlet) = &mut self.outlet {
                    outlet.open(name, &description, kind);
                }
                self.feeds.push(feed);
            }
            // It went while it was looked at, and may come back.
            Ok(None) => {}
            Err(error) => {
                if self.refused.insert(name.to_owned()) {
                    tracing::warn!("{name} is not read: {error}");
                }
            }
        }
    }

    fn drain(&mut self, shared: &Shared, pace: &mut Pace) -> Result<(), GatewayError> {
        self.watchdog.enter("reading the topics");
        let mut figures = shared.figures();
        let mut to = Takers {
            figures: &mut figures,
            real: &|robot| self.clock.real(robot),
            viewer: self.viewer.as_deref_mut(),
            outlet: self.outlet.as_deref_mut(),
        };
        let mut feeds = self.feeds.iter_mut();
        let drained = feeds.try_for_each(|feed| feed.drain(&mut to, pace));
        self.watchdog.leave();
        Ok(drained?)
    }
}

struct Open<'a> {
    bus: &'a Bus,
}

impl TopicVisitor for Open<'_> {
    type Output = Result<Box<dyn Feed>, PortError>;

    fn visit<T: Topic>(self) -> Self::Output {
        Ok(Box::new(self.bus.subscriber::<T>()?))
    }
}

impl<T: Topic> Feed for Subscriber<T> {
    fn about(&self) -> (Description, Kind) {
        let entry = TOPICS.iter().find(|entry| entry.name == T::NAME);
        let kind = match entry.and_then(|entry| entry.period_ms) {
            _ if self.holds() => Kind::State,
            Some(_) => Kind::Stream,
            None => Kind::Event,
        };
        (Description::of::<T::Payload>(), kind)
    }

    fn drain(&mut self, to: &mut Takers<'_>, pace: &mut Pace) -> Result<(), ReceiveError> {
        let mut found = 0;
        while found < TURN {
            let Some(sample) = self.receive()? else {
                break;
            };
            found += 1;
            let payload: &T::Payload = &sample;
            let lost = Subscriber::lost(self);
            to.count(T::NAME, sample.stamp(), lost, (payload, bytes_of(payload)));
            let real = to.real;
            to.figures.learn(sample.stamp(), payload as &dyn Any, real);
        }
        pace.found(found, self.queue());
        Ok(())
    }
}

impl Feed for Found {
    fn about(&self) -> (Description, Kind) {
        let kind = match self.holds() {
            true => Kind::State,
            // Its period is not known.
            false => Kind::Stream,
        };
        (self.description().clone(), kind)
    }

    fn drain(&mut self, to: &mut Takers<'_>, pace: &mut Pace) -> Result<(), ReceiveError> {
        let name = self.name().to_owned();
        let mut found = 0;
        while found < TURN {
            let Some((sample, lost)) = self.receive_counted()? else {
                break;
            };
            found += 1;
            let payload = sample.payload();
            to.count(&name, sample.stamp(), lost, (&payload, payload.bytes()));
        }
        pace.found(found, self.queue());
        Ok(())
    }
}
