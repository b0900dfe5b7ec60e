//! Keeps the samples that a navigator has sent until their entry of `nav/inputs` comes. Logic
//! publishes them before the entry, so few wait at a time.

use std::collections::{BTreeMap, BTreeSet};

use lager_journal::{Envelope, EnvelopeSchema};
use lager_sample::{Description, Field, Payload, Topic, bytes_of};
use lager_topics::{
    Event, MissionEvent, NavStatus, NavigatorInputs, NavigatorStatus, Origin, Sent,
    SteeringCommand, SteeringOrder,
};

use super::outcome::{Compared, OfTopic, SampleDifference, VerifyError};
use super::rerun::Did;

/// The topic of the orders.
pub(super) const COMMANDS: &str = SteeringCommand::NAME;

/// The topics that are compared besides `nav/inputs`.
pub(super) const TOPICS: [&str; 3] = [COMMANDS, NavStatus::NAME, MissionEvent::NAME];

/// Refuses a topic of [`TOPICS`] that has another layout in this build.
pub(super) fn must_fit_as_compared(topic: &str, schema: &[u8]) -> Result<(), VerifyError> {
    match topic {
        COMMANDS => must_fit::<SteeringOrder>(COMMANDS, schema),
        NavStatus::NAME => must_fit::<NavigatorStatus>(NavStatus::NAME, schema),
        MissionEvent::NAME => must_fit::<Event>(MissionEvent::NAME, schema),
        _ => Ok(()),
    }
}

/// Refuses samples that have another layout in this build.
pub(super) fn must_fit<P: Payload>(topic: &'static str, schema: &[u8]) -> Result<(), VerifyError> {
    match EnvelopeSchema::of(&Description::of::<P>()).fits(schema) {
        true => Ok(()),
        false => Err(VerifyError::Layout { topic }),
    }
}

/// A message of a topic.
pub(super) fn read<P: Payload>(
    topic: &'static str,
    message: &[u8],
) -> Result<Envelope<P>, VerifyError> {
    serde_json::from_slice(message).map_err(|error| VerifyError::Message { topic, error })
}

/// Whether two payloads are equal, byte by byte.
fn same<P: Field>(one: &P, other: &P) -> bool {
    bytes_of(one) == bytes_of(other)
}

/// The samples of one topic that wait, by epoch and number.
#[derive(Debug)]
struct Waiting<P> {
    topic: &'static str,
    waiting: BTreeMap<(u64, u64), P>,
    /// Epochs of navigators.
    known: BTreeSet<u64>,
    /// The number of the navigator's next sample.
    at: Sent,
    count: OfTopic,
}

impl<P: Payload> Waiting<P> {
    fn new(topic: &'static str) -> Self {
        Self {
            topic,
            waiting: BTreeMap::new(),
            known: BTreeSet::new(),
            at: Sent::default(),
            count: OfTopic::default(),
        }
    }

    fn keep(&mut self, message: &[u8]) -> Result<(), VerifyError> {
        let envelope = read::<P>(self.topic, message)?;
        let key = (envelope.stamp.epoch, envelope.stamp.sequence);
        self.waiting.insert(key, envelope.payload);
        Ok(())
    }

    fn begin(&mut self, at: Sent) {
        self.known.insert(at.epoch);
        self.at = at;
    }

    /// Compares the next sample with the one that the navigator sends now. `as_sent` fills in what
    /// only the shell knows.
    fn compare(&mut self, mut now: P, as_sent: impl Fn(&mut P, &P)) -> Option<SampleDifference> {
        let number = self.at.next;
        self.at.next += 1;
        self.count.sent += 1;
        let recorded = self.waiting.remove(&(self.at.epoch, number))?;
        as_sent(&mut now, &recorded);
        if same(&recorded, &now) {
            self.count.same += 1;
            return None;
        }
        let as_text = |payload: &P| serde_json::to_string(payload).expect("a payload is JSON");
        Some(SampleDifference {
            topic: self.topic,
            number,
            recorded: as_text(&recorded),
            now: as_text(&now),
        })
    }

    fn finish(mut self, is_navigators: impl Fn(&P) -> bool) -> OfTopic {
        let left = self.waiting.iter();
        let left =
            left.filter(|((epoch, _), sample)| self.known.contains(epoch) || is_navigators(sample));
        self.count.unexplained = left.count() as u64;
        self.count
    }
}

/// The samples that wait.
#[derive(Debug)]
pub(super) struct Samples {
    commands: Waiting<SteeringOrder>,
    statuses: Waiting<NavigatorStatus>,
    events: Waiting<Event>,
}

impl Default for Samples {
    fn default() -> Self {
        Self {
            commands: Waiting::new(COMMANDS),
            statuses: Waiting::new(NavStatus::NAME),
            events: Waiting::new(MissionEvent::NAME),
        }
    }
}

impl Samples {
    /// Keeps a sample of one of [`TOPICS`].
    pub(super) fn keep(&mut self, topic: &str, message: &[u8]) -> Result<(), VerifyError> {
        match topic {
            COMMANDS => self.commands.keep(message),
            NavStatus::NAME => self.statuses.keep(message),
            MissionEvent::NAME => self.events.keep(message),
            _ => Ok(()),
        }
    }

    /// A navigator starts.
    pub(super) fn begin(&mut self, piece: &NavigatorInputs) {
        self.commands.begin(piece.commands);
        self.statuses.begin(piece.statuses);
        self.events.begin(piece.events);
    }

    /// A piece with entries begins. Returns what is wrong if the navigator had sent more or fewer
    /// samples by then than the navigator has now.
    pub(super) fn begin_piece(&self, piece: &NavigatorInputs) -> Option<SampleDifference> {
        let told = [
            (COMMANDS, self.commands.at, piece.commands),
            (NavStatus::NAME, self.statuses.at, piece.statuses),
            (MissionEvent::NAME, self.events.at, piece.events),
        ];
        let wrong = told.into_iter().find(|(_, now, then)| now != then);
        wrong.map(|(topic, now, then)| SampleDifference {
            topic,
            number: then.next.min(now.next),
            recorded: format!("{} sent so far", then.next),
            now: format!("{} sent so far", now.next),
        })
    }

    /// Compares the samples that the navigator sends after one entry.
    pub(super) fn compare(&mut self, did: &Did) -> Option<SampleDifference> {
        let mut first = None;
        if let Some(command) = did.command {
            first = first.or(self.commands.compare(command, |_, _| {}));
        }
        for event in &did.events {
            first = first.or(self.events.compare(*event, |_, _| {}));
        }
        if let Some(status) = did.status {
            first = first.or(self.statuses.compare(status, |now, recorded| {
                now.frames_lost = recorded.frames_lost;
            }));
        }
        first
    }

    /// The compared samples.
    pub(super) fn finish(self) -> Compared {
        Compared {
            commands: self.commands.finish(|order| order.origin == Origin::Logic),
            statuses: self.statuses.finish(|_| false),
            events: self.events.finish(|_| true),
        }
    }
}
