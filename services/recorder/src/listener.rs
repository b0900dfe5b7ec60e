//! The thread that polls the bus, or what a gateway has sent: it turns samples into JSON and queues them for the keeper.

use std::collections::BTreeSet;
use std::sync::Arc;

use lager_journal::{Envelope, EnvelopeSchema, Times};
use lager_ports::{Layout, Look, Place, ReceiveError, Source, StampTime};
use lager_sample::{Stamp, Topic as TableTopic};
use lager_topics::{TOPICS, TopicVisitor, visit};
use lager_wake::{Pace, Watchdog};
use serde::Serialize;

use crate::error::RecordError;
use crate::tally::{Item, QueueIn, Topic, Topics};

/// How many samples of one topic it takes before the next topic has its turn.
const TURN: u64 = 1_024;

/// All topics that it listens to.
pub(crate) struct Listener<'a, P: Place> {
    pub(crate) place: &'a P,
    pub(crate) watchdog: &'a Watchdog,
    pub(crate) topics: Topics,
    /// The topics that the user wants; empty for all.
    pub(crate) wanted: &'a [String],
    pub(crate) times: Timing,
    pub(crate) queue: QueueIn,
    pub(crate) feeds: Vec<Box<dyn Feed>>,
    /// The topics that it listens to, or has found unreadable.
    pub(crate) known: BTreeSet<String>,
    pub(crate) watch: P::Watch,
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
    fn of(self, stamp: &Stamp, now: StampTime) -> Times {
        let now = now.now_ns.saturating_add(now.unsure_ns).max(self.began_ns);
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
    fn drain(
        &mut self,
        queue: &QueueIn,
        pace: &mut Pace,
        now: StampTime,
    ) -> Result<(), RecordError>;
}

impl<P: Place> Listener<'_, P> {
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
            let opened = visit(entry.name, Open { listener: self });
            match opened.expect("a topic of the table") {
                Ok(Some(feed)) => self.feeds.push(feed),
                // It is not there, or as described; then it is found later.
                Ok(None) => continue,
                Err(error) if self.wanted.is_empty() => {
                    refused.push(format!("{} is not recorded: {error}", entry.name));
                }
                Err(error) => return Err(RecordError::of_place(error)),
            }
            self.known.insert(entry.name.to_owned());
        }
        Ok(refused)
    }

    /// Opens new topics, most of them of other programs. Returns why some cannot be recorded.
    pub(crate) fn look_for_more(&mut self) -> Result<Vec<String>, RecordError> {
        let (mut refused, place) = (Vec::new(), self.place);
        if !place.has_changed(&mut self.watch) {
            return Ok(refused);
        }
        let topics = self
            .watchdog
            .over("listing the topics", || place.every_topic());
        for topic in topics.map_err(RecordError::of_place)? {
            let name = topic.name;
            if !self.wants(&name) || self.known.contains(&name) {
                continue;
            }
            self.known.insert(name.clone());
            if !matches!(topic.layout, Layout::Described | Layout::Ours) {
                refused.push(format!(
                    "{name} is not recorded: it does not say how its samples are laid out"
                ));
                continue;
            }
            let open = || place.described(&name);
            match self.watchdog.over("opening the topic", open) {
                Ok(Some(found)) => {
                    let feed = self.feed(found, &name);
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
        let now = self.place.time();
        let drained = self
            .feeds
            .iter_mut()
            .try_for_each(|feed| feed.drain(&self.queue, pace, now));
        self.watchdog.leave();
        drained
    }

    fn feed<S: Source + 'static>(&self, from: S, name: &str) -> Box<dyn Feed> {
        let schema = EnvelopeSchema::of(&from.description());
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

struct Open<'a, 'b, P: Place> {
    listener: &'a Listener<'b, P>,
}

impl<P: Place> TopicVisitor for Open<'_, '_, P> {
    type Output = Result<Option<Box<dyn Feed>>, P::OpenError>;

    fn visit<T: TableTopic>(self) -> Self::Output {
        let from = self.listener.place.typed::<T>()?;
        Ok(from.map(|from| self.listener.feed(from, T::NAME)))
    }
}

struct FeedOf<S> {
    from: S,
    place: usize,
    topic: Arc<Topic>,
    times: Timing,
}

impl<S: Source> Feed for FeedOf<S> {
    fn drain(
        &mut self,
        queue: &QueueIn,
        pace: &mut Pace,
        now: StampTime,
    ) -> Result<(), RecordError> {
        let mut found = 0;
        while found < TURN {
            let packing = Packing {
                place: self.place,
                dropped: self.topic.count().dropped,
                times: self.times,
                now,
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
    now: StampTime,
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
            times: self.times.of(stamp, self.now),
            sequence: stamp.sequence,
            lost,
            dropped: self.dropped,
            message,
        })
    }
}
