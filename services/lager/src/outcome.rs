//! How a mission ended: the one JSON line, or the sentence, at the end of `lager up`.

use lager_topics::{FailureKind, Hold, Tag};
use serde::Serialize;

/// How a mission ended.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// The products delivered, in order, whoever has ordered them.
    pub delivered: Vec<i32>,
    /// Robot time from start to end.
    pub sim_seconds: f64,
    /// Real time from start to end.
    pub wall_seconds: f64,
    /// Sensor and steering frames seen on the bus.
    pub frames: u64,
    /// Frames lost on any way there: on the wires, and in any subscriber of the bus.
    pub lost: u64,
    /// Restarts of services.
    pub restarts: u32,
    /// Why the mission was not delivered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// What logic calls that, where it is logic that gave up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure_kind: Option<Tag<FailureKind>>,
    /// What keeps a robot that would go on by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hold: Option<Tag<Hold>>,
}

impl Outcome {
    /// The outcome in words.
    pub fn sentence(&self) -> String {
        let delivered = match self.delivered.len() {
            0 => String::new(),
            count => format!("; {count} delivered"),
        };
        match &self.failure {
            // What it has not seen may be why.
            Some(why) if self.lost > 0 => format!(
                "the mission failed: {why} ({} of {} frames were lost){delivered}",
                self.lost, self.frames
            ),
            Some(why) => format!("the mission failed: {why}{delivered}"),
            None => format!(
                "{} delivered in {:.1} s of robot time; {} frames, {} lost",
                self.delivered.len(),
                self.sim_seconds,
                self.frames,
                self.lost
            ),
        }
    }
}
