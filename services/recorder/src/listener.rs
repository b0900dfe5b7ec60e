//! The thread that polls the bus: it turns samples into JSON and queues them for the keeper.

use std::collections::BTreeSet;
use std::sync::Arc;

use lager_home::{BusWatch, Clock};
use lager_journal::{Envelope, EnvelopeSchema, Times};
use lager_ports::{Bus, Layout, Look, PortError, ReceiveError, Source};
use lager_sample::{Description, Stamp, Topic as TableTopic};
use lager_topics::{TOPICS, TopicVisitor, visit};
use lager_wake::{Pace, Watchdog};
use serde::Serialize;

use crate::error::RecordError;
use crate::tally::{Item, QueueIn, Topic, Topics};

/// How many samples of one topic it takes before the next topic has its turn.
const TURN: u64 = 1_024;

/// All topics that it listens to.
pub(crate) struct Listener<'a> {
    pub(crate) bus: &'a Bus,
    pub(crate) watchdog: &'a Watchdog,
    pub(crate) topics: Topics,
    /// The topics that the user wants; empty for all.
    pub(crate) wanted: &'a [String],
    pub(crate) times: Timing,
    pub(crate) queue: QueueIn,
    pub(crate) feeds: Vec<Box<dyn Feed>>,
    /// The topics that it listens to, or has found unreadable.
    pub(crate) known: BTreeSet<String>,
    pub(crate) services: BusWatch,
}

/// Turns the times of stamps into times of the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timing {
    /// The difference between ns since 1970 and a stamp's time.
    pub(crate) offset_ns: i64,
    /// When the recording began, by the stamps' clock.
    pub(crate) began_ns: u64,
}

impl Timing {
    fn of(self, stamp: &Stamp) -> Times {
        let now = Clock::monotonic_ns().max(self.began_ns);
        let log = stamp.publish_time_ns.clamp(self.began_ns, now);
        Times {
            log: log.saturating_add_signed(self.offset_ns),
            publish: stamp.publish_time_ns.saturating_add_signed(self.offset_ns),
        }
    }
}

/// A topic that it listens to.
pub(crate) trait Feed {
    /// Queues the new samples, and says how full the topic's queue was.
    fn drain(&mut self, queue: &QueueIn, pace: &mut Pace) -> Result<(), RecordError>;
}

impl Listener<'_> {
    fn wants(&self, name: &str) -> bool {
        self.wanted.is_empty() || self.wanted.iter().any(|wanted| wanted == name)
    }

    /// Opens the topics of the table, also those that nobody writes yet. Returns why some of them
    /// cannot be recorded. For a topic that the user has named this is an error.
    pub(crate) fn open_table(&mut self) -> Result<Vec<String>, RecordError> {
        // One limit for all: each could wait for a bus that does not answer.
        let watchdog = self.watchdog;
        watchdog.over("opening the topics", || self.open_each())
    }

    fn open_each(&mut self) -> Result<Vec<String>, RecordError> {
        let mut refused = Vec::new();
        for entry in TOPICS {
            if !self.wants(entry.name) {
                continue;
            }
            self.known.insert(entry.name.to_owned());
            let opened = visit(entry.name, Open { listener: self });
            match opened.expect("a topic of the table") {
                Ok(feed) => self.feeds.push(feed),
                Err(error) if self.wanted.is_empty() => {
                    refused.push(format!("{} is not recorded: {error}", entry.name));
                }
                Err(error) => return Err(error.into()),
            }
        }
        Ok(refused)
    }

    /// Opens new topics of other programs. Returns why some cannot be recorded.
    pub(crate) fn look_for_more(&mut self) -> Result<Vec<String>, RecordError> {
        let mut refused = Vec::new();
        if !self.services.has_changed(self.bus.home()) {
            return Ok(refused);
        }
        let look = || self.bus.topics();
        for topic in self.watchdog.over("listing the topics", look)? {
            let is_new = topic.unit == *self.bus.unit()
                && topic.entry.is_none()
                && self.wants(&topic.name)
                && !self.known.contains(&topic.name);
            if !is_new {
                continue;
            }
            let name = topic.name;
            self.known.insert(name.clone());
            if topic.layout != Layout::Described {
                refused.push(format!(
                    "{name} is not recorded: it does not say how its samples are laid out"
                ));
                continue;
            }
            let open = || self.bus.found(&name);
            match self.watchdog.over("opening the topic", open) {
                Ok(Some(found)) => {
                    let schema = EnvelopeSchema::of(found.description());
                    let feed = self.feed(found, &name, schema);
                    self.feeds.push(feed);
                }
                // It disappeared meanwhile, and may come back.
                Ok(None) => {
                    self.known.remove(&name);
                }
                Err(error) => refused.push(format!("{name} is not recorded: {error}")),
            }
        }
        Ok(refused)
    }

    /// The topics that the user has named and that do not exist.
    pub(crate) fn absent(&self) -> Vec<String> {
        let wanted = self.wanted.iter();
        let absent = wanted.filter(|name| !self.known.contains(*name));
        absent.cloned().collect()
    }

    /// Queues the new samples of every topic.
    pub(crate) fn drain(&mut self, pace: &mut Pace) -> Result<(), RecordError> {
        self.watchdog.enter("reading the topics");
        let drained = self
            .feeds
            .iter_mut()
            .try_for_each(|feed| feed.drain(&self.queue, pace));
        self.watchdog.leave();
        drained
    }

    fn feed<S: Source + 'static>(
        &self,
        from: S,
        name: &str,
        schema: EnvelopeSchema,
    ) -> Box<dyn Feed> {
        let topic = Topic::new(name, schema, from.holds());
        let (place, topic) = self.topics.add(topic);
        Box::new(FeedOf {
            from,
            place,
            topic,
            times: self.times,
        })
    }
}

struct Open<'a, 'b> {
    listener: &'a Listener<'b>,
}

impl TopicVisitor for Open<'_, '_> {
    type Output = Result<Box<dyn Feed>, PortError>;

    fn visit<T: TableTopic>(self) -> Self::Output {
        let listener = self.listener;
        let from = listener.bus.subscriber::<T>()?;
        let schema = EnvelopeSchema::of(&Description::of::<T::Payload>());
        Ok(listener.feed(from, T::NAME, schema))
    }
}

struct FeedOf<S> {
    from: S,
    place: usize,
    topic: Arc<Topic>,
    times: Timing,
}

impl<S: Source> Feed for FeedOf<S> {
    fn drain(&mut self, queue: &QueueIn, pace: &mut Pace) -> Result<(), RecordError> {
        let mut found = 0;
        while found < TURN {
            let packing = Packing {
                place: self.place,
                dropped: self.topic.count().dropped,
                times: self.times,
            };
            let Some(item) = self.from.next(packing).map_err(received)? else {
                break;
            };
            found += 1;
            self.topic.receive();
            if !queue.put(item?) {
                self.topic.drop_one();
            }
        }
        pace.found(found, self.from.queue());
        self.topic.lose(self.from.lost());
        Ok(())
    }
}

fn received(error: ReceiveError) -> RecordError {
    RecordError::Receive(error)
}

/// Makes an item of a sample.
struct Packing {
    place: usize,
    dropped: u64,
    times: Timing,
}

impl Look for Packing {
    type Output = Result<Item, RecordError>;

    fn look<P: Serialize>(self, stamp: &Stamp, lost: u64, payload: &P) -> Self::Output {
        let mut message = Vec::with_capacity(512);
        let envelope = Envelope {
            stamp: *stamp,
            lost,
            dropped: self.dropped,
            payload,
        };
        serde_json::to_writer(&mut message, &envelope)?;
        Ok(Item {
            topic: self.place,
            times: self.times.of(stamp),
            sequence: stamp.sequence,
            lost,
            dropped: self.dropped,
            message,
        })
    }
}
