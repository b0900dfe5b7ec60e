//! The table of topics and requests, and the way to reach a topic's static type by its name.
//!
//! Names are relative: on the bus each stands behind `lager/<robot>/`.
//!
//! A topic with actors is two services, so that those who watch do not delay those who act. Actors
//! read `<name>:actors`, which has few places. Everybody else, stock iceoryx2 included, reads
//! `<name>`, where the writer puts a copy with the same stamp after it has rung the actors. A
//! payload of more than 4 KiB is not copied; its topic keeps one service ([`Qos::copied`]).
//!
//! Line and distance frames queue 256 samples, other streams 16 or 64. The real images send a
//! thousand of each frame a second, ten times what the simulated robot sends, and an ordinary
//! machine may keep a service from its core for a quarter of a second. The longer queues cost 3 MiB
//! of locked memory for each service.
//!
//! Who wants to know a state asks for the latest; who keeps what has been reads them all. So states
//! queue 8 samples, and 16 where they come many times a second. With a queue of one, a recorder
//! that looked every 2 ms missed 6 % of the states of a robot at ten times its speed, beside two
//! busy processes on two cores; now it looks every 12 ms and misses 0.1 % (20 s each, AMD EPYC,
//! 2026-11-26), and none on an idle machine. These queues cost 1.5 MiB of the bridge's locked
//! memory and 3.3 MiB of logic's.

use core::fmt;

use crate::hash;
use crate::payloads::{
    Answer, Ask, BlockedWays, CommandLatency, DistanceFrame, Event, Health, Input, LineFrame,
    NavigatorStatus, Order, OrderQueue, PathLatency, Route, SteeringOrder, SteeringReport, Thought,
    ToldInputs, Truth, WarehouseMap, WorldAnswer, WorldAsk,
};
use crate::role::Role;
use crate::schema::{Payload, StructInfo};

/// Observers that can be attached to one topic at the same time.
pub const OBSERVERS: usize = 64;

/// Places on each topic for services that read it without being woken by it: a supervisor that
/// keeps its last value, a restarted writer that reads it back, the station's display.
pub const SERVICE_SLOTS: usize = 8;

/// The largest payload that is copied, in bytes.
pub const LARGEST_COPY: usize = 4096;

/// Quality of service of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Samples a subscriber can fall behind before it loses the oldest.
    pub buffer: usize,
    /// Samples a late joiner still gets: 0 for a stream, 1 for a state.
    pub history: usize,
    /// Writers at the same time.
    pub publishers: usize,
    /// Roles that act on the topic and are woken by each sample.
    pub actors: &'static [Role],
    /// Whether late joiners get the history also while nothing new is published.
    pub republish: bool,
    /// Whether actors have a service of their own and everybody else gets copies, made after the
    /// actors were rung. Otherwise all read one service, which a payload of more than
    /// [`LARGEST_COPY`] bytes must. It says nothing where there are no actors.
    pub copied: bool,
}

impl Qos {
    /// A stream of one writer: readers queue up to `buffer` samples, late joiners get none.
    pub const fn stream(buffer: usize) -> Self {
        Self {
            buffer,
            history: 0,
            publishers: 1,
            actors: &[],
            republish: false,
            copied: true,
        }
    }

    /// A state of one writer: readers see the last sample, also those that join late, and up to 8
    /// that came before it.
    pub const fn state() -> Self {
        Self {
            history: 1,
            republish: true,
            ..Self::stream(8)
        }
    }

    /// The same, waking the processes of these roles with each sample.
    pub const fn waking(self, actors: &'static [Role]) -> Self {
        Self { actors, ..self }
    }

    /// The same with one service for all, for payloads of more than [`LARGEST_COPY`] bytes.
    pub const fn uncopied(self) -> Self {
        Self {
            copied: false,
            ..self
        }
    }

    /// Whether actors have a service of their own, and are served before everybody else.
    pub const fn serves_actors_first(&self) -> bool {
        self.copied && !self.actors.is_empty()
    }

    /// Places on the service under the topic's name: 64 observers, each actor twice (a killed one
    /// and its successor), and [`SERVICE_SLOTS`].
    pub const fn max_subscribers(&self) -> usize {
        OBSERVERS + self.max_acting()
    }

    /// Places on the actors' own service: each actor twice, and [`SERVICE_SLOTS`] for roles that
    /// several processes have.
    pub const fn max_acting(&self) -> usize {
        2 * self.actors.len() + SERVICE_SLOTS
    }

    /// Publisher places: each writer twice (a killed one and its successor), and two for keepers
    /// that hand over a last value.
    pub const fn max_publishers(&self) -> usize {
        2 * self.publishers + 2
    }

    /// Processes that can have the topic open at the same time.
    pub const fn max_nodes(&self) -> usize {
        self.max_subscribers() + self.max_publishers() + 16
    }
}

/// A topic as a type: `bus.publisher::<SensorLine>()`.
pub trait Topic: 'static {
    /// The name behind `lager/<robot>/`.
    const NAME: &'static str;
    /// The name as a number, for stamps: never 0, and different for each topic of the table.
    const ID: u32 = id(Self::NAME);
    /// What is published.
    type Payload: Payload;
    /// How it is published.
    const QOS: Qos;
    /// One line for people.
    const SUMMARY: &'static str;
}

/// The number of a topic's name, in the table or not.
pub const fn id(name: &str) -> u32 {
    let hash = hash::bytes(hash::START, name.as_bytes());
    // The upper half of FNV-1a is the better mixed one; 0 is kept for "no topic".
    match (hash >> 32) as u32 {
        0 => 1,
        id => id,
    }
}

/// The topic a stamp means by its `cause_topic`; `None` for 0 and for what is in no table.
pub fn by_id(id: u32) -> Option<&'static TopicEntry> {
    TOPICS.iter().find(|entry| entry.id == id)
}

/// A request as a type: `bus.client::<BridgeRequest>()`.
pub trait Request: 'static {
    /// The name behind `lager/<robot>/`.
    const NAME: &'static str;
    /// The name as a number, as topics have one.
    const ID: u32 = id(Self::NAME);
    /// What is asked.
    type Request: Payload;
    /// What is answered.
    type Reply: Payload;
    /// The role that answers.
    const ACTOR: Role;
    /// One line for people.
    const SUMMARY: &'static str;

    /// Writes into a request when it is asked, in ns of `CLOCK_MONOTONIC`, and for how long its
    /// asker waits, each unless it stands there: whoever asks for somebody else says when that one
    /// has asked. Whoever answers refuses one whose time is over.
    fn date(request: &mut Self::Request, issued_ns: u64, lifetime_ms: u32);
}

/// One line of [`TOPICS`].
#[derive(Clone, Copy, Debug)]
pub struct TopicEntry {
    /// The name behind `lager/<robot>/`.
    pub name: &'static str,
    /// The name as a number, as stamps carry it.
    pub id: u32,
    /// The payload's name, and how it lies in memory with everything inside.
    pub layout: StructInfo,
    /// How it is published.
    pub qos: Qos,
    /// One line for people.
    pub summary: &'static str,
    /// The longest time between two samples of a robot that works, in ms of its own time; `None`
    /// where samples come only when something happens.
    pub period_ms: Option<u32>,
}

/// Work to be done with a topic's static type; see [`visit`].
pub trait TopicVisitor {
    /// What the work yields.
    type Output;

    /// Does it for `T`.
    fn visit<T: Topic>(self) -> Self::Output;
}

/// A name that is in no table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownTopic(pub String);

impl fmt::Display for UnknownTopic {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "there is no topic `{}`; the topics are", self.0)?;
        for entry in TOPICS {
            write!(formatter, " {}", entry.name)?;
        }
        Ok(())
    }
}

impl std::error::Error for UnknownTopic {}

/// A topic's period, where it has one.
const fn period(stated: &[u32]) -> Option<u32> {
    match stated {
        [] => None,
        [ms, ..] => Some(*ms),
    }
}

macro_rules! topics {
    ($(
        $topic:ident = $name:literal, $payload:ty, $summary:literal,
        { $($qos:tt)* } $(, every $period:literal ms)?;
    )*) => {
        $(
            #[doc = concat!("`", $name, "`: ", $summary)]
            #[derive(Clone, Copy, Debug)]
            pub struct $topic;

            impl Topic for $topic {
                const NAME: &'static str = $name;
                type Payload = $payload;
                const QOS: Qos = Qos { $($qos)* };
                const SUMMARY: &'static str = $summary;
            }
        )*

        /// Every topic, in the order of the data's way.
        pub const TOPICS: &[TopicEntry] = &[
            $( TopicEntry {
                name: $name,
                id: <$topic as Topic>::ID,
                layout: StructInfo::of::<$payload>(),
                qos: <$topic as Topic>::QOS,
                summary: $summary,
                period_ms: period(&[$( $period )?]),
            }, )*
        ];

        /// Runs `visitor` with the type of the topic called `name`.
        ///
        /// # Errors
        /// No topic has that name.
        pub fn visit<V: TopicVisitor>(name: &str, visitor: V) -> Result<V::Output, UnknownTopic> {
            match name {
                $( $name => Ok(visitor.visit::<$topic>()), )*
                _ => Err(UnknownTopic(name.to_owned())),
            }
        }
    };
}

topics! {
    // A chip sends a line and a distance each millisecond: a quarter of a second, as with the
    // reports.
    SensorLine = "sensor/line", LineFrame,
    "The line under the robot, as the sensor board classifies it.",
    { buffer: 256, history: 0, publishers: 1, actors: &[Role::Logic], republish: false,
      copied: true }, every 10 ms;

    SensorDistance = "sensor/distance", DistanceFrame,
    "The distance to what is in front of the robot.",
    { buffer: 256, history: 0, publishers: 1, actors: &[Role::Logic], republish: false,
      copied: true }, every 10 ms;

    SteeringCommand = "steering/command", SteeringOrder,
    "Orders to the arbiter in the bridge.",
    { buffer: 16, history: 0, publishers: 8, actors: &[Role::Bridge], republish: false,
      copied: true };

    SteeringState = "steering/state", SteeringReport,
    "What the steering board does, with the arm's servos.",
    { buffer: 64, history: 0, publishers: 1, actors: &[Role::Logic], republish: false,
      copied: true }, every 5 ms;

    LinkHealth = "link/health", Health,
    "Both serial links and who may steer.",
    { buffer: 16, history: 1, publishers: 1, actors: &[Role::Logic], republish: true,
      copied: true }, every 100 ms;

    NavStatus = "nav/status", NavigatorStatus,
    "Where the robot is and what it is doing.",
    { buffer: 16, history: 1, publishers: 1, actors: &[], republish: true,
      copied: false }, every 50 ms;

    NavMap = "nav/map", WarehouseMap,
    "The warehouse and where its products stand.",
    { buffer: 8, history: 1, publishers: 4, actors: &[Role::Logic], republish: true, copied: true };

    NavRoute = "nav/route", Route,
    "The nodes the robot means to pass.",
    { buffer: 8, history: 1, publishers: 1, actors: &[], republish: true, copied: false };

    NavBlocks = "nav/blocks", BlockedWays,
    "The ways on which something stands.",
    { buffer: 8, history: 1, publishers: 1, actors: &[], republish: true, copied: false };

    // Some forty samples a second, a hundred and fifty at a chip's rates: who misses one has to
    // wait for the next navigator.
    NavInputs = "nav/inputs", ToldInputs,
    "What the navigator was told, in pieces, with proofs of what it did: for `bag play --verify`.",
    { buffer: 64, history: 0, publishers: 1, actors: &[], republish: false, copied: false };

    MissionOrder = "mission/order", Order,
    "Products to fetch.",
    { buffer: 16, history: 0, publishers: 4, actors: &[Role::Logic], republish: false,
      copied: true };

    MissionQueue = "mission/queue", OrderQueue,
    "The order under way and those that wait for their turn.",
    { buffer: 8, history: 1, publishers: 1, actors: &[], republish: true, copied: false };

    MissionEvent = "mission/event", Event,
    "What happened on a mission.",
    { buffer: 64, history: 0, publishers: 1, actors: &[Role::Comm], republish: false,
      copied: true };

    OperatorInput = "operator/input", Input,
    "Buttons and acknowledgements of a person.",
    { buffer: 16, history: 0, publishers: 8, actors: &[Role::Logic, Role::Bridge], republish: false,
      copied: true };

    LogThought = "log/thought", Thought,
    "What the services think, for people to read.",
    { buffer: 64, history: 0, publishers: 8, actors: &[], republish: false, copied: false };

    LatencyPath = "latency/path", PathLatency,
    "How long sensor frames take until logic has decided, stage by stage, once a second.",
    { buffer: 8, history: 1, publishers: 1, actors: &[], republish: true,
      copied: false }, every 1000 ms;

    LatencyCommand = "latency/command", CommandLatency,
    "How long logic's orders take from the frame they rest on to the wire, once a second.",
    { buffer: 8, history: 1, publishers: 1, actors: &[], republish: true,
      copied: false }, every 1000 ms;

    TruthPose = "truth/pose", Truth,
    "The simulated world as it really is.",
    { buffer: 16, history: 1, publishers: 1, actors: &[], republish: true,
      copied: false }, every 20 ms;
}

/// `bridge/request`: changes of the mode and of settings, answered by the bridge.
#[derive(Clone, Copy, Debug)]
pub struct BridgeRequest;

impl Request for BridgeRequest {
    const NAME: &'static str = "bridge/request";
    type Request = Ask;
    type Reply = Answer;
    const ACTOR: Role = Role::Bridge;
    const SUMMARY: &'static str = "Changes of the mode and of settings.";

    fn date(request: &mut Ask, issued_ns: u64, lifetime_ms: u32) {
        date(
            (&mut request.issued_ns, &mut request.lifetime_ms),
            (issued_ns, lifetime_ms),
        );
    }
}

/// `world/request`: what a person's hands do in the simulated world, answered by the simulator or
/// the emulator. Real boards have nobody who answers.
#[derive(Clone, Copy, Debug)]
pub struct WorldRequest;

impl Request for WorldRequest {
    const NAME: &'static str = "world/request";
    type Request = WorldAsk;
    type Reply = WorldAnswer;
    const ACTOR: Role = Role::Simulator;
    const SUMMARY: &'static str = "What a person's hands do in the simulated world.";

    fn date(request: &mut WorldAsk, issued_ns: u64, lifetime_ms: u32) {
        date(
            (&mut request.issued_ns, &mut request.lifetime_ms),
            (issued_ns, lifetime_ms),
        );
    }
}

fn date((issued_ns, lifetime_ms): (&mut u64, &mut u32), (now_ns, most_ms): (u64, u32)) {
    if *issued_ns == 0 {
        *issued_ns = now_ns;
    }
    if *lifetime_ms == 0 {
        *lifetime_ms = most_ms;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::Schema;

    struct TypeName;

    impl TopicVisitor for TypeName {
        type Output = &'static str;

        fn visit<T: Topic>(self) -> &'static str {
            T::Payload::TYPE_NAME
        }
    }

    #[test]
    fn every_topic_of_the_table_is_found_by_its_name() {
        for entry in TOPICS {
            assert_eq!(visit(entry.name, TypeName), Ok(entry.layout.type_name));
        }
    }

    #[test]
    fn a_wrong_name_is_refused_with_the_right_ones() {
        let error = visit("sensor/lime", TypeName).unwrap_err().to_string();
        assert!(error.contains("`sensor/lime`") && error.contains("sensor/line"));
    }

    #[test]
    fn names_numbers_types_and_hashes_are_each_used_once() {
        for (index, entry) in TOPICS.iter().enumerate() {
            for other in &TOPICS[..index] {
                assert_ne!(entry.name, other.name);
                assert_ne!(entry.id, other.id);
                assert_ne!(entry.layout.type_name, other.layout.type_name);
                assert_ne!(entry.layout.hash, other.layout.hash);
            }
        }
    }

    #[test]
    fn a_stamp_names_its_cause_by_number() {
        for entry in TOPICS {
            assert_eq!(by_id(entry.id).map(|found| found.name), Some(entry.name));
        }
        assert_eq!(SensorLine::ID, TOPICS[0].id);
        assert!(by_id(0).is_none());
    }

    #[test]
    fn a_state_is_kept_for_late_joiners_and_a_stream_is_not() {
        for entry in TOPICS {
            assert_eq!(
                entry.qos.republish,
                entry.qos.history == 1,
                "{}",
                entry.name
            );
            assert!(entry.qos.history <= entry.qos.buffer, "{}", entry.name);
            if entry.qos.republish {
                assert!(entry.qos.buffer >= 8, "{}", entry.name);
            }
        }
    }

    #[test]
    fn actors_are_served_first_where_there_are_any_and_the_payload_is_small() {
        for entry in TOPICS {
            let is_small = entry.layout.size <= LARGEST_COPY;
            let expected = !entry.qos.actors.is_empty() && is_small;
            assert_eq!(entry.qos.copied, expected, "{}", entry.name);
            assert_eq!(entry.qos.serves_actors_first(), expected);
        }
        assert!(!Qos::stream(1).serves_actors_first(), "nobody acts");
        assert!(Qos::stream(1).waking(&[Role::Guest]).serves_actors_first());
        let large = Qos::stream(1).waking(&[Role::Guest]).uncopied();
        assert!(!large.serves_actors_first());
    }

    #[test]
    fn observers_and_actors_have_places_beside_each_other() {
        for entry in TOPICS {
            let qos = entry.qos;
            assert!(qos.max_subscribers() >= OBSERVERS + 2 * qos.actors.len());
            assert!(qos.max_acting() >= 2 * qos.actors.len());
            assert!(qos.max_publishers() > qos.publishers);
            assert!(qos.max_nodes() >= qos.max_subscribers() + qos.max_publishers());
            assert!(qos.actors.iter().all(|actor| !actor.is_observer()));
        }
    }
}
