//! What `up` tells: a line on the terminal whenever the robot begins something new, and the one
//! JSON line at the end. It reads the bus as an observer and never writes to it.

use std::io::Write;
use std::time::Duration;

use anyhow::Result;
use lager_ports::{Bus, Subscriber};
use lager_topics::{
    Event, EventKind, GoodState, Health, LinkHealth, LogThought, MissionEvent, Mode, NavStatus,
    NavigatorStatus, Phase, SensorDistance, SensorLine, SteeringState, TruthPose,
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
    doing: String,
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
            doing: String::new(),
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
        if let Some(health) = self.health.latest()?.map(|health| *health) {
            let before = self.seen.health.replace(health);
            self.tell_links(before.as_ref(), &health);
        }
        if let Some(status) = self.status.latest()?.map(|status| *status) {
            self.seen.status = Some(status);
            self.tell_status(&status);
        }
        while let Some(event) = self.event.receive()?.map(|event| *event) {
            self.tell_event(&event);
        }
        while let Some(thought) = self.thought.receive()?.map(|thought| *thought) {
            let from = thought.from.to_string().to_lowercase();
            self.note(&format!("{from}: \"{}\"", thought.text));
            thought.text.as_str().clone_into(&mut self.seen.thought);
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
    pub fn seen(&self) -> &Seen {
        &self.seen
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
        let wires = u64::from(health.sensor.lost_total) + u64::from(health.steering.lost_total);
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
}

impl Narrator {
    /// Tells what changed on the links and in who may steer.
    fn tell_links(&mut self, before: Option<&Health>, now: &Health) {
        let boards = [
            ("sensor", before.map(|b| b.sensor), now.sensor),
            ("steering", before.map(|b| b.steering), now.steering),
        ];
        for (name, before, now) in boards {
            let was_up = before.is_some_and(|before| before.up != 0);
            if now.up != 0 && !was_up {
                self.note(&format!("the {name} board is connected"));
            } else if now.up == 0 && was_up {
                self.note(&format!("the {name} board is silent"));
            } else if before.is_some_and(|before| before.reboots < now.reboots) {
                self.note(&format!(
                    "the {name} board has restarted ({})",
                    now.reset_cause
                ));
            }
        }
        if before.map(|before| before.mode) != Some(now.mode) {
            match now.mode.get() {
                Some(Mode::Autonomous) => self.note("logic steers"),
                _ => self.note("the operator steers"),
            }
        }
        let was_stopped = before.is_some_and(|before| before.stopped != 0);
        if (now.stopped != 0) != was_stopped {
            self.note(if was_stopped {
                "the stop is released"
            } else {
                "STOPPED; `lager resume` lets the robot go on"
            });
        }
    }

    /// Tells what logic is doing, when it does something else than before.
    fn tell_status(&mut self, status: &NavigatorStatus) {
        let heading = status.heading.to_string().to_lowercase();
        let place = format!("({},{}) heading {heading}", status.x, status.y);
        let line = match status.phase.get() {
            Some(Phase::WaitingForMap) => "waits for the map".into(),
            Some(Phase::WaitingForOrder) => format!("waits for an order at {place}"),
            Some(Phase::Driving) => format!("drives from {place}"),
            Some(Phase::Turning) => format!("turns at {place}"),
            Some(Phase::Approaching) => format!(
                "looks for the station of product {} from {place}",
                status.product
            ),
            Some(Phase::Positioning) => "turns in to the station".into(),
            Some(Phase::Picking) => format!("is in position at product {}", status.product),
            Some(Phase::Leaving) => format!("leaves the station with product {}", status.product),
            Some(Phase::Exiting) => "follows the line to the delivery station".into(),
            Some(Phase::Dropping) => format!("lays down product {}", status.product),
            Some(Phase::BackingOff) => "backs off from the delivery station".into(),
            Some(Phase::TurningRound) => "turns round".into(),
            Some(Phase::Returning) => "returns to the warehouse".into(),
            Some(Phase::Stuck) => format!("is STUCK at {place}"),
            None => return,
        };
        if self.doing != line {
            self.note(&line);
            self.doing = line;
        }
    }

    fn tell_event(&mut self, event: &Event) {
        let product = event.product;
        match event.kind.get() {
            Some(EventKind::GettingItem) => self.note(&format!("fetches product {product}")),
            Some(EventKind::ItemDelivered) => self.note(&format!("DELIVERED product {product}")),
            Some(EventKind::Refused) => {
                self.seen.refused = Some(event.order_id);
                self.note(&format!("refuses to fetch product {product}"));
            }
            // What logic is doing tells these already.
            Some(EventKind::InPosition | EventKind::NextNode) | None => {}
        }
    }

    /// The last words: a sentence, or the one line of JSON.
    pub fn finish(&self, outcome: &Outcome, as_json: bool) -> Result<()> {
        if as_json {
            return crate::say(&serde_json::to_string(outcome)?);
        }
        let said = match &outcome.failure {
            Some(why) => format!("the mission failed: {why}"),
            None => format!(
                "{} delivered in {:.1} s of robot time; {} frames, {} lost",
                outcome.delivered.len(),
                outcome.sim_seconds,
                outcome.frames,
                outcome.lost
            ),
        };
        self.note(&said);
        Ok(())
    }
}
