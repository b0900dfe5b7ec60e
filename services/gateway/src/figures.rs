//! The robot's figures. Those of each topic come from the stamps. All others come from the states
//! that bridge, logic and boards publish.

use std::any::Any;
use std::collections::BTreeMap;
use std::time::Duration;

use lager_home::Clock;
use lager_ports::TopicInfo;
use lager_sample::Stamp;
use lager_topics::{
    CommandLatency, DistanceFrame, Health, LineFrame, NavigatorStatus, PathLatency, SteeringReport,
};

use crate::processes::{self, Process};

/// What is known of one topic.
#[derive(Clone, Debug, Default)]
pub(crate) struct TopicFigures {
    /// Samples that have come.
    pub(crate) received: u64,
    /// Samples that were overwritten before the gateway looked.
    pub(crate) lost: u64,
    /// When the last one was published, in ns of `CLOCK_MONOTONIC`; 0 = none has come.
    pub(crate) published_ns: u64,
    pub(crate) writers: usize,
    pub(crate) readers: usize,
}

/// Everything that the gateway shows.
#[derive(Clone, Debug)]
pub(crate) struct Figures {
    pub(crate) robot: String,
    /// The difference between ns since 1970 and a stamp's time, by the robot's calendar.
    pub(crate) unix_offset_ns: i64,
    pub(crate) topics: BTreeMap<String, TopicFigures>,
    pub(crate) health: Option<Health>,
    pub(crate) status: Option<NavigatorStatus>,
    pub(crate) report: Option<SteeringReport>,
    /// When the sensor board and the steering board last spoke, in ns of `CLOCK_MONOTONIC`.
    pub(crate) heard_ns: [Option<u64>; 2],
    /// The latencies from sensor frames to logic's decision, and from logic's orders to the wire.
    pub(crate) path: Option<Box<PathLatency>>,
    pub(crate) command: Option<Box<CommandLatency>>,
    pub(crate) processes: Vec<Process>,
}

impl Figures {
    pub(crate) fn new(robot: &str) -> Self {
        Self {
            robot: robot.to_owned(),
            unix_offset_ns: Clock::unix_offset_ns(),
            topics: BTreeMap::new(),
            health: None,
            status: None,
            report: None,
            heard_ns: [None; 2],
            path: None,
            command: None,
            processes: Vec::new(),
        }
    }

    /// A sample of any topic has come; `lost` were missed so far.
    pub(crate) fn count(&mut self, topic: &str, stamp: &Stamp, lost: u64) {
        // Found first: the name is copied once.
        if !self.topics.contains_key(topic) {
            self.topics
                .insert(topic.to_owned(), TopicFigures::default());
        }
        if let Some(figures) = self.topics.get_mut(topic) {
            figures.received += 1;
            figures.lost = lost;
            figures.published_ns = figures.published_ns.max(stamp.publish_time_ns);
        }
    }

    /// Takes the figures of a sample, if it has any. `real` converts a span of robot time.
    pub(crate) fn learn(
        &mut self,
        stamp: &Stamp,
        payload: &dyn Any,
        real: &dyn Fn(Duration) -> Duration,
    ) {
        if payload.is::<LineFrame>() || payload.is::<DistanceFrame>() {
            self.heard_ns[0] = Some(stamp.source_time_ns);
        } else if let Some(report) = payload.downcast_ref::<SteeringReport>() {
            self.report = Some(*report);
            if report.age_ms != SteeringReport::NEVER_HEARD {
                let age = real(Duration::from_millis(report.age_ms.into()));
                let heard_ns = stamp.publish_time_ns.saturating_sub(age.as_nanos() as u64);
                self.heard_ns[1] = Some(heard_ns);
            }
        } else if let Some(health) = payload.downcast_ref::<Health>() {
            self.health = Some(*health);
        } else if let Some(status) = payload.downcast_ref::<NavigatorStatus>() {
            self.status = Some(*status);
        } else if let Some(path) = payload.downcast_ref::<PathLatency>() {
            self.path = Some(Box::new(*path));
        } else if let Some(command) = payload.downcast_ref::<CommandLatency>() {
            self.command = Some(Box::new(*command));
        }
    }

    /// The programs that write and read the topics. Of those on another machine nothing more is known.
    pub(crate) fn look_at_ends(&mut self, topics: &[TopicInfo], are_here: bool) {
        for topic in topics {
            let figures = self.topics.entry(topic.name.clone()).or_default();
            (figures.writers, figures.readers) = (topic.publishers, topic.subscribers);
        }
        if are_here {
            self.processes = processes::at(topics);
        }
    }
}
