//! The table of the robot's topics and requests, and how to find a topic's static type by its name.
//!
//! Names are relative: on the bus, `lager/<robot>/` stands before each.
//!
//! Line and distance frames queue 256 samples, other streams 16 or 64. The real images send 1000 of
//! each frame a second, ten times as many as the simulated robot, and an ordinary machine may keep
//! a service from its core for a quarter of a second. The longer queues cost 3 MiB of locked memory
//! for each service.
//!
//! A program that wants to know a state reads the latest sample, but a program that records states
//! reads all of them. So states queue 8 samples, and 16 if they come many times a second. With a
//! queue of one, a recorder that looked every 2 ms missed 6 % of the states of a robot at ten times
//! its speed, beside two busy processes on two cores. Now it looks every 12 ms and misses 0.1 % (20
//! s each, AMD EPYC, 2026-11-26), and none on an idle machine. These queues cost 1.5 MiB of the
//! bridge's locked memory and 3.3 MiB of logic's.

use core::fmt;

use lager_sample::{Application, Part, Qos, Request, Topic, TopicEntry};

use crate::payloads::{
    Ask, BlockedWays, BridgeAnswer, CommandLatency, DistanceFrame, Event, Health, Input, LineFrame,
    NavigatorInputs, NavigatorStatus, Order, OrderQueue, PathLatency, Route, SteeringOrder,
    SteeringReport, Thought, Truth, WarehouseMap, WorldAnswer, WorldAsk,
};
use crate::role::Role;

/// The robot's application: all that the bus must know of the robot.
pub static LAGER: Application = Application {
    family: "lager",
    topics: TOPICS,
    kept: &[
        "lager.toml",
        "sensor.tty",
        "steering.tty",
        "clock",
        "eeprom",
        "sensor.eeprom",
        "steering.eeprom",
        "gag",
        "secret",
        "queue.toml",
    ],
};

const BRIDGE: Part = Role::Bridge.part();
const LOGIC: Part = Role::Logic.part();
const COMM: Part = Role::Comm.part();

/// The topic with the number `id`, as in a stamp's `cause_topic`; `None` for 0 and unknown numbers.
pub fn by_id(id: u32) -> Option<&'static TopicEntry> {
    TOPICS.iter().find(|entry| entry.id == id)
}

/// A function to be called with a topic's static type; see [`visit`].
pub trait TopicVisitor {
    /// The function's result.
    type Output;

    /// The function, for `T`.
    fn visit<T: Topic>(self) -> Self::Output;
}

/// The name of no topic in the table.
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

/// A topic's period, if it has one.
const fn period(stated: &[u32]) -> Option<u32> {
    match stated {
        [] => None,
        [ms, ..] => Some(*ms),
    }
}

macro_rules! topics {
    ($(
        $topic:ident = $name:literal, $payload:ty, $summary:literal,
        $qos:expr $(, every $period:literal ms)?;
    )*) => {
        $(
            #[doc = concat!("`", $name, "`: ", $summary)]
            #[derive(Clone, Copy, Debug)]
            pub struct $topic;

            impl Topic for $topic {
                const NAME: &'static str = $name;
                type Payload = $payload;
                const QOS: Qos = $qos;
                const SUMMARY: &'static str = $summary;
            }
        )*

        /// Every topic, in the order in which the data flow.
        pub const TOPICS: &[TopicEntry] = &[
            $( TopicEntry::of::<$topic>(period(&[$( $period )?])), )*
        ];

        /// Calls `visitor` with the type of the topic called `name`.
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
    // The queue holds a quarter of a second, because a chip sends a line and a distance each
    // millisecond. The same holds for the reports.
    SensorLine = "sensor/line", LineFrame,
    "The line under the robot, as the sensor board classifies it.",
    Qos::stream(256).waking(&[LOGIC]), every 10 ms;

    SensorDistance = "sensor/distance", DistanceFrame,
    "The distance to what is in front of the robot.",
    Qos::stream(256).waking(&[LOGIC]), every 10 ms;

    SteeringCommand = "steering/command", SteeringOrder,
    "Orders to the arbiter in the bridge.",
    Qos::stream(16).written_by(8).waking(&[BRIDGE]);

    SteeringState = "steering/state", SteeringReport,
    "What the steering board does, with the arm's servos.",
    Qos::stream(64).waking(&[LOGIC]), every 5 ms;

    LinkHealth = "link/health", Health,
    "Both serial links and who may steer.",
    Qos::state(16).waking(&[LOGIC]), every 100 ms;

    NavStatus = "nav/status", NavigatorStatus,
    "Where the robot is and what it is doing.",
    Qos::state(16), every 50 ms;

    NavMap = "nav/map", WarehouseMap,
    "The warehouse and where its goods stand.",
    Qos::state(8).written_by(4).waking(&[LOGIC]);

    NavRoute = "nav/route", Route,
    "The nodes the robot means to pass.",
    Qos::state(8);

    NavBlocks = "nav/blocks", BlockedWays,
    "The ways on which something stands.",
    Qos::state(8);

    // About 40 samples a second, 150 at a chip's rates. A reader that misses one must wait for the
    // next navigator.
    NavInputs = "nav/inputs", NavigatorInputs,
    "What the navigator was told, in pieces, with proofs of what it did: for `bag play --verify`.",
    Qos::stream(64);

    MissionOrder = "mission/order", Order,
    "Products to fetch.",
    Qos::stream(16).written_by(4).waking(&[LOGIC]);

    MissionQueue = "mission/queue", OrderQueue,
    "The order under way and those that wait for their turn.",
    Qos::state(8);

    MissionEvent = "mission/event", Event,
    "What happened on a mission.",
    Qos::stream(64).waking(&[COMM]);

    OperatorInput = "operator/input", Input,
    "Buttons and acknowledgements of a person.",
    Qos::stream(16).written_by(8).waking(&[LOGIC]);

    LogThought = "log/thought", Thought,
    "What the services think, for people to read.",
    Qos::stream(64).written_by(8);

    LatencyPath = "latency/path", PathLatency,
    "How long sensor frames take until logic has decided, stage by stage, once a second.",
    Qos::state(8), every 1000 ms;

    LatencyCommand = "latency/command", CommandLatency,
    "How long logic's orders take from the frame they rest on to the wire, once a second.",
    Qos::state(8), every 1000 ms;

    TruthPose = "truth/pose", Truth,
    "The simulated world as it really is.",
    Qos::state(16), every 20 ms;
}

/// `bridge/request`: changes of the mode and of settings. The bridge answers.
#[derive(Clone, Copy, Debug)]
pub struct BridgeRequest;

impl Request for BridgeRequest {
    const NAME: &'static str = "bridge/request";
    type Request = Ask;
    type Reply = BridgeAnswer;
    const ACTOR: Part = BRIDGE;
    const SUMMARY: &'static str = "Changes of the mode and of settings.";

    fn date(request: &mut Ask, issued_ns: u64, lifetime_ms: u32) {
        date(
            (&mut request.issued_ns, &mut request.lifetime_ms),
            (issued_ns, lifetime_ms),
        );
    }
}

/// `world/request`: what a person's hands do in the simulated world. The simulator or the emulator
/// answers. With real boards nobody answers.
#[derive(Clone, Copy, Debug)]
pub struct WorldRequest;

impl Request for WorldRequest {
    const NAME: &'static str = "world/request";
    type Request = WorldAsk;
    type Reply = WorldAnswer;
    const ACTOR: Part = Role::Simulator.part();
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
    use lager_sample::{LARGEST_COPY, Schema};

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
    fn actors_are_served_first_where_there_are_any() {
        for entry in TOPICS {
            assert_eq!(
                entry.qos.serves_actors_first(),
                !entry.qos.actors.is_empty()
            );
            assert!(entry.qos.actors.is_empty() || entry.layout.size <= LARGEST_COPY);
        }
    }

    #[test]
    fn no_observer_acts() {
        for entry in TOPICS {
            assert!(entry.qos.actors.iter().all(|actor| !actor.is_observer()));
        }
    }
}
