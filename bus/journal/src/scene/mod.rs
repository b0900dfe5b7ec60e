//! Draws the warehouse, the robot in it and its thoughts, as messages that Foxglove shows without
//! any setting.
//!
//! ```text
//!  nav/map     ──> foxglove/map        SceneUpdate: tape, goods' places, delivery
//!  nav/blocks  ──> foxglove/blocks     SceneUpdate: ways that are blocked
//!  truth/pose  ──> foxglove/world      SceneUpdate: goods and things on the floor, as they are
//!              ├─> foxglove/pose       PoseInFrame: where the robot is
//!              └─> foxglove/frames     FrameTransform: `robot` in `map`
//!  nav/status  ──> foxglove/believed   PoseInFrame: where the navigator takes it to be
//!              ├─> foxglove/frames     FrameTransform: `navigator` in `map`
//!  (the first) └─> foxglove/bodies     SceneUpdate: a body in each of these two frames
//!  log/thought ──> foxglove/log        Log
//! ```
//!
//! A [`Scene`] takes messages as they are in a recording ([`Envelope`]), and returns more messages,
//! for channels of their own ([`View`]). It is pure. These messages are not samples of the bus, and
//! tools that want samples skip their channels.
//!
//! Lengths are in m. `map` has its origin at node (0, 0), x to the right and y up.

pub mod drawn;
mod schema;
pub mod shapes;

use lager_sample::Topic;
use lager_topics::{
    BlockedWays, LogThought, NavBlocks, NavMap, NavStatus, NavigatorStatus, Thought, Truth,
    TruthPose, WarehouseMap,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::envelope::{Envelope, EnvelopeSchema};
pub use schema::Kind;
use shapes::Time;

/// A channel of derived messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum View {
    /// The warehouse.
    Map,
    /// Ways that are blocked.
    Blocks,
    /// Goods and things on the floor.
    World,
    /// The robot's body.
    Bodies,
    /// Where the robot is.
    Pose,
    /// Where the navigator believes the robot to be.
    Believed,
    /// The robot's frames within the warehouse's frame.
    Frames,
    /// What the services think.
    Log,
}

impl View {
    /// Every view.
    pub const ALL: [Self; 8] = [
        Self::Map,
        Self::Blocks,
        Self::World,
        Self::Bodies,
        Self::Pose,
        Self::Believed,
        Self::Frames,
        Self::Log,
    ];

    /// The channel's name.
    pub const fn topic(self) -> &'static str {
        match self {
            Self::Map => "foxglove/map",
            Self::Blocks => "foxglove/blocks",
            Self::World => "foxglove/world",
            Self::Bodies => "foxglove/bodies",
            Self::Pose => "foxglove/pose",
            Self::Believed => "foxglove/believed",
            Self::Frames => "foxglove/frames",
            Self::Log => "foxglove/log",
        }
    }

    /// The kind of its messages.
    pub const fn kind(self) -> Kind {
        match self {
            Self::Map | Self::Blocks | Self::World | Self::Bodies => Kind::SceneUpdate,
            Self::Pose | Self::Believed => Kind::PoseInFrame,
            Self::Frames => Kind::FrameTransform,
            Self::Log => Kind::Log,
        }
    }

    /// The topics from which its messages are derived.
    pub const fn made_of(self) -> &'static [&'static str] {
        match self {
            Self::Map => &[NavMap::NAME],
            Self::Blocks => &[NavBlocks::NAME, NavMap::NAME],
            Self::World | Self::Pose => &[TruthPose::NAME],
            Self::Bodies | Self::Frames => &[TruthPose::NAME, NavStatus::NAME],
            Self::Believed => &[NavStatus::NAME],
            Self::Log => &[LogThought::NAME],
        }
    }

    /// Its schema, as a file has it.
    pub fn schema(self) -> EnvelopeSchema {
        EnvelopeSchema {
            name: self.kind().name().to_owned(),
            text: self.kind().schema().to_string().into_bytes().into(),
        }
    }

    /// Whether its last message stays true until the next one, so that a reader who begins later
    /// needs it.
    pub const fn is_lasting(self) -> bool {
        matches!(self.kind(), Kind::SceneUpdate)
    }
}

/// A message for a channel of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Which channel.
    pub view: View,
    /// The message, in JSON.
    pub message: Vec<u8>,
}

/// The state from which messages are derived.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    map: Option<Box<WarehouseMap>>,
    blocks: Option<Box<BlockedWays>>,
    /// The things on the floor as they were shown last, and when.
    world: Option<(u64, Box<Truth>)>,
    has_bodies: bool,
    /// The last message of each view that stays true.
    lasting: Vec<Shown>,
}

/// Goods that move are shown at this interval, in ns.
const WORLD_PACE_NS: u64 = 100_000_000;

impl Scene {
    /// Takes a message of a topic, published at that time in ns since 1970, and returns the
    /// messages to show. A message of another topic or another build gives none.
    pub fn take(&mut self, topic: &str, unix_ns: u64, message: &[u8]) -> Vec<Shown> {
        let mut shown = Vec::new();
        let time = Time::of_ns(unix_ns);
        if topic == NavMap::NAME {
            if let Some(map) = payload::<WarehouseMap>(message) {
                shown.push(show(View::Map, &drawn::map(&map, time)));
                if let Some(ways) = &self.blocks {
                    shown.push(show(View::Blocks, &drawn::blocks(ways, &map, time)));
                }
                self.map = Some(Box::new(map));
            }
        } else if topic == NavBlocks::NAME {
            if let Some(ways) = payload::<BlockedWays>(message) {
                // Without a map nobody knows how far nodes are apart.
                if let Some(map) = &self.map {
                    shown.push(show(View::Blocks, &drawn::blocks(&ways, map, time)));
                }
                self.blocks = Some(Box::new(ways));
            }
        } else if topic == TruthPose::NAME {
            if let Some(truth) = payload::<Truth>(message) {
                self.bodies(time, &mut shown);
                shown.push(show(View::Pose, &drawn::pose(&truth, time)));
                shown.push(show(View::Frames, &drawn::frame(&truth, time)));
                self.world(truth, unix_ns, &mut shown);
            }
        } else if topic == NavStatus::NAME {
            if let (Some(status), Some(map)) = (payload::<NavigatorStatus>(message), &self.map)
                && let Some(pose) = status.pose(map)
            {
                self.bodies(time, &mut shown);
                shown.push(show(View::Believed, &drawn::believed(pose, time)));
                shown.push(show(View::Frames, &drawn::believed_frame(pose, time)));
            }
        } else if topic == LogThought::NAME
            && let Some(thought) = payload::<Thought>(message)
        {
            shown.push(show(View::Log, &drawn::log(&thought, time)));
        }
        for new in shown.iter().filter(|shown| shown.view.is_lasting()) {
            self.lasting.retain(|old| old.view != new.view);
            self.lasting.push(new.clone());
        }
        shown
    }

    /// Whether messages of a topic show anything.
    pub fn looks_at(topic: &str) -> bool {
        View::ALL.iter().any(|view| view.made_of().contains(&topic))
    }

    /// The messages that a reader who begins now needs first.
    pub fn lasting(&self) -> &[Shown] {
        &self.lasting
    }

    fn bodies(&mut self, time: Time, shown: &mut Vec<Shown>) {
        if !self.has_bodies {
            self.has_bodies = true;
            shown.push(show(View::Bodies, &drawn::bodies(time)));
        }
    }

    /// Only when something has moved.
    fn world(&mut self, truth: Truth, unix_ns: u64, shown: &mut Vec<Shown>) {
        if let Some((at_ns, last)) = &self.world {
            let is_same = last.goods() == truth.goods() && last.obstacles() == truth.obstacles();
            let is_early = unix_ns.abs_diff(*at_ns) < WORLD_PACE_NS;
            if is_same || is_early {
                return;
            }
        }
        let side_m = self.map.as_ref().map_or(0.0, |map| drawn::side_m(map));
        // Things on ways stand where the map's nodes are.
        if side_m > 0.0 || truth.obstacles().is_empty() {
            shown.push(show(
                View::World,
                &drawn::world(&truth, side_m, Time::of_ns(unix_ns)),
            ));
            self.world = Some((unix_ns, Box::new(truth)));
        }
    }
}

fn payload<P: DeserializeOwned>(message: &[u8]) -> Option<P> {
    let envelope = serde_json::from_slice::<Envelope<P>>(message).ok()?;
    Some(envelope.payload)
}

fn show(view: View, message: &impl Serialize) -> Shown {
    let message = serde_json::to_vec(message).expect("numbers and texts are JSON");
    Shown { view, message }
}
