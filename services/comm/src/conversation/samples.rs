//! Takes the samples of the robot's other services.

use core::time::Duration;

use lager_floor::Node;
use lager_home::Watched;
use lager_lines::conversation::RobotLine;
use lager_lines::extension::{Happened, Report};
use lager_orders::{Code, Moment, Reason};
use lager_topics::{
    BridgeAnswer, Event, Health, NavigatorStatus, OrderQueue, Role, Route, SteeringReport, Thought,
    WorldAnswer,
};

use super::{AGAIN, Asker, Conversation, STOPPED, UNTOLD};
use crate::known::{Machine, Senses, Stood};
use crate::{speech, telling};

impl Conversation {
    /// The bridge says who may steer.
    pub fn health(&mut self, now: Moment, health: &Health) {
        let before = self.known.take_health(now.ns, health);
        self.note(now, before.as_ref(), health);
        let mode_before = before.and_then(|before| before.mode.get());
        if self.known.mode() != mode_before {
            // An action of one mode has no meaning in the other.
            self.driving.let_go(Code::ModeChanged);
            self.held.clear();
        }
        self.driving.refused(now.robot, health);
        if health.stopped != 0 && self.driving.let_go(STOPPED) {
            self.think(STOPPED);
        }
        self.orders.health(health);
        self.settle();
        self.ask(now);
    }

    /// Logic says where it is and what it does, in a sample that was published at this moment.
    pub fn status(&mut self, now: Moment, status: &NavigatorStatus, published_ns: u64) {
        self.known.status = Some(*status);
        self.status_ns = published_ns;
        self.orders.status(status, published_ns);
        self.settle();
        if let Some(heading) = status.heading.get() {
            let line = self.told.looks(heading);
            self.say_if_up(line);
        }
        self.tell_events(now);
        self.ask(now);
    }

    /// Logic says what it will fetch.
    pub fn queue(&mut self, now: Moment, queue: &OrderQueue) {
        self.known.queue = Some(*queue);
        self.orders.queue(now, queue);
        self.settle();
        self.ask(now);
    }

    /// Something has happened on a mission; the event was published at this moment. The station
    /// hears it when a later status is known, with the queue and the route of that status.
    pub fn event(&mut self, now: Moment, event: &Event, published_ns: u64) {
        self.untold.push_back((published_ns, *event));
        self.tell_events(now);
    }

    /// Tells the events whose status is known, and those that have waited for it in vain.
    pub(super) fn tell_events(&mut self, now: Moment) {
        while let Some((published_ns, event)) = self.untold.front().copied() {
            if self.status_ns < published_ns && now.ns < published_ns + UNTOLD {
                return;
            }
            self.untold.pop_front();
            self.tell_event(now, &event);
        }
    }

    fn tell_event(&mut self, now: Moment, event: &Event) {
        let waited = (self.is_ordering(), self.orders.has_picked());
        self.orders.event(event);
        // A person who answered a question gets the reason from logic, in a thought.
        let mut ended = self.orders.ended();
        ended.retain(|ended| ended.whose != Asker::Question);
        if waited != (self.is_ordering(), self.orders.has_picked()) {
            // The order was refused.
            self.ask_from_ns = now.ns + AGAIN;
        }
        if let Some(report) = telling::event(event, &self.known) {
            self.remember(now, report);
        }
        self.tell_ended(ended);
        self.settle();
        self.ask(now);
    }

    /// The steering board has reported.
    pub fn report(&mut self, now: Moment, report: &SteeringReport) {
        self.known.report = Some(*report);
        self.battery.read(now.robot, report.battery_decivolts);
        self.driving.reported(now.robot, report);
        // Use the board's report, which has just come.
        let stands = (report.left_duty, report.right_duty, report.age_ms) == (0, 0, 0);
        if self.known.is_stopped() && stands && self.known.board_tells_duties() {
            if let (Stood::Awaited, Some(health)) = (self.known.stood, &self.known.health) {
                let after = Duration::from_nanos(now.ns.saturating_sub(health.stopped_at_ns));
                self.known.stood = Stood::After(after);
            }
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
            let line = self.told.node(Node {
                x: node.x,
                y: node.y,
            });
            self.say_if_up(line);
        }
        self.known.route = Some(Box::new(*route));
    }

    /// New samples of topics that only the extension uses.
    pub fn senses(&mut self, new: Senses) {
        self.known.is_simulated |= new.truth.is_some();
        let known = &mut self.known.senses;
        known.line = new.line.or(known.line);
        known.distance = new.distance.or(known.distance);
        known.blocks = new.blocks.or_else(|| known.blocks.take());
        known.latency = new.latency.or_else(|| known.latency.take());
        known.truth = new.truth.or_else(|| known.truth.take());
    }

    /// How the machine is; a second later somebody asks again.
    pub fn machine(&mut self, machine: Machine) {
        self.known.machine = machine;
    }

    /// How the services are that `lager up` keeps alive.
    pub fn services(&mut self, now: Moment, services: Vec<Watched>) {
        for (kind, service) in self.lives.look(now.ns, &services) {
            self.happened(now, kind, &service);
        }
        self.known.services = services;
    }

    /// What a person has asked of the robot at this moment, but not through the station: the part by
    /// which, and the words of the action.
    pub fn asked(&mut self, at_ns: u64, words: &str) {
        let at = Moment {
            ns: at_ns,
            ..Moment::default()
        };
        self.happened(at, Happened::Asked, words);
    }

    /// A service has thought something.
    pub fn thought(&mut self, thought: &Thought) {
        let now = Moment {
            ns: self.turned_ns,
            ..Moment::default()
        };
        self.remember(now, telling::thinks(thought));
        self.say_if_up(Some(speech::thought(&thought.to_string())));
    }

    /// This process itself has started again.
    pub fn lives_again(&mut self, now: Moment) {
        for kind in [Happened::Ended, Happened::Restarted] {
            self.happened(now, kind, Role::Comm.as_str());
        }
    }

    /// Tells people the bridge's news: stops, and who may drive.
    fn note(&mut self, now: Moment, before: Option<&Health>, health: &Health) {
        let Some(before) = before else { return };
        let is_another = before.stopped_at_ns != health.stopped_at_ns;
        if health.stopped != 0 && (before.stopped == 0 || is_another) {
            self.known.stood = Stood::Awaited;
            self.happened(now, Happened::Stopped, &telling::stop_words(health));
        } else if before.stopped != 0 && health.stopped == 0 {
            self.known.stood = Stood::Unseen;
            self.happened(now, Happened::Resumed, "");
        }
        if let Some(mode) = health.mode.get().filter(|_| before.mode != health.mode) {
            self.happened(now, Happened::Mode, mode.as_str());
        }
    }

    pub(super) fn happened(&mut self, now: Moment, kind: Happened, text: &str) {
        let report = telling::happened(kind, text, &self.known);
        self.remember(now, report);
    }

    /// Tells it to a station that speaks the extension, and keeps it for a later one.
    fn remember(&mut self, now: Moment, report: Report) {
        self.memory.keep(now.ns, report.clone());
        if self.is_extended {
            self.say_if_up(Some(RobotLine::Report(report)));
        }
    }

    /// The answer to a request to the bridge; `Err` is why there is none.
    pub fn answered_by_bridge(&mut self, id: u32, answer: Result<BridgeAnswer, Reason>) {
        let seen = self.known.seen();
        self.orders.answered(id, answer, &seen);
        self.settle();
    }

    /// The answer to a request to the simulated world; `Err` is why there is none.
    pub fn answered_by_world(
        &mut self,
        now: Moment,
        id: u32,
        answer: &Result<WorldAnswer, Reason>,
    ) {
        self.orders.world_answered(now, id, answer);
        self.settle();
    }
}
