//! What the robot does, as its other services tell it.

use lager_lines::Coord;
use lager_lines::conversation::RobotLine;
use lager_lines::extension::{EventKind, Report};
use lager_topics::{
    Answer, Event, Health, NavigatorStatus, OrderQueue, Role, Route, SteeringReport, Thought,
    WorldAnswer,
};

use super::{AGAIN, Conversation, STOPPED};
use crate::known::Senses;
use crate::map::direction;
use crate::moment::Moment;
use crate::telling;

impl Conversation {
    /// The bridge has told who may steer.
    pub fn health(&mut self, now: Moment, health: &Health) {
        let before = self.known.health.replace(*health);
        self.note(now, before.as_ref(), health);
        let mode_before = before.and_then(|before| before.mode.get());
        if self.known.mode() != mode_before {
            // What was begun in one mode has no meaning in the other.
            self.driving.let_go("the mode has been changed");
            self.held.clear();
        }
        self.driving.refused(now.robot, health);
        if health.stopped != 0 && self.driving.let_go(STOPPED) {
            self.think(STOPPED);
        }
        self.tasks.health(health);
        self.settle();
        self.ask(now);
    }

    /// Logic has told where it is and what it does, in a sample that was published at this moment.
    pub fn status(&mut self, now: Moment, status: &NavigatorStatus, published_ns: u64) {
        self.known.status = Some(*status);
        self.tasks.status(status, published_ns);
        self.settle();
        if let Some(heading) = status.heading.get() {
            let line = self.told.looks(direction(heading));
            self.say_if_up(line);
        }
        self.ask(now);
    }

    /// Logic has told what it will fetch.
    pub fn queue(&mut self, now: Moment, queue: &OrderQueue) {
        self.known.queue = Some(*queue);
        self.tasks.queue(now, queue, &mut self.ids);
        self.settle();
        self.ask(now);
    }

    /// Something has happened on a mission.
    pub fn event(&mut self, now: Moment, event: &Event) {
        let waited = (self.tasks.has_order(), self.tasks.has_picked());
        self.tasks.event(event);
        if waited != (self.tasks.has_order(), self.tasks.has_picked()) {
            // It was refused.
            self.ask_from_ns = now.ns + AGAIN;
        }
        if let Some(report) = telling::event(event, &self.known) {
            self.remember(now, report);
        }
        self.settle();
        self.ask(now);
    }

    /// The steering board has reported.
    pub fn report(&mut self, now: Moment, report: &SteeringReport) {
        self.known.report = Some(*report);
        self.driving.reported(now.robot, report);
        // The board's own words, which have just come.
        let stands = (report.left_duty, report.right_duty, report.age_ms) == (0, 0, 0);
        if self.known.is_stopped() && stands && self.known.board_tells_duties() {
            for (number, since) in core::mem::take(&mut self.stops) {
                let after_ms = now.ns.saturating_sub(since) / 1_000_000;
                self.say(RobotLine::Report(Report::Stopped {
                    number,
                    after_ms: u32::try_from(after_ms).unwrap_or(u32::MAX),
                }));
            }
        }
        self.settle();
        self.ask(now);
    }

    /// Logic has planned another way.
    pub fn route(&mut self, route: &Route) {
        if let Some(node) = route.nodes().first() {
            let line = self.told.node(Coord {
                x: node.x,
                y: node.y,
            });
            self.say_if_up(line);
        }
        self.known.route = Some(Box::new(*route));
    }

    /// What is new of that which only the extension tells.
    pub fn senses(&mut self, new: Senses) {
        self.known.is_simulated |= new.truth.is_some();
        let known = &mut self.known.senses;
        known.line = new.line.or(known.line);
        known.distance = new.distance.or(known.distance);
        known.blocks = new.blocks.or_else(|| known.blocks.take());
        known.latency = new.latency.or_else(|| known.latency.take());
        known.truth = new.truth.or_else(|| known.truth.take());
    }

    /// A service has thought something.
    pub fn thought(&mut self, thought: &Thought) {
        let now = Moment {
            ns: self.turned_ns,
            ..Moment::default()
        };
        self.remember(now, telling::thinks(thought));
        self.think(&thought.to_string());
    }

    /// A service has published, whose life began then by its samples' stamps.
    pub fn lives(&mut self, now: Moment, service: Role, since: u64) {
        if self
            .lives
            .insert(service, since)
            .is_some_and(|before| before != since)
        {
            self.happened(now, EventKind::Restarted, service.as_str());
        }
    }

    /// This process itself has been started anew.
    pub fn lives_again(&mut self, now: Moment) {
        self.happened(now, EventKind::Restarted, Role::Comm.as_str());
    }

    /// Tells what of the bridge's word is news to a person: stops and who may drive.
    fn note(&mut self, now: Moment, before: Option<&Health>, health: &Health) {
        let Some(before) = before else { return };
        let is_another = before.stopped_at_ns != health.stopped_at_ns;
        if health.stopped != 0 && (before.stopped == 0 || is_another) {
            self.happened(now, EventKind::Stopped, &telling::stop_words(health));
        } else if before.stopped != 0 && health.stopped == 0 {
            self.happened(now, EventKind::Resumed, "");
        }
        if let Some(mode) = health.mode.get().filter(|_| before.mode != health.mode) {
            self.happened(now, EventKind::Mode, telling::mode(mode).as_str());
        }
    }

    pub(super) fn happened(&mut self, now: Moment, kind: EventKind, text: &str) {
        let report = telling::happened(kind, text, &self.known);
        self.remember(now, report);
    }

    /// Tells it to a station that speaks the extension, and keeps it for one that comes later.
    fn remember(&mut self, now: Moment, report: Report) {
        self.memory.keep(now.ns, report.clone());
        if self.is_extended {
            self.say_if_up(Some(RobotLine::Report(report)));
        }
    }

    /// What became of an [`Action::Ask`]; `Err` is why nobody knows.
    pub fn answered_by_bridge(&mut self, id: u32, answer: Result<Answer, String>) {
        self.tasks.answered(id, answer, &self.known);
        self.settle();
    }

    /// What became of an [`Action::AskWorld`]; `Err` is why nobody knows.
    pub fn answered_by_world(
        &mut self,
        now: Moment,
        id: u32,
        answer: &Result<WorldAnswer, String>,
    ) {
        self.tasks.world_answered(now, id, answer);
        self.settle();
    }
}
