//! What `up` tells: a line on the terminal whenever the robot begins something new, and the one
//! JSON line at the end. It reads the bus as an observer and never writes to it.

use std::io::Write;
use std::time::Duration;

use anyhow::Result;
use lager_ports::{Bus, Subscriber};
use lager_topics::{
    GoodState, LinkHealth, LogThought, MissionEvent, NavStatus, SensorDistance, SensorLine,
    SteeringState, TruthPose,
};
use serde::Serialize;

use crate::operator::Seen;

/// How a mission ended.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// The products delivered, in order.
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
}

/// The observer behind the terminal's lines.
pub struct Narrator {
    line: Subscriber<SensorLine>,
    distance: Subscriber<SensorDistance>,
    state: Subscriber<SteeringState>,
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
    event: Subscriber<MissionEvent>,
    thought: Subscriber<LogThought>,
    truth: Subscriber<TruthPose>,
    seen: Seen,
    goods: Vec<(i32, GoodState)>,
    said: String,
    now: Duration,
    to_stderr: bool,
}

impl Narrator {
    /// Subscribes to everything it tells of. With `to_stderr` standard output stays free for
    /// the JSON line.
    pub fn new(bus: &Bus, to_stderr: bool) -> Result<Self> {
        Ok(Self {
            line: bus.subscriber()?,
            distance: bus.subscriber()?,
            state: bus.subscriber()?,
            health: bus.subscriber()?,
            status: bus.subscriber()?,
            event: bus.subscriber()?,
            thought: bus.subscriber()?,
            truth: bus.subscriber()?,
            seen: Seen::default(),
            goods: Vec::new(),
            said: String::new(),
            now: Duration::ZERO,
            to_stderr,
        })
    }

    /// Reads what is new and says what has changed. `now` is the robot time since the start.
    pub fn look(&mut self, now: Duration) -> Result<()> {
        self.now = now;
        while self.line.receive()?.is_some() {}
        while self.distance.receive()?.is_some() {}
        if let Some(report) = self.state.latest()? {
            self.seen.report = Some(*report);
        }
        if let Some(health) = self.health.latest()? {
            let before = self.seen.health.replace(*health);
            self.tell_links(before.as_ref(), &self.seen.health.unwrap_or_default());
        }
        if let Some(status) = self.status.latest()? {
            self.seen.status = Some(*status);
            self.tell_status(&self.seen.status.unwrap_or_default());
        }
        while let Some(event) = self.event.receive()? {
            self.tell_event(&event);
        }
        while let Some(thought) = self.thought.receive()? {
            let line = format!("{}: {}", thought.from, thought.text);
            self.say(&line);
        }
        if let Some(truth) = self.truth.latest()? {
            let goods: Vec<_> = truth
                .goods()
                .iter()
                .filter_map(|good| Some((good.id, good.state.get()?)))
                .collect();
            self.goods = goods;
        }
        Ok(())
    }

    /// What the operator sees.
    pub fn seen(&self) -> Seen {
        self.seen
    }

    /// Whether a simulated world agrees that `product` lies at the delivery station; `None` on a
    /// real robot, where nobody knows but the people there.
    pub fn truly_delivered(&self, product: i32) -> Option<bool> {
        let (_, state) = self.goods.iter().find(|(id, _)| *id == product)?;
        Some(*state == GoodState::Delivered)
    }

    /// Sensor and steering frames received so far.
    pub fn frames(&self) -> u64 {
        self.line.received() + self.distance.received() + self.state.received()
    }

    /// Frames lost so far: by this observer, by the services, and on the wires.
    pub fn lost(&self) -> u64 {
        let own = self.line.lost() + self.distance.lost() + self.state.lost();
        let health = self.seen.health.unwrap_or_default();
        let wires = u64::from(health.sensor.lost) + u64::from(health.steering.lost);
        let logic = self.seen.status.map_or(0, |status| status.frames_lost);
        own + wires + health.bus_lost + logic
    }

    /// Says a line of this process's own.
    pub fn note(&self, text: &str) {
        let line = format!("{:8.2} s  {text}", self.now.as_secs_f64());
        // A closed terminal is no reason to stop a robot.
        let _ = if self.to_stderr {
            writeln!(std::io::stderr(), "{line}")
        } else {
            writeln!(std::io::stdout(), "{line}")
        };
    }

    fn say(&mut self, line: &str) {
        if self.said != line {
            self.note(line);
            line.clone_into(&mut self.said);
        }
    }
}
