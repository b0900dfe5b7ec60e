//! The thread that reads the bus, or what a robot's gateway elsewhere has sent. A sample of the bus
//! wakes it if somebody gets each sample; for figures alone it looks now and then.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use lager_journal::{Envelope, EnvelopeSchema};
use lager_ports::{
    IntrospectError, Layout, Look, Place, PlaceError, Raw, ReceiveError, Source, TopicInfo,
    Watched, Watcher,
};
use lager_remote::Kind;
use lager_sample::{Description, Stamp, Topic};
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

    /// Takes a message that was published at that time, in ns since 1970.
    fn take(&mut self, topic: &str, unix_ns: u64, message: &[u8]);
}

/// A part that gets every sample at once, as it lies in memory.
pub(crate) trait Outlet {
    /// The listener reads a topic from now on.
    fn open(&mut self, topic: &str, description: &Description, kind: Kind);

    /// Learns who writes and reads the topics.
    fn look_at_ends(&mut self, topics: &[TopicInfo]);

    /// Takes a sample. The bus has lost `lost` samples of the topic so far.
    fn take(&mut self, topic: &str, stamp: &Stamp, lost: u64, payload: &[u8]);

    /// Has its turn after each look at the bus; `robot` is the robot's own time.
    fn tick(&mut self, robot: Duration);
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
pub(crate) fn listen<P: Place>(
    place: &P,
    watchdog: &Watchdog,
    shutdown: &Shutdown,
    shared: &Shared,
    shown: Shown,
    is_over: impl Fn() -> bool,
) -> Result<(), GatewayError> {
    let Shown { viewer, outlet } = shown;
    let (mut pace, watcher) = match viewer.is_some() || outlet.is_some() {
        true => (Pace::keeping(), watcher(place, watchdog)),
        // Its own figures are made from stamps.
        false => (Pace::counting(), None),
    };
    let mut listener = Listener {
        place,
        watchdog,
        watcher,
        viewer,
        outlet,
        feeds: Vec::new(),
        opened: BTreeSet::new(),
        refused: BTreeSet::new(),
        watch: place.watch(Watched::Ends),
    };
    let mut looked: Option<Instant> = None;
    let mut is_short = false;
    while !shutdown.is_requested() && !is_over() {
        if looked.is_none_or(|looked| looked.elapsed() >= LOOK) {
            looked = Some(Instant::now());
            if !place.may_still_tell() {
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
            let robot = place.unit_time();
            outlet.tick(robot.map_or(Duration::ZERO, |(_, robot)| robot));
        }
        Watcher::pause(listener.watcher.as_mut(), &mut pace);
    }
    Ok(())
}

/// A watcher of this thread. Without one the thread looks now and then.
fn watcher<P: Place>(place: &P, watchdog: &Watchdog) -> Option<Watcher> {
    let made = watchdog.over("asking to be woken", || place.watcher());
    made.unwrap_or_else(|error| {
        tracing::warn!("samples do not wake this gateway, so they go out some ms later: {error}");
        None
    })
}

/// Everything that is listened to.
struct Listener<'a, P: Place> {
    place: &'a P,
    watchdog: &'a Watchdog,
    watcher: Option<Watcher>,
    viewer: Option<Box<dyn Viewer>>,
    outlet: Option<Box<dyn Outlet>>,
    feeds: Vec<Box<dyn Feed>>,
    opened: BTreeSet<String>,
    /// Topics that could not be opened and were reported.
    refused: BTreeSet<String>,
    watch: P::Watch,
}

/// A topic that is listened to.
trait Feed {
    /// The layout of its samples, and what it carries.
    fn about(&self) -> (Description, Kind);

    /// Lets its samples wake the thread of `watcher`.
    fn wakes(&self, watcher: &mut Watcher);

    /// Takes the new samples. Returns how full the topic's queue was.
    fn drain(&mut self, to: &mut Takers<'_, '_>, pace: &mut Pace) -> Result<(), ReceiveError>;
}

/// The receivers of each sample.
struct Takers<'a, 'b> {
    figures: &'a mut Figures,
    real: &'a dyn Fn(Duration) -> Duration,
    viewer: Option<&'a mut (dyn Viewer + 'b)>,
    outlet: Option<&'a mut (dyn Outlet + 'b)>,
}

/// Gives a sample of this topic to all of them.
struct Give<'a, 'b, 'c> {
    topic: &'a str,
    to: &'a mut Takers<'b, 'c>,
}

impl Look for Give<'_, '_, '_> {
    type Output = ();

    fn look<P: Serialize>(self, stamp: &Stamp, lost: u64, payload: &P) {
        let (topic, to) = (self.topic, self.to);
        let Some(viewer) = to.viewer.as_mut().filter(|viewer| viewer.wants(topic)) else {
            return;
        };
        let envelope = Envelope {
            stamp: *stamp,
            lost,
            dropped: 0,
            payload,
        };
        let message = serde_json::to_vec(&envelope).expect("a payload is JSON");
        let offset_ns = to.figures.unix_offset_ns;
        let unix_ns = stamp.publish_time_ns.saturating_add_signed(offset_ns);
        viewer.take(topic, unix_ns, &message);
    }

    fn look_at<P: Serialize>(self, stamp: &Stamp, lost: u64, payload: &P, raw: Raw<'_>) {
        let (topic, to) = (self.topic, &mut *self.to);
        to.figures.count(topic, stamp, lost);
        if let Some(typed) = raw.typed {
            to.figures.learn(stamp, typed, to.real);
        }
        if let Some(outlet) = &mut to.outlet {
            outlet.take(topic, stamp, lost, raw.bytes);
        }
        self.look(stamp, lost, payload);
    }
}

impl<P: Place> Listener<'_, P> {
    /// Opens new topics, of the table and of other programs, and updates the writers and readers of
    /// all topics where ports have come or gone. Tries a topic again that could not be opened.
    fn look(&mut self, shared: &Shared) -> Result<(), GatewayError> {
        let place = self.place;
        for entry in TOPICS {
            if !self.opened.contains(entry.name) {
                let open = || visit(entry.name, Open { place });
                let opened = self.watchdog.over("opening the topic", open);
                self.keep(entry.name, opened.expect("a topic of the table"));
            }
        }
        shared.figures().unix_offset_ns = place.time().unix_offset_ns;
        if !place.has_changed(&mut self.watch) {
            return Ok(());
        }
        let look = || place.every_topic();
        let topics = self.watchdog.over("listing the topics", look);
        let topics = topics.map_err(PlaceError::of)?;
        for topic in &topics {
            let is_new = topic.entry.is_none() && !self.opened.contains(&topic.name);
            if is_new && topic.layout == Layout::Described {
                let open = || place.described(&topic.name);
                let opened = self.watchdog.over("opening the topic", open);
                let feed = |from| Box::new(FeedOf::new(&topic.name, from)) as Box<dyn Feed>;
                self.keep(&topic.name, opened.map(|found| found.map(feed)));
            }
        }
        shared.figures().look_at_ends(&topics, place.is_here());
        if let Some(outlet) = &mut self.outlet {
            outlet.look_at_ends(&topics);
        }
        Ok(())
    }

    fn keep(&mut self, name: &str, opened: Result<Option<Box<dyn Feed>>, P::OpenError>) {
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
                if let Some(watcher) = &mut self.watcher {
                    feed.wakes(watcher);
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
            real: &|robot| self.place.real(robot),
            viewer: self.viewer.as_deref_mut(),
            outlet: self.outlet.as_deref_mut(),
        };
        let mut feeds = self.feeds.iter_mut();
        let drained = feeds.try_for_each(|feed| feed.drain(&mut to, pace));
        self.watchdog.leave();
        Ok(drained?)
    }
}

struct Open<'a, P> {
    place: &'a P,
}

impl<P: Place> TopicVisitor for Open<'_, P> {
    type Output = Result<Option<Box<dyn Feed>>, P::OpenError>;

    fn visit<T: Topic>(self) -> Self::Output {
        let from = self.place.typed::<T>()?;
        Ok(from.map(|from| Box::new(FeedOf::new(T::NAME, from)) as Box<dyn Feed>))
    }
}

struct FeedOf<S> {
    name: String,
    from: S,
}

impl<S> FeedOf<S> {
    fn new(name: &str, from: S) -> Self {
        let name = name.to_owned();
        Self { name, from }
    }
}

impl<S: Source> Feed for FeedOf<S> {
    fn about(&self) -> (Description, Kind) {
        let entry = TOPICS.iter().find(|entry| entry.name == self.name);
        let kind = match entry {
            _ if self.from.holds() => Kind::State,
            Some(entry) if entry.period_ms.is_none() => Kind::Event,
            // Of a topic of another program the period is not known.
            _ => Kind::Stream,
        };
        (self.from.description(), kind)
    }

    fn wakes(&self, watcher: &mut Watcher) {
        self.from.wakes(watcher);
    }

    fn drain(&mut self, to: &mut Takers<'_, '_>, pace: &mut Pace) -> Result<(), ReceiveError> {
        let mut found = 0;
        while found < TURN {
            let topic = &self.name;
            if self.from.next(Give { topic, to })?.is_none() {
                break;
            }
            found += 1;
        }
        pace.found(found, self.from.queue());
        Ok(())
    }
}
