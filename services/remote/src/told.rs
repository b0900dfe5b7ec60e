//! What a gateway tells of itself beside samples, as JSON: [`About`] a topic, [`Beat`] and [`Time`].

use std::collections::BTreeMap;

use lager_home::Clock;
use serde::{Deserialize, Serialize};

use crate::note::Counts;

/// What a topic carries, which decides what is sent first when a link is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// What happens now and then.
    Event,
    /// What is true until the next sample, such as a latched stop.
    State,
    /// Samples that come all the time.
    Stream,
}

/// The answer under a topic's layout.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The payload's layout, as `lager_sample::Description` reads it.
    pub layout: String,
    /// Whether the topic carries a state, whose last sample answers queries under its key.
    pub state: bool,
    /// How many samples a second are sent at most; null if all are.
    pub rate: Option<f64>,
    /// Who is at its ends on the robot.
    pub ends: Ends,
}

/// Who writes and reads a topic on the robot.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ends {
    /// How many programs write it.
    pub publishers: usize,
    /// How many read it, the gateway among them.
    pub subscribers: usize,
    /// How many of these only observe.
    pub observers: usize,
    /// The parts of the processes that write it, by process id.
    pub writers: BTreeMap<u32, String>,
    /// The parts of those that read it.
    pub readers: BTreeMap<u32, String>,
    /// The parts of those that each sample wakes.
    pub woken: BTreeMap<u32, String>,
}

/// The answer under `@time`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// The robot's `CLOCK_MONOTONIC` at the answer, in ns; stamps have this time.
    pub now_ns: u64,
    /// What has to be added to that for the time since 1970, in ns, by the robot's own calendar.
    pub unix_offset_ns: i64,
    /// Which machine's clock that is, for as long as it runs: Linux's boot id.
    pub boot: String,
    /// The robot's own time a moment ago.
    pub robot: RobotTime,
}

/// The robot's own time, which runs slower or faster, as `--speed` says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RobotTime {
    /// In ns.
    pub ns: u64,
    /// When it was that, by the robot's `CLOCK_MONOTONIC` in ns.
    pub at_ns: u64,
}

impl Time {
    /// Now, on this machine.
    pub fn now(robot: RobotTime) -> Self {
        Self {
            now_ns: Clock::monotonic_ns(),
            unix_offset_ns: Clock::unix_offset_ns(),
            boot: boot(),
            robot,
        }
    }
}

/// What a gateway tells once a second.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Beat {
    /// The robot.
    pub robot: String,
    /// When the gateway began, in ns of the robot's `CLOCK_MONOTONIC`.
    pub run: u64,
    /// How many beats it has told before.
    pub number: u64,
    /// The robot's `CLOCK_MONOTONIC` now, in ns.
    pub now_ns: u64,
    /// How often what it tells of topics has changed in this run.
    pub about: u64,
    /// What it has counted of each topic.
    pub topics: BTreeMap<String, Told>,
}

/// What a beat tells of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Told {
    /// [`Counts::next`].
    pub next: u64,
    /// [`Counts::left_out`].
    pub left_out: u64,
    /// [`Counts::lost`].
    pub lost: u64,
}

impl Beat {
    /// What the gateway has counted of a topic; `None` if it does not carry it.
    pub fn counts(&self, topic: &str) -> Option<Counts> {
        self.topics.get(topic).map(|told| Counts {
            run: self.run,
            next: told.next,
            left_out: told.left_out,
            lost: told.lost,
        })
    }
}

impl From<Counts> for Told {
    fn from(counts: Counts) -> Self {
        Self {
            next: counts.next,
            left_out: counts.left_out,
            lost: counts.lost,
        }
    }
}

/// The identity of this machine since it started; empty if the system does not tell it.
pub(crate) fn boot() -> String {
    let id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    id.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_is_golden() {
        let counts = Counts {
            run: 5,
            next: 3,
            left_out: 2,
            lost: 1,
        };
        let beat = Beat {
            robot: "r1".to_owned(),
            run: 5,
            number: 7,
            now_ns: 11,
            about: 2,
            topics: [("sensor/line".to_owned(), counts.into())].into(),
        };
        let text = r#"{"robot":"r1","run":5,"number":7,"now_ns":11,"about":2,"topics":{"sensor/line":{"next":3,"left_out":2,"lost":1}}}"#;
        assert_eq!(serde_json::to_string(&beat).expect("JSON"), text);
        assert_eq!(serde_json::from_str::<Beat>(text).expect("a beat"), beat);
        assert_eq!(beat.counts("sensor/line"), Some(counts));
        assert_eq!(beat.counts("nav/map"), None);
        let about = r#"{"layout":"A{a:u8}","state":true,"rate":null,"ends":{"publishers":1,"subscribers":2,"observers":1,"writers":{"7":"bridge"},"readers":{},"woken":{"8":"logic"}}}"#;
        let read: About = serde_json::from_str(about).expect("it reads");
        assert_eq!(serde_json::to_string(&read).expect("JSON"), about);
        let time = r#"{"now_ns":11,"unix_offset_ns":-13,"boot":"b","robot":{"ns":5,"at_ns":6}}"#;
        let read: Time = serde_json::from_str(time).expect("it reads");
        assert_eq!(serde_json::to_string(&read).expect("JSON"), time);
    }
}
