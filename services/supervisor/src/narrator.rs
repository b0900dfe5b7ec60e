//! Prints a line whenever the robot begins something new. It reads the bus as an observer and never
//! writes to it. `terminal.rs` shows the lines.

use std::time::Duration;

use anyhow::Result;
use lager_operator::Seen;
use lager_orders::{Mode, Reason};
use lager_ports::{Bus, Subscriber};
use lager_topics::{
    Event, EventKind, Goal, GoodState, Health, LinkHealth, LogThought, MissionEvent, MissionQueue,
    NavStatus, NavigatorStatus, Phase, SensorDistance, SensorLine, SteeringState, StopCause,
    ThoughtKind, TruthPose,
};
use serde::{Deserialize, Serialize};

use crate::stopped::describe;

/// The observer behind the terminal's lines.
pub(crate) struct Narrator {
    line: Subscriber<SensorLine>,
    distance: Subscriber<SensorDistance>,
    state: Subscriber<SteeringState>,
    health: Subscriber<LinkHealth>,
    status: Subscriber<NavStatus>,
    queue: Subscriber<MissionQueue>,
    event: Subscriber<MissionEvent>,
    thought: Subscriber<LogThought>,
    truth: Subscriber<TruthPose>,
    seen: Seen,
    goods: Vec<(i32, GoodState)>,
    doing: String,
    now: Duration,
    notes: Vec<Note>,
    told: RecentLines,
    heard: Vec<u32>,
    joins_late: bool,
}

/// A line for the terminal.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Note {
    /// Robot time since the robot's start.
    pub(crate) at: Duration,
    /// Who speaks: a service, or the robot itself.
    pub(crate) who: String,
    /// What happened.
    pub(crate) text: String,
}

/// A line that is repeated within this time appears only once.
const TOLD: Duration = Duration::from_secs(10);

/// The last lines. The station asks a person who answers wrongly again several times a second, and
/// the person would see the same line each time.
#[derive(Debug, Default)]
struct RecentLines {
    /// When each line appeared last, and who said it.
    lines: Vec<(Duration, String, String)>,
}

impl RecentLines {
    /// Whether the line did not appear in the last while. It counts as shown now.
    fn is_new(&mut self, now: Duration, who: &str, text: &str) -> bool {
        self.lines.retain(|(said, ..)| now < *said + TOLD);
        let mut lines = self.lines.iter_mut();
        match lines.find(|(_, speaker, line)| speaker == who && line == text) {
            Some((said, ..)) => {
                *said = now;
                false
            }
            None => {
                self.lines.push((now, who.to_owned(), text.to_owned()));
                true
            }
        }
    }
}

impl Narrator {
    /// Subscribes to everything that it reports. If it joins late, the state that it sees first
    /// counts as reported.
    pub(crate) fn new(bus: &Bus, joins_late: bool) -> Result<Self> {
        Ok(Self {
            line: bus.subscriber()?,
            distance: bus.subscriber()?,
            state: bus.subscriber()?,
            health: bus.subscriber()?,
            status: bus.subscriber()?,
            queue: bus.subscriber()?,
            event: bus.subscriber()?,
            thought: bus.subscriber()?,
            truth: bus.subscriber()?,
            seen: Seen::default(),
            goods: Vec::new(),
            doing: String::new(),
            now: Duration::ZERO,
            notes: Vec::new(),
            told: RecentLines::default(),
            heard: Vec::new(),
            joins_late,
        })
    }

    /// Reads new samples and reports changes. `now` is the robot time since the start.
    pub(crate) fn look(&mut self, now: Duration) -> Result<()> {
        self.now = now;
        while self.line.receive()?.is_some() {}
        while self.distance.receive()?.is_some() {}
        while self.state.receive()?.is_some() {}
        if let Some(health) = self.health.latest()? {
            self.heard.push(health.stamp().writer);
            let health = *health;
            let before = self.seen.health.replace(health);
            if before.is_some() || !self.joins_late {
                self.tell_links(before.as_ref(), &health);
            }
        }
        if let Some(status) = self.status.latest()? {
            self.heard.push(status.stamp().writer);
            let status = *status;
            self.seen.status = Some(status);
            self.tell_status(&status);
        }
        if let Some(queue) = self.queue.latest()? {
            self.seen.queue = Some(*queue);
        }
        while let Some(event) = self.event.receive()?.map(|event| *event) {
            self.tell_event(&event);
        }
        while let Some(thought) = self.thought.receive()?.map(|thought| *thought) {
            if thought.kind.get().is_none_or(is_only_thought) {
                let from = thought.from.to_string().to_lowercase();
                self.note(&from, &format!("\"{thought}\""));
            }
        }
        if let Some(truth) = self.truth.latest()? {
            self.heard.push(truth.stamp().writer);
            let goods: Vec<_> = truth
                .goods()
                .iter()
                .filter_map(|good| Some((good.id, good.state.get()?)))
                .collect();
            self.goods = goods;
        }
        Ok(())
    }

    /// The states by which a mission is judged.
    pub(crate) fn seen(&self) -> &Seen {
        &self.seen
    }

    /// Whether `product` lies at the delivery station in the simulated world; `None` on a real
    /// robot, where only people can see that.
    pub(crate) fn truly_delivered(&self, product: i32) -> Option<bool> {
        let (_, state) = self.goods.iter().find(|(id, _)| *id == product)?;
        Some(*state == GoodState::Delivered)
    }

    /// Sensor and steering frames received so far.
    pub(crate) fn frames(&self) -> u64 {
        self.line.received() + self.distance.received() + self.state.received()
    }

    /// Frames this observer has lost so far.
    pub(crate) fn lost_here(&self) -> u64 {
        self.line.lost() + self.distance.lost() + self.state.lost()
    }

    /// Frames lost so far by the services and on the wires.
    pub(crate) fn lost_elsewhere(&self) -> u64 {
        let health = self.seen.health.unwrap_or_default();
        let wires = u64::from(health.sensor.lost_total) + u64::from(health.steering.lost_total);
        let logic = self.seen.status.map_or(0, |status| status.frames_lost);
        wires + health.bus_lost + logic
    }

    /// Adds a line, unless the same line appeared a moment ago.
    pub(crate) fn note(&mut self, who: &str, text: &str) {
        if self.told.is_new(self.now, who, text) {
            self.push(who, text);
        }
    }

    fn push(&mut self, who: &str, text: &str) {
        self.notes.push(Note {
            at: self.now,
            who: who.to_owned(),
            text: text.to_owned(),
        });
    }

    /// The processes that have published the state of a service since the last call.
    pub(crate) fn take_heard(&mut self) -> Vec<u32> {
        core::mem::take(&mut self.heard)
    }

    /// Takes the new lines.
    pub(crate) fn take_notes(&mut self) -> Vec<Note> {
        core::mem::take(&mut self.notes)
    }
}

impl Narrator {
    /// Reports changes of the links and of who may steer. For a stop and for the mode, the page has
    /// sentences of its own: here a person reads how old the stop is, and what releases it.
    fn tell_links(&mut self, before: Option<&Health>, now: &Health) {
        let boards = [
            ("sensor", before.map(|b| b.sensor), now.sensor),
            ("steering", before.map(|b| b.steering), now.steering),
        ];
        for (name, before, now) in boards {
            let was_up = before.is_some_and(|before| before.up != 0);
            if now.up != 0 && !was_up {
                self.push("bridge", &format!("the {name} board is connected"));
                if let Some(misfit) = now.misfit() {
                    self.push(
                        "bridge",
                        &format!("the {name} board does not fit: {misfit}"),
                    );
                }
            } else if now.up == 0 && was_up {
                self.push("bridge", &format!("the {name} board is silent"));
            } else if before.is_some_and(|before| before.reboots < now.reboots) {
                self.push(
                    "bridge",
                    &format!("the {name} board has restarted ({})", now.reset_cause),
                );
            }
        }
        if before.map(|before| before.mode) != Some(now.mode) {
            match now.mode.get() {
                Some(Mode::Autonomous) => self.push("bridge", "logic steers"),
                _ => self.push("bridge", "the operator steers"),
            }
        }
        let stop = |health: &Health| (health.stopped != 0).then_some(health.stopped_at_ns);
        let (was, is) = (before.and_then(stop), stop(now));
        if is.is_some() && is != was {
            let cause = now.stop_cause.get().unwrap_or(StopCause::WordDamaged);
            let said = describe(now.stop_origin.get(), cause, now.stopped_at_ns);
            self.push(
                "bridge",
                &format!("STOPPED {said}; `lager resume` lets the robot go on"),
            );
        } else if is.is_none() && was.is_some() {
            let released = Reason::of("event_resumed", |_| None);
            self.push("bridge", &released.to_string());
        }
    }

    /// Reports what logic is doing, when it begins something else.
    fn tell_status(&mut self, status: &NavigatorStatus) {
        let heading = status.heading.to_string().to_lowercase();
        let place = format!("({},{}) heading {heading}", status.x, status.y);
        let line = match status.phase.get() {
            Some(Phase::WaitingForMap) => "waits for the map".into(),
            Some(Phase::WaitingForOrder) => format!("waits for an order at {place}"),
            Some(Phase::Driving) => format!("drives from {place}"),
            Some(Phase::Turning) => format!("turns at {place}"),
            Some(Phase::Approaching) => format!(
                "looks for the station of goods {} from {place}",
                status.product
            ),
            Some(Phase::Positioning) => "turns in to the station".into(),
            Some(Phase::Picking) => format!("is in position at goods {}", status.product),
            // Somebody may cancel an order while the robot turns in, or send the robot off.
            Some(Phase::Leaving) if status.goal != Goal::Delivery => {
                "leaves the station without goods".into()
            }
            Some(Phase::Leaving) => format!("leaves the station with goods {}", status.product),
            Some(Phase::Exiting) => "follows the line to the delivery station".into(),
            Some(Phase::Dropping) => format!("lays down goods {}", status.product),
            Some(Phase::BackingOff) => "backs off from the delivery station".into(),
            Some(Phase::TurningRound) => "turns round".into(),
            Some(Phase::Returning) => "returns to the warehouse".into(),
            Some(Phase::Stuck) => format!("is STUCK at {place}"),
            Some(Phase::Halted) => format!("stands before something behind {place}"),
            Some(Phase::TurningBack) => format!("turns back to ({},{})", status.x, status.y),
            Some(Phase::Lost) => "is LOST: it was restarted and nobody kept where it was".into(),
            // These last only for a moment.
            Some(Phase::Looking) | None => return,
        };
        if self.doing != line {
            if !(self.doing.is_empty() && self.joins_late) {
                // After something else, the same activity is new again.
                self.push("robot", &line);
            }
            self.doing = line;
        }
    }

    fn tell_event(&mut self, event: &Event) {
        let Event {
            order_id,
            product,
            failure,
            ..
        } = *event;
        let kind = match event.kind.get() {
            // The lines about logic's activity report the first two already, and a thought reports
            // the third with what ends it.
            Some(EventKind::InPosition | EventKind::NextNode | EventKind::Failed) | None => return,
            Some(kind) => kind,
        };
        if kind == EventKind::Refused {
            self.seen.refused = Some((order_id, product, failure));
        }
        let said = Reason::of(&format!("event_{}", kind.as_str()), |key| {
            Some(match (key, kind) {
                ("product", _) => product.to_string(),
                (_, EventKind::WayBlocked) => {
                    let heading = event.heading.to_string().to_lowercase();
                    format!("({},{}) heading {heading}", event.x, event.y)
                }
                _ => format!("({},{})", event.x, event.y),
            })
        });
        let text = match failure.is_none() {
            true => said.to_string(),
            false => format!("{said}: {failure}"),
        };
        match kind {
            EventKind::GettingItem | EventKind::ItemDelivered => self.push("robot", &text),
            // The robot may find the same thing again and again.
            _ => self.note("robot", &text),
        }
    }
}

/// Whether no line about the robot's activity and its events says the same as a thought of this
/// kind.
fn is_only_thought(kind: ThoughtKind) -> bool {
    !matches!(
        kind,
        ThoughtKind::WayBlocked
            | ThoughtKind::OrderRefused
            | ThoughtKind::Fetching
            | ThoughtKind::Picking
            | ThoughtKind::PickupRefused
            | ThoughtKind::HasGoods
            | ThoughtKind::Delivered
            | ThoughtKind::TurnsLeft
            | ThoughtKind::TurnsRight
            | ThoughtKind::SeeksStation
            | ThoughtKind::LeavesToDeliver
            | ThoughtKind::IsBack
            | ThoughtKind::Halts
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_again_and_again_is_told_once_until_it_has_been_quiet() {
        let mut told = RecentLines::default();
        let at = |ms: u64| Duration::from_millis(ms);
        let mut lines = 0;
        // Two sentences five times a second, for a minute.
        for turn in 0..300 {
            lines += usize::from(told.is_new(at(turn * 200), "robot", "does not have goods 1"));
            lines += usize::from(told.is_new(at(turn * 200), "logic", "\"the claw is empty\""));
        }
        assert_eq!(lines, 2);
        assert!(told.is_new(at(60_000), "robot", "does not have goods 2"));
        assert!(told.is_new(at(60_000), "logic", "does not have goods 2"));
        let later = at(60_000) + TOLD + TOLD;
        assert!(told.is_new(later, "robot", "does not have goods 1"));
        assert_eq!(told.lines.len(), 1, "nothing is kept for ever");
    }
}
