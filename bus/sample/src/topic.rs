//! [`Topic`], [`Request`] and [`Qos`]: how an application declares its topics and requests.
//!
//! A topic with actors has two services, so that processes that observe do not delay processes that
//! act. Actors read `<name>:actors`, which has few places. Everybody else, plain iceoryx2 included,
//! reads `<name>`. The writer puts a copy with the same stamp there after it has rung the actors.
//! It does not copy a payload of more than 4 KiB; such a topic has one service ([`Qos::copied`]).

use crate::hash;
use crate::part::Part;
use crate::schema::{Field, Payload, StructInfo, bytes_of};

/// The largest payload that writers copy, in bytes.
pub const LARGEST_COPY: usize = 4096;

/// Quality of service of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// How many samples a subscriber can fall behind before it loses the oldest.
    pub buffer: usize,
    /// How many samples a subscriber that joins late still gets: 0 for a stream, 1 for a state.
    pub history: usize,
    /// How many writers there may be at the same time.
    pub publishers: usize,
    /// The parts that act on the topic; each sample wakes their processes.
    pub actors: &'static [Part],
    /// Whether late subscribers get the history even while no new sample is published.
    pub republish: bool,
    /// Whether actors have a service of their own and everybody else gets copies, made after the
    /// actors were rung. Otherwise all read one service, as a payload of more than [`LARGEST_COPY`]
    /// bytes requires. Has no effect without actors.
    pub copied: bool,
    /// How many observers there may be.
    pub observers: usize,
    /// How many other readers there may be that nobody wakes: a supervisor that keeps the last
    /// value, a restarted writer that reads it back.
    pub slots: usize,
}

impl Qos {
    /// A stream of one writer: readers queue up to `buffer` samples, and late readers get none. It
    /// has places for 64 observers and 8 other readers that nobody wakes.
    pub const fn stream(buffer: usize) -> Self {
        Self {
            buffer,
            history: 0,
            publishers: 1,
            actors: &[],
            republish: false,
            copied: true,
            observers: 64,
            slots: 8,
        }
    }

    /// A state of one writer: all readers, late ones too, get the last sample, and up to `buffer`
    /// samples that came before it. Places as in [`Qos::stream`].
    pub const fn state(buffer: usize) -> Self {
        Self {
            history: 1,
            republish: true,
            ..Self::stream(buffer)
        }
    }

    /// The same with up to `publishers` writers at the same time.
    pub const fn written_by(self, publishers: usize) -> Self {
        Self { publishers, ..self }
    }

    /// The same, but each sample wakes the processes that play these parts.
    pub const fn waking(self, actors: &'static [Part]) -> Self {
        Self { actors, ..self }
    }

    /// The same with one service for all readers, for payloads of more than [`LARGEST_COPY`] bytes.
    pub const fn uncopied(self) -> Self {
        Self {
            copied: false,
            ..self
        }
    }

    /// Whether actors have a service of their own and get each sample before everybody else.
    pub const fn serves_actors_first(&self) -> bool {
        self.copied && !self.actors.is_empty()
    }

    /// Places on the service under the topic's name: for its observers, for each actor twice (a
    /// killed one and its successor), and [`Qos::slots`].
    pub const fn max_subscribers(&self) -> usize {
        self.observers + self.max_acting()
    }

    /// Places on the actors' own service: for each actor twice, and [`Qos::slots`] for parts that
    /// several processes play.
    pub const fn max_acting(&self) -> usize {
        2 * self.actors.len() + self.slots
    }

    /// Places for publishers: for each writer twice (a killed one and its successor), and two for
    /// keepers that hand over a last value.
    pub const fn max_publishers(&self) -> usize {
        2 * self.publishers + 2
    }

    /// How many processes can have the topic open at the same time.
    pub const fn max_nodes(&self) -> usize {
        self.max_subscribers() + self.max_publishers() + 16
    }
}

/// A topic as a type: `bus.publisher::<SensorLine>()`.
pub trait Topic: 'static {
    /// The name, which stands after the application's and the unit's names on the bus.
    const NAME: &'static str;
    /// The name as a number, for stamps: never 0.
    const ID: u32 = id(Self::NAME);
    /// The type of its samples' payload.
    type Payload: Payload;
    /// How the topic behaves.
    const QOS: Qos;
    /// A description in one line, for people.
    const SUMMARY: &'static str;
}

/// The number of a topic's name.
pub const fn id(name: &str) -> u32 {
    let hash = hash::bytes(hash::START, name.as_bytes());
    // The upper half of FNV-1a is the better mixed one; 0 is kept for "no topic".
    match (hash >> 32) as u32 {
        0 => 1,
        id => id,
    }
}

/// A request as a type: `bus.client::<BridgeRequest>()`.
pub trait Request: 'static {
    /// The name, which stands after the application's and the unit's names on the bus.
    const NAME: &'static str;
    /// The name as a number, like that of a topic.
    const ID: u32 = id(Self::NAME);
    /// The payload of a client's request.
    type Request: Payload;
    /// The payload of the server's reply.
    type Reply: Payload;
    /// The part of the process that answers.
    const ACTOR: Part;
    /// A description in one line, for people.
    const SUMMARY: &'static str;

    /// Dates a request that a client is about to send: writes the time in ns of `CLOCK_MONOTONIC`,
    /// and for how many ms the client waits for the answer. Keeps values that are already there: a
    /// client that passes on another client's request gives that client's time. The server refuses
    /// a request whose time is over.
    fn date(request: &mut Self::Request, issued_ns: u64, lifetime_ms: u32);
}

/// A topic as a value: a row of an application's table.
#[derive(Clone, Copy, Debug)]
pub struct TopicEntry {
    /// [`Topic::NAME`].
    pub name: &'static str,
    /// [`Topic::ID`].
    pub id: u32,
    /// The payload's name and its complete memory layout.
    pub layout: StructInfo,
    /// [`Topic::QOS`].
    pub qos: Qos,
    /// [`Topic::SUMMARY`].
    pub summary: &'static str,
    /// The longest time between two samples while the application works, in ms of its own time;
    /// `None` if samples come only when something happens.
    pub period_ms: Option<u32>,
    /// The bytes of a payload in which no field has been written.
    pub blank: fn() -> Vec<u8>,
}

impl TopicEntry {
    /// The row of `T`, with its period if it has one.
    pub const fn of<T: Topic>(period_ms: Option<u32>) -> Self {
        Self {
            name: T::NAME,
            id: T::ID,
            layout: StructInfo::of::<T::Payload>(),
            qos: T::QOS,
            summary: T::SUMMARY,
            period_ms,
            blank: || bytes_of(&T::Payload::BLANK).to_vec(),
        }
    }
}

/// The facts that a bus needs about the application that uses it.
#[derive(Debug)]
pub struct Application {
    /// The beginning of the names of its services: `lager` in `lager/r1/sensor/line`.
    pub family: &'static str,
    /// Its topics, in the order in which tools list them. Topics that are not listed work too.
    pub topics: &'static [TopicEntry],
    /// The files and folders that its supervisor keeps in a unit's folder while the unit is up. A
    /// file with one of these names and the ending `new` is half of one.
    pub kept: &'static [&'static str],
}

impl Application {
    /// An application with this family and an empty table.
    pub const fn new(family: &'static str) -> Self {
        Self {
            family,
            topics: &[],
            kept: &[],
        }
    }

    /// The row of the topic called `name`, if there is one.
    pub fn entry(&self, name: &str) -> Option<&'static TopicEntry> {
        self.topics.iter().find(|entry| entry.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAILOR: Part = Part::new(0, "sailor");

    #[test]
    fn actors_are_served_first_where_there_are_any_and_the_payload_is_small() {
        assert!(!Qos::stream(1).serves_actors_first(), "nobody acts");
        assert!(Qos::stream(1).waking(&[SAILOR]).serves_actors_first());
        let large = Qos::stream(1).waking(&[SAILOR]).uncopied();
        assert!(!large.serves_actors_first());
    }

    #[test]
    fn a_topic_has_as_many_places_as_it_says() {
        let few = Qos {
            observers: 3,
            slots: 1,
            ..Qos::state(8).waking(&[SAILOR])
        };
        assert_eq!((few.max_subscribers(), few.max_acting()), (6, 3));
        assert_eq!(Qos::state(8).max_subscribers(), 72);
        assert!(few.max_nodes() >= few.max_subscribers() + few.max_publishers());
    }
}
