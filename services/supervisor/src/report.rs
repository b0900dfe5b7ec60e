//! How a mission ended, as the JSON line or the sentence at the end of `lager up`.

use lager_sample::Tag;
use lager_topics::{FailureKind, Hold};
use serde::Serialize;

/// How a mission ended.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct MissionReport {
    /// The delivered products, in order, whoever ordered them.
    pub(crate) delivered: Vec<i32>,
    /// Robot time from start to end.
    pub(crate) sim_seconds: f64,
    /// Real time from start to end.
    pub(crate) wall_seconds: f64,
    /// Sensor and steering frames seen on the bus.
    pub(crate) frames: u64,
    /// Frames that were lost: on the wires, and in any subscriber of the bus.
    pub(crate) lost: u64,
    /// Restarts of services.
    pub(crate) restarts: u32,
    /// Why the mission was not delivered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) failure: Option<String>,
    /// Logic's name for the reason, if logic gave up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) failure_kind: Option<Tag<FailureKind>>,
    /// The reason why a robot waits that will go on by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) hold: Option<Tag<Hold>>,
}

impl MissionReport {
    /// The result in words.
    pub(crate) fn sentence(&self) -> String {
        let delivered = match self.delivered.len() {
            0 => String::new(),
            count => format!("; {count} delivered"),
        };
        match &self.failure {
            // The lost frames may be the reason.
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
